#include "pbm_render/detail/streamed_model.h"

#include "pbm_format/container/file_rules.h"
#include "pbm_render/bricks/chunk_offsets.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <new>
#include <system_error>
#include <utility>

namespace pbm {

struct StreamedModel::LoadedChunk {
    Chunk decoded;                                // of packed files; empty for mapped ones
    std::array<Bytes, kMaxLights> packed_shadows; // the same
    std::vector<BrickRecord> bricks;              // the same
    ChunkView view;
    ChunkOffsets offsets;
    Box bounds; // of its bricks
    std::uint8_t largest_radius = 0;
    Claim memory;

    // Once its view is there.
    void finish(int level) {
        bounds = bounds_of(view.bricks, level);
        for (const BrickRecord &brick : view.bricks)
            largest_radius = std::max(largest_radius, brick.largest_radius);
    }
};

namespace {

std::size_t index_of(int level) { return static_cast<std::size_t>(level); }

// Header, table and small sections: what Reader::open has read.
std::uint64_t opening_bytes(const Reader &reader) {
    std::uint64_t bytes = kHeaderBytes + reader.sections().size() * kSectionEntryBytes;
    for (const SectionEntry &section : reader.sections())
        if (section.type < SectionType::level_directory)
            bytes += section.stored_bytes;
    return bytes;
}

} // namespace

StreamedModel::StreamedModel(Reader reader, StreamingOptions options)
    : reader_(std::move(reader)), options_(std::move(options)), root_(reader_.root_chunk()),
      levels_(index_of(reader_.depth()) + 1), finest_(reader_.depth()) {
    statistics_.bytes_read = opening_bytes(reader_);
}

StreamedModel::~StreamedModel() = default;

Status StreamedModel::read_directory(int level) {
    assert(level == known_levels_ + 1); // only this thread changes it
    const Result<const LevelDirectory *> read = reader_.directory(level);
    const std::lock_guard lock(mutex_);
    if (!read) {
        if (read.error().code != ErrorCode::usage) // dropped meanwhile: no damage
            finest_ = level - 1;
        return read.error();
    }
    const SectionEntry *section = reader_.section(SectionType::level_directory, static_cast<std::uint32_t>(level));
    statistics_.bytes_read += section->stored_bytes;
    const std::size_t chunks = (*read)->chunks.size();
    levels_[index_of(level)] = {
        .directory = *read, .slots = std::vector<Slot>(chunks), .states = std::vector<ChunkState>(chunks)};
    known_levels_ = level;
    return {};
}

Result<Sphere> StreamedModel::bounds() try {
    const int level = std::min(kBoundsLevel, reader_.depth());
    while (known_levels_ < level)
        if (Status status = read_directory(known_levels_ + 1); !status)
            return std::move(status).error();
    std::vector<MissingChunk> missing;
    {
        const std::lock_guard lock(mutex_);
        ++view_;
        for (int next = 1; next <= level; ++next)
            for (std::uint32_t i = 0; i < levels_[index_of(next)].slots.size(); ++i) {
                use({next, i});
                missing.push_back({.place = {next, i}});
            }
    }
    if (Status status = load_all(std::move(missing)); !status)
        return std::move(status).error();

    const std::lock_guard lock(mutex_);
    std::vector<Bytes> masks(index_of(level) + 1);
    for (int next = 1; next <= level; ++next)
        for (const ChunkState &chunk : levels_[index_of(next)].states) {
            if (chunk.view == nullptr)
                return Error{ErrorCode::bad_content, 0, "a coarse level is damaged"};
            masks[index_of(next)].insert(masks[index_of(next)].end(), chunk.view->masks.begin(),
                                         chunk.view->masks.end());
        }
    return bounding_sphere(reader_.parameters().grid, std::vector<ByteView>(masks.begin(), masks.end()), level);
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

std::vector<FileRange> StreamedModel::bounds_wanted() const {
    std::vector<FileRange> wanted;
    const std::lock_guard lock(mutex_);
    for (int level = 1; level <= std::min(kBoundsLevel, reader_.depth()); ++level) {
        const std::vector<ChunkState> &states = levels_[index_of(level)].states;
        for (std::uint32_t i = 0; i < states.size(); ++i)
            add_wanted({level, i}, wanted);
        if (level <= known_levels_)
            continue;
        for (const SectionType type :
             {SectionType::level_directory, SectionType::level_bricks, SectionType::level_chunks})
            if (const SectionEntry *entry = reader_.section(type, static_cast<std::uint32_t>(level));
                entry != nullptr && !reader_.source().has({entry->offset, entry->stored_bytes}))
                wanted.push_back({entry->offset, entry->stored_bytes});
    }
    return wanted;
}

DetailSelection StreamedModel::select(const DetailView &view) const {
    std::vector<LevelState> levels(1);
    for (int level = 1; level <= known_levels_; ++level)
        levels.push_back({.directory = levels_[index_of(level)].directory, .chunks = levels_[index_of(level)].states});
    DetailView possible = view;
    possible.finest = std::min(view.finest, finest_);
    return select_detail(reader_.parameters().grid, reader_.header().root.radius, levels, possible);
}

void StreamedModel::use(ChunkPlace place) { level_of(place).slots[place.index].last_view = view_; }

Detail StreamedModel::choose(const DetailView &view) {
    std::unique_lock lock(mutex_);
    DetailSelection selection = select(view);
    const auto needs_directory = [&] { return selection.needs_directory && known_levels_ < finest_; };
    while (needs_directory() && reader_.source().has(reader_.directory_range(known_levels_ + 1))) {
        lock.unlock();
        Status status = read_directory(known_levels_ + 1);
        lock.lock();
        if (!status && status.error().code != ErrorCode::usage)
            errors_.push_back(std::move(status).error());
        selection = select(view);
    }
    ++view_;
    Detail detail{
        .wanted = {}, .runs = std::move(selection.runs), .missing = std::move(selection.missing), .chunks = {}};
    if (!reader_.source().is_whole()) {
        for (const MissingChunk &chunk : detail.missing)
            add_wanted(chunk.place, detail.wanted);
        if (needs_directory())
            detail.wanted.push_back(reader_.directory_range(known_levels_ + 1));
    }
    detail.chunks.reserve(selection.present.size());
    for (const ChunkPlace place : selection.present) {
        use(place);
        detail.chunks.push_back(level_of(place).slots[place.index].chunk);
    }
    return detail;
}

Result<Detail> StreamedModel::load(const DetailView &view) try {
    // Where chunks lie is known exactly when those above them are there: no others are loaded. One level after the
    // other costs next to nothing, since chunks are decoded after the ones they nest in.
    while (true) {
        Detail detail = choose(view);
        {
            const std::lock_guard lock(mutex_);
            std::erase_if(detail.missing, [&](const MissingChunk &chunk) { return !can_be_loaded(chunk.place); });
        }
        const bool complete = detail.missing.empty();
        if (Status status = load_all(std::move(detail.missing)); !status) // a directory may be damaged, too
            return std::move(status).error();
        if (complete)
            return detail;
    }
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Status StreamedModel::load_all(std::vector<MissingChunk> missing) {
    const std::size_t threads = std::min(missing.size(), static_cast<std::size_t>(resolve_threads(options_.threads)));
    {
        const std::lock_guard lock(mutex_);
        queue(std::move(missing));
    }
    {
        std::vector<std::jthread> helpers;
        try {
            for (std::size_t i = 1; i < threads; ++i)
                helpers.emplace_back([this](const std::stop_token &stop) { work(stop, true); });
        } catch (const std::system_error &) { // no more threads to be had: fewer do the same work
        }
        work({}, true);
        for (std::jthread &helper : helpers)
            helper.join();
    }
    const std::lock_guard lock(mutex_);
    const std::vector<Error> errors = std::exchange(errors_, {});
    if (!errors.empty())
        return *std::min_element(errors.begin(), errors.end(),
                                 [](const Error &a, const Error &b) { return a.offset < b.offset; });
    if (full_)
        return Error{ErrorCode::memory, 0,
                     "the picture needs more memory than allowed (" + std::to_string(options_.max_memory >> 20) +
                         " MiB)"};
    return {};
}

void StreamedModel::request(std::vector<MissingChunk> missing) {
    {
        const std::lock_guard lock(mutex_);
        queue(std::move(missing));
    }
    changed_.notify_all();
    const int threads = resolve_threads(options_.threads);
    try {
        while (static_cast<int>(threads_.size()) < threads)
            threads_.emplace_back([this](const std::stop_token &stop) { work(stop, false); });
    } catch (const std::system_error &) {
        if (threads_.empty())
            throw;
    }
}

bool StreamedModel::has_parent(ChunkPlace place) const {
    if (place.level == 1)
        return true;
    const ChunkPlace parent = parent_of(place);
    return level_of(parent).slots[parent.index].chunk != nullptr;
}

bool StreamedModel::has_bytes(ChunkPlace place) const {
    const ByteSource &source = reader_.source();
    return source.is_whole() || (source.has(reader_.chunk_range(place.level, place.index)) &&
                                 source.has(reader_.brick_range(place.level, place.index)));
}

void StreamedModel::add_wanted(ChunkPlace place, std::vector<FileRange> &wanted) const {
    if (is_settled(place))
        return;
    for (const FileRange range :
         {reader_.chunk_range(place.level, place.index), reader_.brick_range(place.level, place.index)})
        if (!reader_.source().has(range))
            wanted.push_back(range);
}

bool StreamedModel::is_loading() const {
    const std::lock_guard lock(mutex_);
    return busy_ > 0 || find_task() < queue_.size();
}

std::vector<Error> StreamedModel::take_errors() {
    const std::lock_guard lock(mutex_);
    return std::exchange(errors_, {});
}

StreamingStatistics StreamedModel::statistics() const {
    const std::lock_guard lock(mutex_);
    StreamingStatistics statistics = statistics_;
    statistics.memory = memory_;
    return statistics;
}

// Loads what is queued: until there is nothing more to do, or for ever.
void StreamedModel::work(const std::stop_token &stop, bool until_done) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
        if (std::optional<Task> task = take_task()) {
            lock.unlock();
            Result<ChunkPointer> loaded = load_chunk(*task);
            lock.lock();
            finish(*task, std::move(loaded));
            if (!until_done && options_.arrived) {
                lock.unlock();
                options_.arrived();
                lock.lock();
            }
        } else if (until_done && busy_ == 0) {
            return;
        } else {
            changed_.wait(lock, stop, [&] { return find_task() < queue_.size() || (until_done && busy_ == 0); });
        }
    }
}

// Offset of the chunk's entry in the file.
std::uint64_t StreamedModel::place_in_directory(ChunkPlace place) const {
    return reader_.section(SectionType::level_directory, static_cast<std::uint32_t>(place.level))->offset +
           place.index * chunk_entry_bytes(reader_.parameters().attributes);
}

Result<StreamedModel::ChunkPointer> StreamedModel::load_chunk(Task &task) const {
    const auto [level, index] = task.place;
    const ChunkEntry &entry = *task.entry;
    try {
        auto chunk = std::make_shared<LoadedChunk>();
        chunk->memory = std::move(task.memory);
        if (reader_.header().storage() == Storage::mapped) {
            Result<ChunkView> view =
                reader_.view_chunk(level, index, task.bytes, level == 1 ? nullptr : &task.parent->view);
            if (!view)
                return std::move(view).error();
            chunk->view = *view;
            chunk->finish(level);
            return ChunkPointer(std::move(chunk));
        }
        if (Status status =
                reader_.load_chunk(level, index, task.bytes, level == 1 ? root_ : task.parent->decoded, chunk->decoded);
            !status)
            return std::move(status).error();
        const BrickParents parents =
            level == 1 ? BrickParents{}
                       : brick_parents(entry, *task.above, task.parent->bricks, task.parent->decoded.masks);
        const auto &[masks, points] = chunk->decoded;
        chunk->bricks.resize(entry.shape.bricks);
        if (!index_bricks(parents, entry.shape, level, masks, points.normals, points.radii, chunk->bricks))
            return wrong_split(place_in_directory(task.place), nullptr, &entry.shape); // no whole bricks below its root
        const AttributeSet &set = reader_.parameters().attributes;
        for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light) {
            chunk->packed_shadows[light] = pack_bits(points.shadows[light], set.shadow_bits[light][index_of(level)]);
            chunk->view.packed_shadows[light] = chunk->packed_shadows[light];
            if (level == reader_.depth()) // nothing below it needs them
                chunk->decoded.points.shadows[light] = {};
        }
        chunk->view.masks = masks;
        chunk->view.normals = points.normals;
        chunk->view.radii = points.radii;
        chunk->view.colours = points.colours;
        chunk->view.materials = points.materials;
        chunk->view.textures = points.textures;
        chunk->view.bricks = chunk->bricks;
        chunk->finish(level);
        return ChunkPointer(std::move(chunk));
    } catch (const std::bad_alloc &) {
        return out_of_memory();
    }
}

bool StreamedModel::is_settled(ChunkPlace place) const {
    const ChunkState &state = level_of(place).states[place.index];
    return state.view != nullptr || state.refused || level_of(place).slots[place.index].busy;
}

// Of the first chunk in the queue that can be loaded now; the queue's size if there is none.
std::size_t StreamedModel::find_task() const {
    if (full_)
        return queue_.size();
    const auto is_next = [&](const MissingChunk &chunk) {
        return !is_settled(chunk.place) && can_be_loaded(chunk.place);
    };
    return static_cast<std::size_t>(
        std::find_if(queue_.begin() + static_cast<std::ptrdiff_t>(queue_start_), queue_.end(), is_next) -
        queue_.begin());
}

void StreamedModel::queue(std::vector<MissingChunk> missing) {
    queue_ = std::move(missing);
    queue_start_ = 0;
    full_ = false;
}

std::optional<StreamedModel::Task> StreamedModel::take_task() try {
    while (queue_start_ < queue_.size() && is_settled(queue_[queue_start_].place))
        ++queue_start_;
    const std::size_t found = find_task();
    if (found == queue_.size())
        return std::nullopt;
    const ChunkPlace place = queue_[found].place;
    Task task{
        .place = place, .entry = &entry_of(place), .above = nullptr, .parent = nullptr, .bytes = {}, .memory = {}};
    Slot *parent = nullptr;
    if (place.level > 1) {
        const ChunkPlace above = parent_of(place);
        parent = &level_of(above).slots[above.index];
        task.above = &entry_of(above);
        task.parent = parent->chunk; // held, so that making room does not take it
    }
    const std::uint64_t memory = memory_of(*task.entry, place.level);
    if (!make_room(memory)) {
        full_ = true;
        return std::nullopt;
    }
    std::optional<ChunkBytes> bytes = reader_.chunk_bytes(place.level, place.index);
    if (!bytes) // dropped by another thread: the next view wants it again
        return std::nullopt;
    task.bytes = std::move(*bytes);
    for (const FileRange range :
         {reader_.chunk_range(place.level, place.index), reader_.brick_range(place.level, place.index)})
        reader_.source().drop(range);
    task.memory = Claim(memory_, memory);
    if (parent != nullptr)
        ++parent->children;
    level_of(place).slots[place.index].busy = true;
    ++busy_;
    return task;
} catch (const std::bad_alloc &) { // before anything was changed
    full_ = true;
    return std::nullopt;
}

void StreamedModel::finish(const Task &task, Result<ChunkPointer> loaded) {
    const auto [level, index] = task.place;
    const bool mapped = reader_.header().storage() == Storage::mapped;
    Slot &slot = level_of(task.place).slots[index];
    ChunkState &state = level_of(task.place).states[index];
    slot.busy = false;
    --busy_;
    statistics_.bytes_read += task.entry->stored_bytes + (mapped ? task.entry->shape.bricks * kBrickRecordBytes : 0);
    if (loaded) {
        slot.chunk = std::move(loaded).value();
        slot.last_view = view_;
        state.view = &slot.chunk->view;
        state.offsets = &slot.chunk->offsets;
        state.bounds = slot.chunk->bounds;
        state.largest_radius = slot.chunk->largest_radius;
        statistics_.points_decoded += mapped ? 0 : task.entry->shape.points;
    } else {
        state.refused = true;
        try {
            errors_.push_back(std::move(loaded).error());
        } catch (const std::bad_alloc &) { // on a thread that nobody catches it from
            full_ = true;
        }
        if (level > 1) {
            const ChunkPlace parent = parent_of(task.place);
            --level_of(parent).slots[parent.index].children;
        }
    }
    changed_.notify_all();
}

// Lets go of the chunks that no view has needed for the longest time, those below others first, until so many bytes are
// left of what is allowed. False if that would take what the last view needs, or pictures still hold.
bool StreamedModel::make_room(std::uint64_t memory) {
    while (memory_ + memory > options_.max_memory) {
        ChunkPlace oldest{.level = 0};
        std::uint64_t last_view = view_;
        for (int level = 1; level <= known_levels_; ++level) {
            const std::vector<Slot> &slots = levels_[index_of(level)].slots;
            for (std::uint32_t i = 0; i < slots.size(); ++i)
                if (slots[i].chunk.use_count() == 1 && slots[i].children == 0 && slots[i].last_view < last_view) {
                    oldest = {level, i};
                    last_view = slots[i].last_view;
                }
        }
        if (oldest.level == 0)
            return false;
        level_of(oldest).slots[oldest.index].chunk.reset();
        level_of(oldest).states[oldest.index] = {};
        if (oldest.level > 1) {
            const ChunkPlace parent = parent_of(oldest);
            --level_of(parent).slots[parent.index].children;
        }
    }
    return true;
}

std::uint64_t StreamedModel::memory_of(const ChunkEntry &entry, int level) const {
    const std::uint64_t offsets = entry.shape.points + entry.shape.bricks;
    if (reader_.header().storage() == Storage::mapped) // what lies in a whole file takes no memory
        return offsets +
               (reader_.source().is_whole() ? 0 : entry.stored_bytes + entry.shape.bricks * kBrickRecordBytes);
    const AttributeSet &set = reader_.parameters().attributes;
    LevelDirectory alone{.level = level, .chunks = {}, .points = entry.shape.points, .nodes = entry.shape.nodes};
    std::uint64_t bytes = offsets + decoded_bytes(alone, set) + entry.shape.bricks * kBrickRecordBytes;
    for (const StreamInfo &stream : streams_of(set))
        if (stream.kind == StreamKind::shadow) {
            bytes += raw_stream_bytes(stream, set, level, entry.shape.nodes, entry.shape.points);
            bytes -= level == reader_.depth() ? entry.shape.points : 0;
        }
    return bytes;
}

} // namespace pbm
