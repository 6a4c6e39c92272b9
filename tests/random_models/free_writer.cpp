#include "random_models/free_writer.h"

#include "pbm_format/container/content_id.h"
#include "pbm_format/levels/chunk_split.h"
#include "random_models/free_streams.h"

#include "pbm_format/chunks/brick_index.h"
#include "pbm_format/chunks/chunk.h"
#include "pbm_format/chunks/point_stream_chunk.h"
#include "pbm_format/container/field_sections.h"
#include "pbm_format/container/section_encoder.h"
#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/chunk_encoder.h"
#include "pbm_format/writing/raster_encoder.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace pbm::test {

namespace {

struct Section {
    SectionEntry entry;
    Bytes stored;
};

class FreeWriter {
  public:
    FreeWriter(const Model &model, Random &random)
        : model_(model), set_(model.parameters.attributes), random_(random), mapped_(random.below(3) == 0),
          chunk_points_(random.below(2) == 0 ? kMinChunkPoints : kMinChunkPoints << random.below(8)) {}

    Bytes write() {
        add_small_sections();
        add_levels();
        add_fields();
        add_shapes();
        for (std::size_t level = 1; level < shapes_.size(); ++level)
            for (const PointStream kind : kPointStreams)
                add_stream_of_level(kind, level);
        add_rasters();
        add_unknown_sections();
        return assemble();
    }

  private:
    void add(const SectionEntry &entry, Bytes stored) {
        SectionEntry placed = entry;
        placed.flags = random_.below(4) == 0 ? 0 : kCriticalFlag;
        placed.stored_bytes = stored.size();
        sections_.push_back({placed, std::move(stored)});
    }

    std::uint32_t random_alignment() {
        const std::uint64_t bits = random_.below(8) == 0 ? 14 : 4; // 65,536 makes large files, so it is rare
        return static_cast<std::uint32_t>(kSectionAlignment) << random_.below(bits);
    }

    // The element size is a random divisor of the size.
    void add_raw(SectionType type, Bytes bytes) {
        const auto size = static_cast<std::uint32_t>(bytes.size());
        std::uint32_t element = size;
        if (random_.below(2) == 0)
            do
                element = 1 + static_cast<std::uint32_t>(random_.below(size));
            while (size % element != 0);
        add({.type = type,
             .codec = Codec::raw,
             .element_bytes = element,
             .alignment = random_alignment(),
             .raw_bytes = size,
             .count = size / element},
            std::move(bytes));
    }

    void add_small_sections() {
        const ModelParameters &parameters = model_.parameters;
        const int depth = parameters.grid.depth;
        add_raw(SectionType::metadata, {model_.metadata.begin(), model_.metadata.end()});
        add_raw(SectionType::grid, encode_grid(parameters.grid));
        add_raw(SectionType::attributes, encode_attributes(set_, depth));
        add_raw(SectionType::materials, encode_materials(parameters.materials));
        if (!parameters.lights.empty())
            add_raw(SectionType::lights, encode_lights(parameters.lights));
        if (!parameters.texture.empty())
            add_raw(SectionType::texture, encode_texture(parameters.texture.front()));
        if (parameters.ground)
            add_raw(SectionType::ground_plane, encode_ground_plane(*parameters.ground));
    }

    void add_levels() {
        LevelMasks masks;
        for (const Level &level : model_.levels)
            masks.push_back(level.masks);
        shapes_ = split_into_chunks(masks, chunk_points_);
        for (std::size_t level = 1; level < shapes_.size(); ++level)
            add_level(level);
    }

    void add_level(std::size_t level) {
        LevelDirectory directory{.level = static_cast<int>(level), .chunks = {}};
        Bytes chunks, bricks;
        std::vector<std::vector<BrickRecord>> records;
        std::uint64_t raw_bytes = 0, points = 0;
        ChunkEntry next;
        for (const ChunkShape &shape : shapes_[level]) {
            ChunkEntry entry = next;
            entry.shape = shape;
            next.first_parent += shape.parents;
            next.first_node += shape.nodes;
            next.first_point += shape.points;
            raw_bytes += mapped_ ? add_mapped_chunk(level, entry, chunks) : add_packed_chunk(level, entry, chunks);
            points += shape.points;
            if (mapped_) {
                records.push_back(index_chunk(level, entry));
                const auto *first = reinterpret_cast<const std::uint8_t *>(records.back().data());
                bricks.insert(bricks.end(), first, first + kBrickRecordBytes * records.back().size());
            }
            directory.chunks.push_back(std::move(entry));
        }
        const auto instance = static_cast<std::uint32_t>(level);
        const Bytes entries = encode_directory(directory, set_);
        add({.type = SectionType::level_directory,
             .codec = Codec::raw,
             .instance = instance,
             .element_bytes = static_cast<std::uint32_t>(chunk_entry_bytes(set_)),
             .alignment = random_alignment(),
             .raw_bytes = entries.size(),
             .count = directory.chunks.size()},
            entries);
        if (mapped_)
            add({.type = SectionType::level_bricks,
                 .codec = Codec::raw,
                 .instance = instance,
                 .element_bytes = kBrickRecordBytes,
                 .alignment = kMappedStreamAlignment,
                 .raw_bytes = bricks.size(),
                 .count = bricks.size() / kBrickRecordBytes},
                bricks);
        add({.type = SectionType::level_chunks,
             .codec = mapped_ ? Codec::raw : Codec::zstd_chunks,
             .instance = instance,
             .element_bytes = 0,
             .alignment = mapped_ ? kMappedChunksAlignment : random_alignment(),
             .raw_bytes = raw_bytes,
             .count = points},
            std::move(chunks));
        directory_above_ = std::move(directory);
        bricks_above_ = std::move(records);
    }

    const Level &level_at(std::size_t level) const { return model_.levels[level]; }

    // Returns the chunk's raw bytes.
    std::uint64_t add_packed_chunk(std::size_t level, ChunkEntry &entry, Bytes &out) {
        const ChunkNodes nodes = chunk_nodes(entry, level_at(level - 1).masks, 0, level_at(level - 1).points, 0, set_);
        const ByteView masks = ByteView(level_at(level).masks).subspan(entry.first_node, entry.shape.nodes);
        const PointView points = view_points(level_at(level).points, entry.first_point, entry.shape.points, set_);
        const bool finest = level + 1 == model_.levels.size();
        const std::size_t start = out.size();
        std::uint64_t raw_bytes = 0;
        entry.cone = has_sides(level, entry) ? NormalCone() : random_cone(points.normals, random_);
        for (const StreamInfo &stream : streams_of(set_)) {
            const StreamContext context{
                .set = set_, .stream = stream, .level = static_cast<int>(level), .finest = finest};
            entry.streams.push_back(append_freely(context, masks, points, nodes, random_, out));
            raw_bytes += raw_stream_bytes(stream, set_, context.level, entry.shape.nodes, entry.shape.points);
        }
        entry.hash = hash64(ByteView(out).subspan(start));
        return raw_bytes;
    }

    // Only the cone of a mapped chunk is free to choose.
    std::uint64_t add_mapped_chunk(std::size_t level, ChunkEntry &entry, Bytes &out) {
        encode_chunk(model_, static_cast<int>(level), {.storage = Storage::mapped}, entry, out);
        const std::span normals(level_at(level).points.normals);
        entry.cone = has_sides(level, entry)
                         ? NormalCone()
                         : random_cone(normals.subspan(entry.first_point, entry.shape.points), random_);
        return entry.stored_bytes;
    }

    std::vector<BrickRecord> index_chunk(std::size_t level, const ChunkEntry &entry) const {
        BrickParents parents;
        if (level > 1) {
            const ChunkEntry &above = directory_above_.chunks[entry.shape.parent_chunk];
            parents = brick_parents(entry, above, bricks_above_[entry.shape.parent_chunk],
                                    ByteView(level_at(level - 1).masks).subspan(above.first_node, above.shape.nodes));
        }
        std::vector<BrickRecord> records(entry.shape.bricks);
        const PointAttributes &points = level_at(level).points;
        if (!index_bricks(parents, entry.shape, static_cast<int>(level),
                          ByteView(level_at(level).masks).subspan(entry.first_node, entry.shape.nodes),
                          std::span(points.normals).subspan(entry.first_point, entry.shape.points),
                          ByteView(points.radii).subspan(entry.first_point, entry.shape.points), records))
            std::abort();
        return records;
    }

    void add_raster(SectionType type, std::size_t instance, const Image &image) {
        if (image.empty())
            return;
        const TileGrid grid(image.width, image.height, image.channels);
        Bytes stored = mapped_ ? encode_image(image, Storage::mapped, 1, 1) : encode_image_freely(image, random_);
        const std::uint64_t stored_bytes = stored.size();
        add({.type = type,
             .codec = mapped_ ? Codec::raw : Codec::zstd_chunks,
             .instance = static_cast<std::uint32_t>(instance),
             .element_bytes = 0,
             .alignment = mapped_ ? kMappedStreamAlignment : random_alignment(),
             .raw_bytes = mapped_ ? stored_bytes : image_directory_bytes(grid) + grid.texel_bytes(),
             .count = grid.tiles()},
            std::move(stored));
    }

    void add_rasters() {
        add_raster(SectionType::ground_texture, 0, model_.images.ground_texture);
        for (std::size_t light = 0; light < model_.images.ground_lit.size(); ++light)
            add_raster(SectionType::ground_lit, light, model_.images.ground_lit[light]);
        add_raster(SectionType::panorama, 0, model_.images.panorama);
    }

    void add_fields() {
        const std::vector<Field> &fields = model_.parameters.fields;
        if (fields.empty())
            return;
        FieldTable table{.id = {}, .fields = fields, .roots = {}};
        for (std::size_t f = 0; f < fields.size(); ++f)
            table.roots.push_back(
                static_cast<std::uint16_t>(stored_value(model_.levels[0].fields[f], 0, fields[f].bytes)));
        table.id = fields_id(table, model_.levels.back());
        add_raw(SectionType::fields, encode_fields(table));
        for (std::size_t level = 1; level < shapes_.size(); ++level)
            add_fields_of_level(level);
        for (Section &section : sections_)
            if (const auto type = section.entry.type; type == SectionType::fields ||
                                                      type == SectionType::field_directory ||
                                                      type == SectionType::field_values)
                section.entry.flags = 0; // 17.1.3
    }

    void add_shapes() {
        const std::vector<Material> &materials = model_.parameters.materials;
        if (std::none_of(materials.begin(), materials.end(),
                         [](const Material &material) { return is_round(material) || material.tint > 0; }))
            return;
        add_raw(SectionType::shapes, encode_shapes(materials));
        sections_.back().entry.flags = 0; // 18.1.1
    }

    void add_fields_of_level(std::size_t level) {
        const std::vector<Field> &fields = model_.parameters.fields;
        FieldDirectory directory{.entries = {}, .fields = fields.size()};
        Bytes values;
        std::uint64_t first_node = 0, first_point = 0, raw_bytes = 0;
        for (const ChunkShape &shape : shapes_[level]) {
            for (std::size_t f = 0; f < fields.size(); ++f) {
                const std::size_t bytes = fields[f].bytes, start = values.size();
                const ByteView points =
                    ByteView(level_at(level).fields[f]).subspan(bytes * first_point, bytes * shape.points);
                const ByteView nodes =
                    ByteView(level_at(level - 1).fields[f]).subspan(bytes * first_node, bytes * shape.nodes);
                FieldEntry entry;
                if (mapped_) {
                    values.insert(values.end(), points.begin(), points.end());
                    entry.stream.stored_bytes = static_cast<std::uint32_t>(points.size());
                } else {
                    entry.stream =
                        append_field_freely(fields[f], ByteView(level_at(level).masks).subspan(first_node, shape.nodes),
                                            points, nodes, random_, values);
                }
                entry.hash = hash64(ByteView(values).subspan(start));
                directory.entries.push_back(entry);
                raw_bytes += points.size();
            }
            first_node += shape.nodes;
            first_point += shape.points;
        }
        const Bytes entries = encode_field_directory(directory);
        const auto instance = static_cast<std::uint32_t>(level);
        add({.type = SectionType::field_directory,
             .codec = Codec::raw,
             .instance = instance,
             .element_bytes = static_cast<std::uint32_t>(kFieldEntryBytes * fields.size()),
             .alignment = random_alignment(),
             .raw_bytes = entries.size(),
             .count = shapes_[level].size()},
            entries);
        add({.type = SectionType::field_values,
             .codec = mapped_ ? Codec::raw : Codec::zstd_chunks,
             .instance = instance,
             .element_bytes = 0,
             .alignment = mapped_ ? kMappedChunksAlignment : random_alignment(),
             .raw_bytes = raw_bytes,
             .count = first_point},
            std::move(values));
    }

    // 19.4.3: a chunk with sides has no cone.
    bool has_sides(std::size_t level, const ChunkEntry &entry) const {
        return !encode_stream(PointStream::sides, level, entry).empty();
    }
    Bytes encode_stream(PointStream kind, std::size_t level, const ChunkEntry &entry) const {
        return kind == PointStream::sides ? encode_sides(level_at(level).sides, entry, set_, static_cast<int>(level))
                                          : encode_offsets(level_at(level).offsets, entry);
    }

    void add_stream_of_level(PointStream kind, std::size_t level) {
        if ((kind == PointStream::sides ? level_at(level).sides.size() : level_at(level).offsets.size()) == 0)
            return;
        std::vector<PointStreamEntry> entries;
        Bytes values;
        ChunkEntry chunk;
        std::uint64_t raw_bytes = 0;
        for (const ChunkShape &shape : shapes_[level]) {
            chunk.shape = shape;
            const Bytes raw = encode_stream(kind, level, chunk);
            const std::size_t start = values.size();
            const StreamEntry stored = append_raw_freely(raw, mapped_, random_, values);
            entries.push_back({.hash = hash64(ByteView(values).subspan(start)),
                               .stored_bytes = stored.stored_bytes,
                               .raw_bytes = static_cast<std::uint32_t>(raw.size()),
                               .zstd = stored.zstd});
            raw_bytes += raw.size();
            chunk.first_point += shape.points;
        }
        const Bytes directory = encode_stream_directory(entries);
        const std::uint32_t instance = instance_of(kind, static_cast<int>(level));
        add({.type = SectionType::stream_directory,
             .codec = Codec::raw,
             .instance = instance,
             .element_bytes = kPointStreamEntryBytes,
             .alignment = random_alignment(),
             .raw_bytes = directory.size(),
             .count = entries.size()},
            directory);
        sections_.back().entry.flags = 0; // 19.1.1
        add({.type = SectionType::stream_values,
             .codec = mapped_ ? Codec::raw : Codec::zstd_chunks,
             .instance = instance,
             .element_bytes = 0,
             .alignment = mapped_ ? kMappedChunksAlignment : random_alignment(),
             .raw_bytes = raw_bytes,
             .count = chunk.first_point},
            std::move(values));
        sections_.back().entry.flags = 0;
    }

    // Inserts sections of unknown, skippable types anywhere among the others: 3.2.4
    void add_unknown_sections() {
        constexpr std::array<std::uint32_t, 8> kTypes{0, 9, 15, 19, 23, 26, 33, 0xFFFFFFFF};
        std::uint64_t count = random_.below(2) * random_.below(5);
        if (random_.below(20) == 0)
            count = kMaxSections - sections_.size();
        for (std::uint64_t i = 0; i < count; ++i) {
            Bytes bytes(random_.below(4) * random_.below(20));
            for (std::uint8_t &byte : bytes)
                byte = static_cast<std::uint8_t>(random_.next());
            const bool raw = random_.below(2) == 0;
            const std::uint64_t raw_bytes = raw ? bytes.size() : random_.below(kMaxExpansion * (bytes.size() + 1));
            add({.type = SectionType{kTypes[random_.below(kTypes.size())]},
                 .codec = raw ? Codec::raw : Codec{static_cast<std::uint16_t>(1 + random_.below(65535))},
                 .instance = static_cast<std::uint32_t>(i << 8 | random_.below(256)), // unique
                 .element_bytes = static_cast<std::uint32_t>(random_.next()),
                 .alignment = random_alignment(),
                 .raw_bytes = raw_bytes,
                 .count = random_.next()},
                std::move(bytes));
            sections_.back().entry.flags = 0;
        }
        std::sort(sections_.begin(), sections_.end(),
                  [](const Section &a, const Section &b) { return a.entry.order() < b.entry.order(); });
    }

    Bytes assemble() {
        FileHeader header;
        header.required_features = mapped_ ? kMappedFeature : 0;
        header.optional_features = random_.below(2) == 0 ? 0 : random_.next();
        if (!model_.parameters.fields.empty())
            header.optional_features |= kFieldsFeature;
        if (header.closed() != model_.parameters.closed)
            header.optional_features ^= kClosedFeature;
        header.depth = static_cast<std::uint8_t>(model_.parameters.grid.depth);
        header.point_count = model_.point_count();
        header.content_id = content_id(model_, shapes_, chunk_points_);
        header.root = root_record(model_.levels[0].points, set_);
        header.chunk_points = chunk_points_;
        header.table_count = static_cast<std::uint32_t>(sections_.size());
        Bytes body; // bytes after the table
        const std::uint64_t start = kHeaderBytes + sections_.size() * kSectionEntryBytes;
        std::vector<SectionEntry> entries;
        for (Section &section : sections_) {
            SectionEntry &entry = section.entry;
            entry.offset = (start + body.size() + entry.alignment - 1) / entry.alignment * entry.alignment;
            entry.hash = hash64(section.stored);
            header.raw_bytes += entry.raw_bytes;
            body.resize(entry.offset - start, 0);
            body.insert(body.end(), section.stored.begin(), section.stored.end());
            entries.push_back(entry);
        }
        const Bytes table = encode_section_table(entries);
        header.file_size = start + body.size();
        header.table_hash = hash64(table);
        ByteWriter file;
        for (const Bytes &part : {encode_header(header), table, body})
            file.append(part);
        return file.take();
    }

    const Model &model_;
    const AttributeSet &set_;
    Random &random_;
    const bool mapped_;
    const std::uint32_t chunk_points_;
    std::vector<Section> sections_;
    std::vector<std::vector<ChunkShape>> shapes_;
    LevelDirectory directory_above_;
    std::vector<std::vector<BrickRecord>> bricks_above_; // bricks of each chunk of the level above
};

} // namespace

Bytes write_freely(const Model &model, Random &random) { return FreeWriter(model, random).write(); }

} // namespace pbm::test
