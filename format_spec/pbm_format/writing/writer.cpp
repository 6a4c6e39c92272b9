#include "pbm_format/writing/writer.h"
#include "pbm_format/levels/chunk_split.h"

#include "pbm_format/checking/validate.h"
#include "pbm_format/chunks/brick_index.h"
#include "pbm_format/container/content_id.h"
#include "pbm_format/container/file_rules.h"
#include "pbm_format/container/section_encoder.h"
#include "pbm_format/rasters/image_section.h"
#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/chunk_encoder.h"
#include "pbm_format/writing/file_layout.h"
#include "pbm_format/writing/raster_encoder.h"
#include "system/files/file_replacement.h"
#include "system/free_memory.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

namespace pbm {

namespace {

// Checks whether a file can hold the rasters: 3.10.4 and 3.10.15.
Status check_shapes(const ModelImages &images) {
    const auto whole = [](const Image &image) {
        return is_storable(image.width, image.height, image.channels) &&
               image.texels.size() == std::size_t{image.width} * image.height * image.channels;
    };
    const Image &panorama = images.panorama;
    if (!panorama.empty() && (!whole(panorama) || panorama.channels != 3 || panorama.width != 2 * panorama.height))
        return Error{ErrorCode::bad_image, 0,
                     "3.10.15 the panorama's sides are not powers of two, 2:1, with 3 channels"};
    const auto fits_ground = [&](const Image &image) {
        return whole(image) && image.channels == 1 && image.width == image.height && image.width <= kMaxGroundRaster;
    };
    if ((!images.ground_texture.empty() && !fits_ground(images.ground_texture)) ||
        !std::all_of(images.ground_lit.begin(), images.ground_lit.end(), fits_ground))
        return Error{ErrorCode::bad_image, 0,
                     "3.10.15 a raster of the ground plane is not square, a power of two up to 4,096, with 1 channel"};
    return {};
}

void add_raster(FileLayout &layout, SectionType type, std::uint32_t instance, const Image &image,
                const WriteOptions &options) {
    if (image.empty())
        return;
    const TileGrid grid(image.width, image.height, image.channels);
    Bytes stored = encode_image(image, options.storage, options.compression_level, options.threads);
    const bool mapped = options.storage == Storage::mapped;
    const std::uint64_t raw_bytes = mapped ? stored.size() : image_directory_bytes(grid) + grid.texel_bytes();
    SectionEntry entry{
        .type = type, .instance = instance, .element_bytes = 0, .raw_bytes = raw_bytes, .count = grid.tiles()};
    entry.codec = mapped ? Codec::raw : Codec::zstd_chunks;
    entry.alignment = mapped ? kMappedStreamAlignment : kSectionAlignment;
    layout.add(entry, std::move(stored));
}

void add_rasters(FileLayout &layout, const ModelImages &images, const WriteOptions &options) {
    add_raster(layout, SectionType::ground_texture, 0, images.ground_texture, options);
    for (std::size_t light = 0; light < images.ground_lit.size(); ++light)
        add_raster(layout, SectionType::ground_lit, static_cast<std::uint32_t>(light), images.ground_lit[light],
                   options);
    add_raster(layout, SectionType::panorama, 0, images.panorama, options);
}

Status check_fields(const Model &model) {
    const std::vector<Field> &fields = model.parameters.fields;
    if (fields.empty())
        return {};
    for (const Level &level : model.levels)
        for (std::size_t f = 0; f < fields.size(); ++f)
            if (f >= level.fields.size() || level.fields[f].size() != level.points.size() * fields[f].bytes)
                return usage_error("the model's levels lack values of its fields");
    const Result<FieldTable> decoded = decode_fields(encode_fields(field_table(model)));
    return decoded ? Status() : decoded.error();
}

// Checks parameters, fields and rasters, so that what a reader would refuse is refused before any work.
Status check_encodable(const Model &model) {
    Status status = check_small_sections(model.parameters, model.metadata);
    if (status)
        status = check_fields(model);
    if (status)
        status = check_rasters(model.parameters, !model.images.ground_texture.empty(), model.images.ground_lit.size());
    return status ? check_shapes(model.images) : status;
}

struct EncodedChunk {
    ChunkEntry entry;
    Bytes stored;
    std::vector<BrickRecord> bricks; // only for mapped files
    std::vector<FieldEntry> fields;
    Bytes stored_fields;
    std::array<PointStreamEntry, kPointStreams.size()> streams; // of each kind
    std::array<Bytes, kPointStreams.size()> stored_streams;
    std::uint32_t points = 0;
};

// Computes the bricks of the chunks of `level` from those of the level above.
void index_level(const Model &model, std::size_t level, std::span<const EncodedChunk> above, int threads,
                 std::span<EncodedChunk> chunks) {
    const Level &here = model.levels[level];
    parallel_for(chunks.size(), threads, [&](std::size_t i) {
        const ChunkEntry &entry = chunks[i].entry;
        BrickParents parents;
        if (level > 1) {
            const EncodedChunk &parent = above[entry.shape.parent_chunk];
            const ByteView masks = model.levels[level - 1].masks;
            parents = brick_parents(entry, parent.entry, parent.bricks,
                                    masks.subspan(parent.entry.first_node, parent.entry.shape.nodes));
        }
        chunks[i].bricks.resize(entry.shape.bricks);
        const bool whole =
            index_bricks(parents, entry.shape, static_cast<int>(level),
                         ByteView(here.masks).subspan(entry.first_node, entry.shape.nodes),
                         std::span(here.points.normals).subspan(entry.first_point, entry.shape.points),
                         ByteView(here.points.radii).subspan(entry.first_point, entry.shape.points), chunks[i].bricks);
        assert(whole); // split_into_chunks cuts between bricks
        static_cast<void>(whole);
    });
}

// Adds the sections of a level; moves the contents out of `chunks`.
void add_level(FileLayout &layout, const AttributeSet &set, int level, Storage storage,
               std::span<EncodedChunk> chunks) {
    LevelDirectory directory{.level = level, .chunks = {}};
    Bytes stored, bricks;
    std::uint64_t raw_bytes = 0, points = 0;
    stored.reserve(std::transform_reduce(chunks.begin(), chunks.end(), std::size_t{0}, std::plus<>(),
                                         [](const EncodedChunk &chunk) { return chunk.stored.size(); }));
    for (EncodedChunk &chunk : chunks) {
        stored.insert(stored.end(), chunk.stored.begin(), chunk.stored.end());
        free_memory(chunk.stored);
        const auto *records = reinterpret_cast<const std::uint8_t *>(chunk.bricks.data());
        bricks.insert(bricks.end(), records, records + kBrickRecordBytes * chunk.bricks.size());
        const ChunkShape &shape = chunk.entry.shape;
        points += shape.points;
        for (const StreamInfo &stream : streams_of(set))
            raw_bytes += raw_stream_bytes(stream, set, level, shape.nodes, shape.points);
        directory.chunks.push_back(std::move(chunk.entry));
    }
    const auto instance = static_cast<std::uint32_t>(level);
    layout.add(record_section(SectionType::level_directory, instance,
                              static_cast<std::uint32_t>(chunk_entry_bytes(set)), encode_directory(directory, set)));
    SectionEntry entry{.type = SectionType::level_chunks, .instance = instance, .element_bytes = 0, .count = points};
    if (storage == Storage::packed) {
        entry.codec = Codec::zstd_chunks;
        entry.raw_bytes = raw_bytes;
    } else {
        layout.add(record_section(SectionType::level_bricks, instance, kBrickRecordBytes, std::move(bricks),
                                  kMappedStreamAlignment));
        entry.alignment = kMappedChunksAlignment;
        entry.raw_bytes = stored.size();
    }
    layout.add(entry, std::move(stored));
}

// Adds the directory of the fields of a level, or their values. Moves the values out of `chunks`.
void add_field_directory(FileLayout &layout, std::size_t fields, std::uint32_t level,
                         std::span<const EncodedChunk> chunks) {
    FieldDirectory directory{.entries = {}, .fields = fields};
    for (const EncodedChunk &chunk : chunks)
        directory.entries.insert(directory.entries.end(), chunk.fields.begin(), chunk.fields.end());
    layout.add(record_section(SectionType::field_directory, level,
                              static_cast<std::uint32_t>(kFieldEntryBytes * fields),
                              encode_field_directory(directory)));
}
void add_field_values(FileLayout &layout, std::span<const Field> fields, std::uint32_t level, Storage storage,
                      std::span<EncodedChunk> chunks) {
    SectionEntry entry{.type = SectionType::field_values, .instance = level, .element_bytes = 0};
    entry.codec = storage == Storage::packed ? Codec::zstd_chunks : Codec::raw;
    Bytes stored;
    for (EncodedChunk &chunk : chunks) {
        stored.insert(stored.end(), chunk.stored_fields.begin(), chunk.stored_fields.end());
        free_memory(chunk.stored_fields);
        entry.count += chunk.points;
        for (const Field &field : fields)
            entry.raw_bytes += std::uint64_t{chunk.points} * field.bytes;
    }
    layout.add(entry, std::move(stored));
}

// Adds the directory of a kind of point stream for a level, if it says something of its points, or its values.
// `number`: of the kind in kPointStreams. Moves the values out of `chunks`.
bool has_stream(std::size_t number, std::span<const EncodedChunk> chunks) {
    return std::any_of(chunks.begin(), chunks.end(),
                       [&](const EncodedChunk &chunk) { return chunk.streams[number].raw_bytes > 0; });
}
void add_stream_directory(FileLayout &layout, std::size_t number, int level, std::span<const EncodedChunk> chunks) {
    if (!has_stream(number, chunks))
        return;
    std::vector<PointStreamEntry> entries;
    for (const EncodedChunk &chunk : chunks)
        entries.push_back(chunk.streams[number]);
    layout.add(record_section(SectionType::stream_directory, instance_of(kPointStreams[number], level),
                              kPointStreamEntryBytes, encode_stream_directory(entries)));
}
void add_stream_values(FileLayout &layout, std::size_t number, int level, Storage storage,
                       std::span<EncodedChunk> chunks) {
    if (!has_stream(number, chunks))
        return;
    SectionEntry entry{
        .type = SectionType::stream_values, .instance = instance_of(kPointStreams[number], level), .element_bytes = 0};
    entry.codec = storage == Storage::packed ? Codec::zstd_chunks : Codec::raw;
    Bytes stored;
    for (EncodedChunk &chunk : chunks) {
        stored.insert(stored.end(), chunk.stored_streams[number].begin(), chunk.stored_streams[number].end());
        free_memory(chunk.stored_streams[number]);
        entry.count += chunk.points;
        entry.raw_bytes += chunk.streams[number].raw_bytes;
    }
    layout.add(entry, std::move(stored));
}

} // namespace

Result<Bytes> encode_model(const Model &model, const WriteOptions &options) try {
    const ModelParameters &parameters = model.parameters;
    const AttributeSet &set = parameters.attributes;
    const int depth = parameters.grid.depth;
    assert(options.chunk_points >= kMinChunkPoints && options.chunk_points <= kDefaultChunkPoints &&
           std::has_single_bit(options.chunk_points));
    assert(depth >= kMinDepth && depth <= kMaxDepth && model.levels.size() == static_cast<std::size_t>(depth) + 1);
    if (model.point_count() == 0 || model.point_count() > kMaxPoints)
        return Error{ErrorCode::too_large, 0,
                     "2.10 the model has " + std::to_string(model.point_count()) +
                         " points; 1 to 2^32-1 can be stored: choose a smaller depth"};

    if (Status status = check_encodable(model); !status)
        return std::move(status).error();

    LevelMasks masks;
    for (const Level &level : model.levels)
        masks.push_back(level.masks);
    const std::vector<std::vector<ChunkShape>> shapes = split_into_chunks(masks, options.chunk_points);
    masks.clear();

    struct Job {
        std::size_t level, chunk;
    };
    std::vector<Job> jobs;
    std::vector<std::vector<EncodedChunk>> encoded(shapes.size());
    for (std::size_t level = 1; level < shapes.size(); ++level) {
        for (ChunkEntry &entry : place_chunks(shapes[level])) {
            jobs.push_back({level, encoded[level].size()});
            EncodedChunk &chunk = encoded[level].emplace_back();
            chunk.points = entry.shape.points;
            chunk.entry = std::move(entry);
        }
    }
    const bool mapped = options.storage == Storage::mapped;
    const ChunkCoding coding{
        .storage = options.storage, .compression_level = options.compression_level, .filters = options.filters};
    std::atomic<std::size_t> done{0};
    parallel_for(jobs.size(), options.threads, [&](std::size_t i) {
        const Job &job = jobs[i];
        EncodedChunk &to = encoded[job.level][job.chunk];
        encode_chunk(model, static_cast<int>(job.level), coding, to.entry, to.stored);
        for (std::size_t kind = 0; kind < kPointStreams.size(); ++kind)
            to.streams[kind] = encode_point_stream(model, static_cast<int>(job.level), kPointStreams[kind], coding,
                                                   to.entry, to.stored_streams[kind]);
        for (std::size_t f = 0; f < parameters.fields.size(); ++f)
            to.fields.push_back(
                encode_field(model, static_cast<int>(job.level), f, to.entry, coding, to.stored_fields));
        const std::size_t finished = ++done;
        if (options.progress)
            options.progress(static_cast<double>(finished) / static_cast<double>(jobs.size()));
    });

    for (std::size_t level = 1; level < encoded.size() && mapped; ++level)
        index_level(model, level, encoded[level - 1], options.threads, encoded[level]);

    FileLayout layout;
    for (EncodedSection &section : encode_small_sections(parameters, model.metadata))
        layout.add(std::move(section));
    const std::vector<Field> &fields = parameters.fields;
    if (!fields.empty()) {
        Bytes table = encode_fields(field_table(model));
        const auto bytes = static_cast<std::uint32_t>(table.size());
        layout.add(record_section(SectionType::fields, 0, bytes, std::move(table)));
    }
    const auto has_record = [](const Material &material) { return is_round(material) || material.tint > 0; };
    if (std::any_of(parameters.materials.begin(), parameters.materials.end(), has_record))
        layout.add(record_section(SectionType::shapes, 0, kShapeBytes, encode_shapes(parameters.materials)));
    for (std::size_t level = 1; level < encoded.size(); ++level)
        add_level(layout, set, static_cast<int>(level), options.storage, encoded[level]);
    add_rasters(layout, model.images, options);
    for (std::size_t level = 1; level < encoded.size() && !fields.empty(); ++level)
        add_field_directory(layout, fields.size(), static_cast<std::uint32_t>(level), encoded[level]);
    for (std::size_t level = 1; level < encoded.size() && !fields.empty(); ++level)
        add_field_values(layout, fields, static_cast<std::uint32_t>(level), options.storage, encoded[level]);
    for (std::size_t kind = 0; kind < kPointStreams.size(); ++kind)
        for (std::size_t level = 1; level < encoded.size(); ++level)
            add_stream_directory(layout, kind, static_cast<int>(level), encoded[level]);
    for (std::size_t kind = 0; kind < kPointStreams.size(); ++kind)
        for (std::size_t level = 1; level < encoded.size(); ++level)
            add_stream_values(layout, kind, static_cast<int>(level), options.storage, encoded[level]);
    FileHeader header;
    header.required_features = mapped ? kMappedFeature : 0;
    header.optional_features = model.parameters.closed ? kClosedFeature : 0;
    header.depth = static_cast<std::uint8_t>(depth);
    header.point_count = model.point_count();
    header.content_id = content_id(model, shapes, options.chunk_points);
    header.root = root_record(model.levels[0].points, set);
    header.chunk_points = options.chunk_points;
    return layout.assemble(header);
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Result<std::uint64_t> write_model(const std::string &path, const Model &model, const WriteOptions &options) {
    Result<Bytes> file = encode_model(model, options);
    if (!file)
        return std::move(file).error();
    if (const Status valid = verify(*file, {.threads = options.threads, .max_memory = ~std::uint64_t{0}}); !valid)
        return Error{valid.error().code == ErrorCode::memory ? ErrorCode::memory : ErrorCode::bad_content,
                     valid.error().offset,
                     "what was written does not verify (nothing was replaced): " + valid.error().message};
    if (options.progress)
        options.progress(std::nextafter(1.0, 0.0)); // the last moment for an exception that cancels
    if (Status status = replace_file(path, *file); !status)
        return std::move(status).error();
    return file->size();
}

} // namespace pbm
