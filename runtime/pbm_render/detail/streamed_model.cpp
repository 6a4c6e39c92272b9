#include "pbm_render/detail/streamed_model.h"

#include "pbm_render/camera/unit_grid.h"
#include "pbm_render/detail/chunk_scheduler.h"
#include "pbm_render/shading/unasked_look.h"

#include <algorithm>
#include <cassert>
#include <mutex>
#include <new>
#include <utility>

namespace pbm {
namespace {

// Bytes of header, table and small sections: what Reader::open has read.
std::uint64_t opening_bytes(const Reader &reader) {
    std::uint64_t bytes = kHeaderBytes + reader.sections().size() * kSectionEntryBytes;
    for (const SectionEntry &section : reader.sections())
        if (section.type < SectionType::level_directory)
            bytes += section.stored_bytes;
    return bytes;
}

} // namespace

struct StreamedModel::Parts {
    Parts(Reader r, StreamingOptions options)
        : reader(std::move(r)), colours(std::move(options.field)), hidden(std::move(options.hidden)),
          loader(reader, colours ? &*colours : nullptr, hidden.get()), cache(options.max_memory),
          finest(reader.depth()), bytes_read(opening_bytes(reader)),
          scheduler(loader, cache, mutex, options.threads, std::move(options.pool), std::move(options.arrived)) {}

    Status read_directory(int level);
    // What the loading of these chunks needs to know of `view`: null if it shows none of them as a whole.
    FramePointer frame_of(const DetailView &view, std::span<const MissingChunk> missing) const;
    // The caller holds the mutex:
    DetailSelection select(const DetailView &view) const;
    // Appends the ranges that the source lacks: of a chunk that is not settled, or of all such chunks of a level.
    void list_wanted(ChunkPlace place, std::vector<FileRange> &wanted) const;
    void list_wanted(int level, std::vector<FileRange> &wanted) const;

    Reader reader;
    const std::optional<FieldColours> colours;
    const std::shared_ptr<const HiddenClasses> hidden;
    ChunkLoader loader;
    std::mutex mutex; // guards cache and errors
    ChunkCache cache;
    int finest;               // levels below it are not read: a directory is damaged
    std::uint64_t bytes_read; // for opening and directories
    DetailView last_view;     // of choose
    ChunkScheduler scheduler; // last member: its threads use the others
};

StreamedModel::StreamedModel(Reader reader, StreamingOptions options)
    : parts_(std::make_unique<Parts>(std::move(reader), std::move(options))) {}

StreamedModel::~StreamedModel() = default;

Status StreamedModel::Parts::read_directory(int level) {
    assert(level == cache.known_levels() + 1); // only this thread changes it
    Result<const LevelDirectory *> read = reader.directory(level);
    if (read)
        if (Status begun = loader.begin_level(**read); !begun)
            read = begun.error();
    const std::lock_guard lock(mutex);
    if (!read) {
        if (read.error().code != ErrorCode::usage) // dropped by another thread: no damage
            finest = level - 1;
        return read.error();
    }
    bytes_read += reader.section(SectionType::level_directory, static_cast<std::uint32_t>(level))->stored_bytes;
    cache.add_level(**read);
    return {};
}

FramePointer StreamedModel::Parts::frame_of(const DetailView &view, std::span<const MissingChunk> missing) const {
    if (std::none_of(missing.begin(), missing.end(), [](const MissingChunk &chunk) { return chunk.is_shown; }))
        return nullptr;
    const Projection projection(in_unit_grid(view.camera, reader.parameters()), view.width, view.height);
    return std::make_shared<const FrameGeometry>(projection, view.width, view.height);
}

DetailSelection StreamedModel::Parts::select(const DetailView &view) const {
    DetailView possible = view;
    possible.finest = std::min(view.finest, finest);
    return select_detail(reader.parameters(), reader.header().root.value({StreamKind::radius}), cache.levels(),
                         possible);
}

void StreamedModel::Parts::list_wanted(ChunkPlace place, std::vector<FileRange> &wanted) const {
    if (!cache.is_settled(place))
        loader.list_wanted(place, wanted);
}

void StreamedModel::Parts::list_wanted(int level, std::vector<FileRange> &wanted) const {
    for (std::uint32_t i = 0; i < cache.levels()[static_cast<std::size_t>(level)].chunks.size(); ++i)
        list_wanted({level, i}, wanted);
}

Result<Extent> StreamedModel::bounds() try {
    const int level = std::min(kBoundsLevel, parts_->reader.depth());
    while (parts_->cache.known_levels() < level)
        if (Status status = parts_->read_directory(parts_->cache.known_levels() + 1); !status)
            return std::move(status).error();
    std::vector<MissingChunk> all;
    for (int next = 1; next <= level; ++next)
        for (std::uint32_t i = 0; i < parts_->cache.levels()[static_cast<std::size_t>(next)].chunks.size(); ++i)
            all.push_back({.place = {next, i}});
    {
        const std::lock_guard lock(parts_->mutex);
        parts_->cache.begin_view();
        for (const MissingChunk &chunk : all)
            parts_->cache.use(chunk.place);
    }
    if (Status status = parts_->scheduler.load_all(all, nullptr); !status)
        return std::move(status).error();

    const std::lock_guard lock(parts_->mutex);
    std::vector<Bytes> masks(static_cast<std::size_t>(level) + 1);
    Bytes radii;
    std::vector<std::uint8_t> hidden;
    for (const MissingChunk &chunk : all) {
        const ResidentPointer &resident = parts_->cache.chunk(chunk.place);
        if (resident == nullptr)
            return Error{ErrorCode::bad_content, 0, "a coarse level is damaged"};
        Bytes &of_level = masks[static_cast<std::size_t>(chunk.place.level)];
        of_level.insert(of_level.end(), resident->view.masks.begin(), resident->view.masks.end());
        if (chunk.place.level != level)
            continue;
        radii.insert(radii.end(), resident->view.radii.begin(), resident->view.radii.end());
        for (const std::uint16_t normal : parts_->hidden ? resident->view.normals : std::span<const std::uint16_t>())
            hidden.push_back(is_hidden(normal));
    }
    const std::vector<ByteView> views(masks.begin(), masks.end());
    Extent extent = find_extent(parts_->reader.parameters().grid, {views, level, radii, hidden});
    extent.from_above = unasked_look(parts_->reader).from_above;
    return extent;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

std::vector<FileRange> StreamedModel::bounds_wanted() const {
    std::vector<FileRange> wanted;
    const std::lock_guard lock(parts_->mutex);
    const Reader &reader = parts_->reader;
    const bool has_field = parts_->loader.reads_fields();
    for (int level = 1; level <= std::min(kBoundsLevel, reader.depth()); ++level) {
        if (level <= parts_->cache.known_levels()) {
            parts_->list_wanted(level, wanted);
            continue;
        }
        for (const SectionType type :
             {SectionType::level_directory, SectionType::level_bricks, SectionType::level_chunks,
              SectionType::field_directory, SectionType::field_values})
            if (const SectionEntry *entry = reader.section(type, static_cast<std::uint32_t>(level));
                entry != nullptr && (has_field || type < SectionType::field_directory) &&
                !reader.source().has(entry->range()))
                wanted.push_back(entry->range());
        for (const PointStream kind : kPointStreams)
            for (const SectionType type : {SectionType::stream_directory, SectionType::stream_values})
                if (const SectionEntry *entry = reader.section(type, instance_of(kind, level));
                    entry != nullptr && !reader.source().has(entry->range()))
                    wanted.push_back(entry->range());
    }
    return wanted;
}

Detail StreamedModel::choose(const DetailView &view) {
    parts_->last_view = view;
    std::unique_lock lock(parts_->mutex);
    DetailSelection selection = parts_->select(view);
    const Reader &reader = parts_->reader;
    const auto next_level = [&] { return parts_->cache.known_levels() + 1; };
    const auto needs_directory = [&] { return selection.needs_directory && next_level() <= parts_->finest; };
    while (needs_directory() && parts_->loader.directories_wanted(next_level()).empty()) {
        lock.unlock();
        Status status = parts_->read_directory(next_level());
        lock.lock();
        if (!status && status.error().code != ErrorCode::usage)
            parts_->scheduler.add_error(std::move(status).error());
        selection = parts_->select(view);
    }
    parts_->cache.begin_view();
    Detail detail{
        .wanted = {}, .runs = std::move(selection.runs), .missing = std::move(selection.missing), .chunks = {}};
    if (!reader.source().is_whole()) {
        for (const MissingChunk &chunk : detail.missing)
            parts_->list_wanted(chunk.place, detail.wanted);
        if (needs_directory())
            for (const FileRange range : parts_->loader.directories_wanted(next_level()))
                detail.wanted.push_back(range);
    }
    detail.chunks.reserve(selection.present.size());
    for (const ChunkPlace place : selection.present) {
        parts_->cache.use(place);
        detail.chunks.push_back(parts_->cache.chunk(place));
    }
    return detail;
}

Result<Detail> StreamedModel::load(const DetailView &view) try {
    // A chunk's bounds are exact once its parent is resident, so the loop loads no chunk in vain. Loading level by
    // level costs little, since a chunk is decoded after its parent anyway.
    FramePointer frame;
    while (true) {
        Detail detail = choose(view);
        {
            const std::lock_guard lock(parts_->mutex);
            std::erase_if(detail.missing, [&](const MissingChunk &chunk) {
                return !parts_->cache.has_parent(chunk.place) || !parts_->loader.has_bytes(chunk.place);
            });
        }
        parts_->loader.will_need(detail.missing);
        const bool complete = detail.missing.empty();
        // The errors include that of a damaged directory.
        if (frame == nullptr)
            frame = parts_->frame_of(view, detail.missing);
        if (Status status = parts_->scheduler.load_all(std::move(detail.missing), frame); !status)
            return std::move(status).error();
        if (complete)
            return detail;
    }
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

void StreamedModel::request(std::vector<MissingChunk> missing) {
    FramePointer frame = parts_->frame_of(parts_->last_view, missing);
    parts_->scheduler.request(std::move(missing), std::move(frame));
}

bool StreamedModel::is_loading() const { return parts_->scheduler.is_loading(); }
const Reader &StreamedModel::reader() const { return parts_->reader; }

std::vector<Error> StreamedModel::take_errors() {
    const std::lock_guard lock(parts_->mutex);
    return parts_->scheduler.take_errors();
}

StreamingStatistics StreamedModel::statistics() const {
    const std::lock_guard lock(parts_->mutex);
    return {.bytes_read = parts_->bytes_read + parts_->scheduler.bytes_read(),
            .points_decoded = parts_->scheduler.points_decoded(),
            .memory = parts_->cache.memory()};
}

} // namespace pbm
