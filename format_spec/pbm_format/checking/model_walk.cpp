#include "pbm_format/checking/model_walk.h"

#include "pbm_format/chunks/field_chunk.h"
#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/container/content_id.h"
#include "system/threads/per_thread.h"

#include <algorithm>

namespace pbm {

namespace {

// Averages are compared where they are stored: in the points of a level, or in front of the chunks.
TreeContext tree_context(const OpenedFile &file, const ModelWalkOptions &options) {
    TreeContext context{.depth = file.header.depth,
                        .chunk_points = file.header.chunk_points,
                        .set = file.parameters.attributes,
                        .fields = file.parameters.fields,
                        .averages = options.averages,
                        .root_wrong = options.root_wrong};
    constexpr std::uint64_t kRootAt = 88;
    for (std::uint32_t level = 0; level < file.header.depth; ++level) {
        context.points_at[level] = level == 0 ? kRootAt : file.section(SectionType::level_chunks, level).offset;
        if (!context.fields.empty())
            context.fields_at[level] =
                file.section(level == 0 ? SectionType::fields : SectionType::field_values, level).offset;
    }
    return context;
}

struct FinestFields {
    std::vector<Bytes> stored;
};

} // namespace

ModelWalk::ModelWalk(const OpenedFile &file, const ModelWalkOptions &options)
    : file_(file), options_(options), context_(tree_context(file, options)), tree_(context_),
      last_level_(context_.depth), refused_(file.directories.size()) {
    fields_whole_ = context_.fields.empty() || file.field_directories.size() == file.directories.size();
    measure();
    place_content();
}

std::uint64_t ModelWalk::min_memory() const {
    return std::max(memory(1, 1), fixed_ + options_.raster_memory) + kMinHashMemory;
}

// Notes what memory depends on.
void ModelWalk::measure() {
    const AttributeSet &set = context_.set;
    std::uint64_t row = 1; // a mask per node, of which there are at most as many as points
    for (const StreamInfo &stream : streams_of(set))
        row += bytes_per_point(stream, set);
    for (const Field &field : context_.fields) {
        row += field.bytes;
        if (field.average == FieldAverage::majority)
            result_bytes_ += (std::uint64_t{field.max_stored()} + 1) * sizeof(std::uint32_t);
    }
    const std::uint64_t entry = sizeof(ChunkEntry) + streams_of(set).size() * sizeof(StreamEntry) +
                                context_.fields.size() * sizeof(FieldEntry) + 3 * sizeof(ChunkShape);
    for (const LevelDirectory &directory : file_.directories) {
        fixed_ += directory.chunks.size() * entry;
        std::uint32_t most = 0;
        for (const ChunkEntry &chunk : directory.chunks)
            most = std::max(most, chunk.shape.points);
        chunk_bytes_.push_back(most * row);
    }
}

std::uint64_t ModelWalk::memory(std::size_t batch, std::size_t threads) const {
    std::uint64_t sum = fixed_;
    for (std::size_t level = 1; level < chunk_bytes_.size(); ++level) {
        const bool finest = level + 1 == chunk_bytes_.size();
        const std::uint64_t chunks = ChunkWalk<ChunkData>::batch_of(file_.directories[level], batch);
        sum += chunks * (sizeof(Walked) + (finest ? result_bytes_ : chunk_bytes_[level]));
    }
    // A thread has a chunk, the planes of its streams, and the averages of the nodes above it.
    return sum + threads * (3 * *std::max_element(chunk_bytes_.begin(), chunk_bytes_.end()) + result_bytes_);
}

// The largest batch that fits. Many chunks a batch keep the threads busy while the last of them are decoded.
WalkLimits ModelWalk::choose_limits(std::uint64_t max_memory) const {
    constexpr std::size_t kChunksPerThread = 8;
    const auto threads = static_cast<std::size_t>(resolve_threads(options_.threads));
    std::size_t batch = kChunksPerThread * threads;
    while (batch > 1 && memory(batch, std::min(batch, threads)) > max_memory)
        batch /= 2;
    return {.last_level = context_.depth, .threads = static_cast<int>(std::min(batch, threads)), .batch = batch};
}

void ModelWalk::place_content() {
    std::vector<std::vector<ChunkShape>> shapes;
    for (const LevelDirectory &directory : file_.directories) {
        shapes.emplace_back();
        for (const ChunkEntry &entry : directory.chunks)
            shapes.back().push_back(entry.shape);
    }
    std::uint64_t at = 0;
    std::size_t stream_number = 0;
    places_.masks.resize(shapes.size());
    visit_content(file_.parameters, shapes, file_.header.chunk_points,
                  {.bytes =
                       [&](ByteView bytes) {
                           places_.others.emplace_back(at, Bytes(bytes.begin(), bytes.end()));
                           at += bytes.size();
                       },
                   .masks =
                       [&](std::size_t level) {
                           places_.masks[level] = at;
                           at += file_.directories[level].nodes;
                       },
                   .stream =
                       [&](const StreamInfo &stream) {
                           places_.streams[stream_number++] = at;
                           at += bytes_per_point(stream, context_.set) * file_.directories.back().points;
                       }});
    places_.rasters = at;
    fields_text_ = context_.fields.empty() ? 0 : context_.fields.size() * kFieldRecordBytes;
    for (const Field &field : context_.fields) {
        field_places_.push_back(fields_text_);
        fields_text_ += field.bytes * file_.directories.back().points;
    }
}

ModelWalk::Walked ModelWalk::root() const {
    Walked root{.loaded = true};
    root.data.chunk.points = root_points(file_.header.root, context_.set);
    for (std::size_t f = 0; f < file_.fields.fields.size(); ++f) {
        Bytes &value = root.data.fields.emplace_back(context_.fields[f].bytes);
        set_stored_value(value, 0, context_.fields[f].bytes, file_.fields.roots[f]);
    }
    return root;
}

void ModelWalk::run() {
    // The sums of the hashes get at most half of the memory that nothing else needs: with fewer sums the chunks are
    // decoded several times, with fewer chunks in flight the threads are idle.
    const std::uint64_t content_text = places_.rasters + options_.raster_text;
    const std::uint64_t of_content = UnorderedHash::memory(content_text),
                        of_fields = UnorderedHash::memory(fields_text_);
    const std::uint64_t spare = options_.max_memory - std::min(options_.max_memory, min_memory());
    const std::uint64_t for_hashes = std::min(of_content + of_fields, kMinHashMemory + spare / 2);
    const auto for_fields = static_cast<std::uint64_t>(
        static_cast<double>(for_hashes) * static_cast<double>(of_fields) / static_cast<double>(of_content + of_fields));
    content_ = std::make_unique<UnorderedHash>(content_text, for_hashes - for_fields);
    fields_ = std::make_unique<UnorderedHash>(fields_text_, for_fields);

    std::vector<const LevelDirectory *> directories;
    for (const LevelDirectory &directory : file_.directories)
        directories.push_back(&directory);
    walk_.emplace(std::move(directories),
                  choose_limits(options_.max_memory - std::min(options_.max_memory, for_hashes)));
    walk();
}

bool ModelWalk::run_again() {
    const bool more = content_->begin_round(), more_fields = fields_->begin_round();
    if (!more && !more_fields)
        return false;
    again_ = true;
    walk();
    return true;
}

void ModelWalk::walk() {
    for (const auto &[at, bytes] : places_.others)
        content_->add(at, bytes);
    if (!context_.fields.empty())
        fields_->add(0, ByteView(encode_fields(file_.fields)).subspan(kFieldsIdBytes));
    walk_->run(
        root(), [this](Walked &chunk) { return load(chunk); },
        [this](std::span<Walked> chunks) { return again_ || take(chunks); });
}

bool ModelWalk::load(Walked &chunk) {
    ChunkData &data = chunk.data;
    data.refusal = nullptr;
    data.fields_error.reset();
    if (chunk.level > last_level_ || (again_ && !hash_needs(chunk)))
        return false;
    Chunk &decoded = is_finest(chunk) ? per_thread<Chunk>() : data.chunk;
    // Collect codes only: formatting an error takes longer than refusing a chunk.
    if (const Status status = decode(*chunk.entry, *chunk.above, chunk.level, Wording::none, decoded); !status) {
        data.refusal = entry_of(status.error());
        is_whole_ = false;
        return false;
    }
    if (!is_whole_ || !options_.whole_rules)
        return true;
    std::vector<Bytes> &fields = is_finest(chunk) ? per_thread<FinestFields>().stored : data.fields;
    load_fields(chunk, decoded, fields);
    if (!fields_whole_)
        return true;
    hash(chunk, decoded, fields);
    if (again_)
        return true;
    if (options_.advice)
        gather_advice(chunk, decoded);
    if (is_finest(chunk))
        data.subtree = measure_subtree(context_, path_to(chunk, decoded, fields));
    return true;
}

Status ModelWalk::decode(const ChunkEntry &entry, const Walked &above, int level, Wording wording, Chunk &to) const {
    const ChunkRules rules{.set = context_.set,
                           .material_count = file_.parameters.materials.size(),
                           .level = level,
                           .finest = level == context_.depth,
                           .wording = wording};
    if (file_.header.storage() == Storage::mapped)
        return load_mapped(entry, rules, to);
    const Chunk &parents = above.data.chunk;
    return decode_chunk(entry, file_.stored(chunk_range(entry)), rules,
                        chunk_nodes(entry, parents.masks, above.entry == nullptr ? 0 : above.entry->first_node,
                                    parents.points, above.entry == nullptr ? 0 : above.entry->first_point,
                                    context_.set),
                        to);
}

// Verifies a chunk of a mapped file in place and copies it; its parent must not be refused.
Status ModelWalk::load_mapped(const ChunkEntry &entry, const ChunkRules &rules, Chunk &to) const {
    BrickParents parents;
    if (rules.level > 1) {
        const ChunkEntry &above =
            file_.directories[static_cast<std::size_t>(rules.level) - 1].chunks[entry.shape.parent_chunk];
        const ChunkView view = view_chunk(above, stored_chunk(above, rules.level - 1), rules.set, rules.level - 1);
        parents = brick_parents(entry, above, view.bricks, view.masks);
    }
    const ChunkBytes bytes = stored_chunk(entry, rules.level);
    const SectionEntry &bricks = file_.section(SectionType::level_bricks, static_cast<std::uint32_t>(rules.level));
    if (Status status = verify_chunk(entry, bytes, bricks, rules, parents); !status)
        return status;
    copy_chunk(view_chunk(entry, bytes, rules.set, rules.level), rules.set, rules.level, to);
    return {};
}

ChunkBytes ModelWalk::stored_chunk(const ChunkEntry &entry, int level) const {
    const SectionEntry &bricks = file_.section(SectionType::level_bricks, static_cast<std::uint32_t>(level));
    return {.streams = {file_.stored(chunk_range(entry)), nullptr},
            .bricks = {file_.stored(brick_range(entry, bricks)), nullptr}};
}

// Chunks above the finest level are always needed: the finest are decoded with them.
bool ModelWalk::hash_needs(const Walked &chunk) const {
    if (!is_finest(chunk))
        return true;
    const ChunkEntry &entry = *chunk.entry;
    bool needs = content_->needs(places_.masks.back() + entry.first_node, entry.shape.nodes);
    for (std::size_t s = 0; s < point_streams().size(); ++s) {
        const std::uint64_t width = bytes_per_point(point_streams()[s], context_.set);
        needs |=
            width > 0 && content_->needs(places_.streams[s] + width * entry.first_point, width * entry.shape.points);
    }
    for (std::size_t f = 0; f < context_.fields.size(); ++f) {
        const std::uint64_t bytes = context_.fields[f].bytes;
        needs |= fields_->needs(field_places_[f] + bytes * entry.first_point, bytes * entry.shape.points);
    }
    return needs;
}

void ModelWalk::hash(const Walked &chunk, const Chunk &decoded, const std::vector<Bytes> &fields) {
    const ChunkEntry &entry = *chunk.entry;
    content_->add(places_.masks[static_cast<std::size_t>(chunk.level)] + entry.first_node, decoded.masks);
    if (!is_finest(chunk))
        return;
    const PointView points = view_points(decoded.points, 0, decoded.points.size(), context_.set);
    for (std::size_t s = 0; s < point_streams().size(); ++s) {
        const StreamInfo &stream = point_streams()[s];
        content_->add(places_.streams[s] + bytes_per_point(stream, context_.set) * entry.first_point,
                      bytes_of(points, stream));
    }
    for (std::size_t f = 0; f < fields.size(); ++f)
        fields_->add(field_places_[f] + context_.fields[f].bytes * entry.first_point, fields[f]);
}

// Decodes the fields of a chunk, unless those of its parent or their directory were refused.
void ModelWalk::load_fields(Walked &chunk, const Chunk &decoded, std::vector<Bytes> &to) {
    const auto level = static_cast<std::size_t>(chunk.level);
    const std::vector<Bytes> &parents = chunk.above->data.fields;
    to.clear();
    if (context_.fields.empty() || level >= file_.field_directories.size() || parents.empty())
        return;
    const ChunkEntry &entry = *chunk.entry;
    const std::uint64_t first =
        entry.first_node - (chunk.above->entry == nullptr ? 0 : chunk.above->entry->first_point);
    to.resize(context_.fields.size());
    for (std::size_t f = 0; f < to.size(); ++f) {
        const Field &field = context_.fields[f];
        const FieldEntry &at = file_.field_directories[level].at(chunk.index, f);
        if (Status status =
                decode_field(at, field, file_.stored({at.offset, at.stream.stored_bytes}), decoded.masks,
                             slice(parents[f], field.bytes * first, field.bytes * entry.shape.nodes), to[f]);
            !status) {
            chunk.data.fields_error = std::move(status).error();
            fields_whole_ = false;
            return to.clear();
        }
    }
}

void ModelWalk::gather_advice(Walked &chunk, const Chunk &decoded) const {
    chunk.data.narrowest = bound_normals(decoded.points.normals);
    chunk.data.used = is_finest(chunk) ? used_parameters(decoded.points) : UsedParameters{};
    if (chunk.level == 1)
        chunk.data.used.octants = decoded.masks[0];
}

ChunkPath ModelWalk::path_to(const Walked &chunk, const Chunk &decoded, std::span<const Bytes> fields) const {
    ChunkPath path;
    const auto step = [&](const Walked &walked, const Chunk &streams, std::span<const Bytes> values) {
        path.steps[static_cast<std::size_t>(walked.level)] = {
            walked.entry, streams.masks, view_points(streams.points, 0, streams.points.size(), context_.set), values};
    };
    step(chunk, decoded, fields);
    for (const Walked *above = chunk.above; above != nullptr; above = above->above)
        step(*above, above->data.chunk, above->data.fields);
    return path;
}

// Such a chunk has no normal cone (19.4.3).
bool ModelWalk::has_sides(const Walked &chunk) const {
    const std::vector<PointStreamEntry> &sides =
        file_.streams(PointStream::sides)[static_cast<std::size_t>(chunk.level)];
    return !sides.empty() && sides[chunk.index].raw_bytes > 0;
}

bool ModelWalk::take(std::span<Walked> chunks) {
    const int level = chunks.front().level;
    std::vector<Refusal> &refused = refused_[static_cast<std::size_t>(level)];
    for (Walked &chunk : chunks) {
        ChunkData &data = chunk.data;
        if (chunk.above->loaded && data.refusal != nullptr)
            refused.push_back({chunk.index, data.refusal});
        if (!chunk.loaded)
            continue;
        ++chunks_;
        points_ += is_finest(chunk) ? chunk.entry->shape.points : 0;
        if (data.fields_error && level <= refused_fields_level_) {
            if (level < refused_fields_level_)
                refused_fields_.clear();
            refused_fields_level_ = level;
            refused_fields_.push_back({chunk.index, std::move(*data.fields_error)});
        }
        if (!is_whole_ || !fields_whole_)
            continue;
        if (options_.advice) {
            used_.add(data.used);
            if (data.narrowest.cosine > chunk.entry->cone.cosine && !has_sides(chunk))
                loose_cones_.push_back({level, chunk.index, chunk.entry->cone.cosine, data.narrowest.cosine});
        }
        if (is_finest(chunk))
            tree_.add(path_to(chunk, data.chunk, {}), std::move(data.subtree));
    }
    // The first refused chunk is one of a coarser level, or the first of this batch.
    if (options_.stops_at_fault && !refused.empty())
        last_level_ = std::min(last_level_, level - 1);
    return last_level_ > 0;
}

Status ModelWalk::explain(int level, std::size_t chunk) {
    if (explained_.empty()) {
        explained_.resize(file_.directories.size());
        explained_[0] = root();
    }
    std::array<std::size_t, kMaxDepth + 1> path{};
    for (int above = level; above >= 1; --above) {
        path[static_cast<std::size_t>(above)] = chunk;
        chunk = file_.directories[static_cast<std::size_t>(above)].chunks[chunk].shape.parent_chunk;
    }
    for (std::size_t at = 1; at <= static_cast<std::size_t>(level); ++at) {
        const ChunkEntry &entry = file_.directories[at].chunks[path[at]];
        Walked &here = explained_[at];
        const bool is_last = at == static_cast<std::size_t>(level);
        if (!is_last && here.loaded && here.index == path[at])
            continue;
        here.loaded = false;
        Status status = decode(entry, explained_[at - 1], static_cast<int>(at), Wording::full, here.data.chunk);
        if (is_last || !status)
            return is_last ? status : Status();
        here.entry = &entry;
        here.index = path[at];
        here.loaded = true;
    }
    return {};
}

} // namespace pbm
