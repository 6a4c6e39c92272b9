#include "collection.h"
#include "unit/support/test_models.h"

#include "pbm_format/checking/validate.h"
#include "pbm_format/chunks/brick_index.h"
#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

#include <functional>
#include <limits>
#include <string_view>

namespace pbm::test {

namespace {

// Without filters: each stream is raw or one frame.
Bytes encode(const Model &model) {
    return value_of(
        encode_model(model, {.compression_level = 19, .filters = false, .chunk_points = 512, .threads = 1}));
}

Bytes encode_filtered(const Model &model) {
    return value_of(encode_model(model, {.compression_level = 19, .chunk_points = 512, .threads = 1}));
}

// Depth 3, every attribute, one chunk per level, streams so short that they are raw.
const Bytes &every_attribute_file() {
    static const Bytes file = encode(sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.2));
    return file;
}

// Depth 5, several chunks at the finest levels, no optional attribute.
const Bytes &many_chunks_file() {
    static const Bytes file = encode(sphere_model(5, {}));
    return file;
}

// The same with filters and every attribute.
const Bytes &filtered_file() {
    static const Bytes file = encode_filtered(sphere_model(5, every_attribute(ColourFormat::rgb888, 5)));
    return file;
}

// Few points with irregular normals, so that no frame pays.
const Bytes &small_filtered_file() {
    static const Bytes file = [] {
        Model model = sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.25);
        Random random(4);
        for (std::uint16_t &normal : model.levels.back().points.normals) {
            const IntegerNormal n = integer_normal_table()[normal];
            normal = quantise_normal(n[0] + 9000 * random.unit(), n[1] + 9000 * random.unit(), n[2]);
        }
        average_levels(model, 1);
        return encode_filtered(model);
    }();
    return file;
}

// Materials constant in cubes of four voxels, and slowly varying lit fractions: both filter well.
const Bytes &filtered_regions_file() {
    static const Bytes file = [] {
        AttributeSet set{.material = true, .lights = 2, .shadow_bits = {}};
        set.shadow_bits[0].fill(4);
        set.shadow_bits[1].fill(8);
        Model model = sphere_model(5, set);
        PointAttributes &points = model.levels.back().points;
        std::vector<MortonCode> codes{0};
        for (std::size_t level = 1; level < model.levels.size(); ++level)
            codes = value_of(expand_level(codes, model.levels[level].masks, points.size()));
        for (std::size_t i = 0; i < codes.size(); ++i) {
            const auto [x, y, z] = morton_decode(codes[i]);
            points.materials[i] = static_cast<std::uint8_t>(Random(codes[i] >> 6).below(3));
            points.shadows[0][i] = static_cast<std::uint8_t>((x + 2 * y) * 15 / 93);
            points.shadows[1][i] = static_cast<std::uint8_t>(2 * x + 3 * y + 3 * z);
        }
        average_levels(model, 1);
        return encode_filtered(model);
    }();
    return file;
}

const Bytes &colour_565_file() {
    static const Bytes file = encode(sphere_model(2, {.colour = ColourFormat::rgb565}));
    return file;
}

Bytes encode_mapped(const Model &model) {
    return value_of(encode_model(model, {.storage = Storage::mapped, .chunk_points = 512, .threads = 1}));
}

// Depth 3, every attribute, mapped.
const Bytes &mapped_file() {
    static const Bytes file = encode_mapped(sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.2));
    return file;
}

// The same with several chunks, no optional attribute.
const Bytes &mapped_chunks_file() {
    static const Bytes file = encode_mapped(sphere_model(5, {}));
    return file;
}

void add_header_files(Collection &files) {
    files.add("2.1-other-magic", set<std::uint8_t>(0, 0x88));
    files.add("2.2-half-a-header", [](FileEditor &file) { file.bytes().resize(100); });
    files.add_unrepaired("2.3-flipped-bit-in-the-version", 8);
    files.add("2.4-big-endian-tag", set<std::uint32_t>(12, 0x04030201));
    files.add("2.5-major-version-7", set<std::uint16_t>(8, 7));
    files.add("2.5-version-0.3", [](FileEditor &file) {
        file.set<std::uint16_t>(8, 0);
        file.set<std::uint16_t>(10, 3);
    });
    files.add("2.6-required-feature-40", set<std::uint64_t>(40, std::uint64_t{1} << 40));
    files.add("2.7-one-byte-short", [](FileEditor &file) { file.bytes().pop_back(); });
    files.add("2.7-one-byte-more", [](FileEditor &file) { file.bytes().push_back(0); });
    files.add("2.8-reserved-byte", set<std::uint8_t>(38, 1));
    files.add("2.9-depth-1", set<std::uint8_t>(36, 1));
    files.add("2.9-depth-17", set<std::uint8_t>(36, 17));
    files.add("2.10-no-points", set<std::uint64_t>(56, 0));
    files.add("2.10-too-many-points", set<std::uint64_t>(56, std::uint64_t{1} << 32));
    files.add("2.11-chunk-limit-256", set<std::uint32_t>(104, 256));
    files.add("2.11-chunk-limit-1000", set<std::uint32_t>(104, 1000));
    files.add("2.12-table-elsewhere", set<std::uint64_t>(24, 136));
    files.add("2.13-root-normal", set<std::uint16_t>(88, 0x4000));
    files.add("2.14-root-colour-without-colours", many_chunks_file(), set<std::uint8_t>(91, 7));
    files.add("2.14-root-colour-not-565", colour_565_file(), set<std::uint8_t>(90, 1));
    files.add("2.15-root-material", set<std::uint8_t>(93, 3));
    files.add("2.16-root-texture-without-texture", many_chunks_file(), set<std::uint8_t>(95, 1));
    files.add("2.17-root-lit-fraction", set<std::uint8_t>(96, 16));
    files.add("2.17-root-lit-fraction-without-light", set<std::uint8_t>(98, 1));
    files.add("2.18-point-count", set<std::uint64_t>(56, 12345));
}

void add_table_files(Collection &files) {
    using enum SectionType;
    files.add("3.1.1-no-sections", set<std::uint32_t>(32, 0));
    files.add("3.1.1-257-sections", set<std::uint32_t>(32, 257));
    files.add("3.1.2-table-past-the-end", set<std::uint32_t>(32, 250));
    files.add_unrepaired("3.1.3-flipped-bit", 140);
    files.add("3.1.5-bytes-behind-the-last-section", [](FileEditor &file) {
        file.bytes().resize(file.bytes().size() + 8);
        file.set<std::uint64_t>(16, file.bytes().size());
    });
    files.add("3.1.6-raw-size", set<std::uint64_t>(64, 1));
    files.add("3.1.7-no-materials", [](FileEditor &file) {
        // Gives the section of materials an unknown type.
        const std::size_t at = file.entry(materials);
        file.set<std::uint32_t>(at, 4);
        file.set<std::uint32_t>(file.entry(attributes), 3);
        file.set<std::uint32_t>(at, 5);
        file.set<std::uint32_t>(at + kSectionEntryBytes, 6);
        file.set<std::uint32_t>(at + 2 * kSectionEntryBytes, 9);
        file.set<std::uint16_t>(at + 2 * kSectionEntryBytes + 6, 0);
    });
    files.add("3.1.8-a-level-less", set<std::uint8_t>(36, 4));
    files.add("3.2.1-reserved-byte", set_entry<std::uint32_t>(grid, 0, 20, 1));
    files.add("3.2.2-twice", set_entry<std::uint32_t>(attributes, 0, 0, 2));
    files.add("3.2.3-gap", set_entry<std::uint64_t>(metadata, 0, 24, 2048));
    files.add("3.2.4-unknown-critical-section", set_entry<std::uint32_t>(texture, 0, 0, 9));
    files.add("3.2.5-unknown-codec", set_entry<std::uint16_t>(level_chunks, 2, 4, 2));
    files.add("3.2.6-unknown-flag", set_entry<std::uint16_t>(grid, 0, 6, 3));
    files.add("3.2.7-instance", set_entry<std::uint32_t>(grid, 0, 8, 1));
    files.add("3.2.8-alignment-4", set_entry<std::uint32_t>(grid, 0, 16, 4));
    files.add("3.2.9-raw-but-smaller", set_entry<std::uint64_t>(metadata, 0, 40, 3));
    files.add("3.2.10-bomb", set_entry<std::uint64_t>(level_chunks, 3, 40, std::uint64_t{1} << 40));
    files.add("3.2.11-section-past-the-end", [](FileEditor &file) {
        const std::size_t at = file.entry(level_chunks, 3);
        for (const std::size_t field : {std::size_t{32}, std::size_t{40}})
            file.set<std::uint64_t>(at + field, std::uint64_t{1} << 33);
    });
    files.add("3.2.12-padding", [](FileEditor &file) {
        const std::size_t at = file.entry(metadata);
        file.set<std::uint8_t>(file.section(metadata) + file.get<std::uint64_t>(at + 32), 1);
    });
    files.add("3.2.13-count", set_entry<std::uint64_t>(materials, 0, 48, 7));
}

void add_section_files(Collection &files) {
    using enum SectionType;
    files.add_unrepaired("3.2.14-flipped-bit-in-the-grid", FileEditor(every_attribute_file()).section(grid) + 3);
    files.add("3.3.1-long-metadata", [](FileEditor &file) { file.lengthen(metadata, 0, 4096, ' '); });
    files.add("3.3.2-metadata-is-no-json", set_in<std::uint8_t>(metadata, 0, '['));
    files.add("3.3.2-metadata-with-a-zero-byte", [](FileEditor &file) {
        const std::size_t end = file.section(metadata) + file.get<std::uint64_t>(file.entry(metadata) + 32);
        file.set<std::uint16_t>(end - 2, 0x007D); // "}" and a zero byte instead of a quote and "}"
        file.set<std::uint8_t>(end - 3, '"');
    });
    files.add("3.3.3-metadata-is-an-array", [](FileEditor &file) {
        const std::size_t at = file.section(metadata);
        const auto size = static_cast<std::size_t>(file.get<std::uint64_t>(file.entry(metadata) + 32));
        for (std::size_t i = 0; i < size; ++i)
            file.set<std::uint8_t>(at + i, ' ');
        file.set<std::uint8_t>(at, '[');
        file.set<std::uint8_t>(at + 1, ']');
    });
    files.add("3.4.1-short-grid", shorten(grid, 40, 8));
    files.add("3.4.2-corner-is-nan", set_in<double>(grid, 8, std::numeric_limits<double>::quiet_NaN()));
    files.add("3.4.3-voxel-size-0", set_in<double>(grid, 24, 0));
    files.add("3.4.4-unit", set_in<std::uint8_t>(grid, 32, 7));
    files.add("3.4.5-up-axis", set_in<std::uint8_t>(grid, 33, 3));
    files.add("3.4.6-reserved", set_in<std::uint8_t>(grid, 40, 1));
    files.add("3.5.1-half-a-record", shorten(attributes, 8, 8));
    files.add("3.5.2-unknown-kind", set_in<std::uint8_t>(attributes, 0, 9));
    files.add("3.5.3-twice", set_in<std::uint8_t>(attributes, 24, 1));
    files.add("3.5.3-lights-with-a-gap", set_in<std::uint8_t>(attributes, 5 * 24 + 2, 1));
    files.add("3.5.4-colour-format-3", set_in<std::uint8_t>(attributes, 2 * 24 + 1, 3));
    files.add("3.5.5-three-bits", set_in<std::uint8_t>(attributes, 5 * 24 + 4, 3));
    files.add("3.5.5-bits-of-colour", set_in<std::uint8_t>(attributes, 2 * 24 + 4, 8));
    files.add("3.5.6-reserved", set_in<std::uint8_t>(attributes, 3, 1));
    files.add("3.5.7-no-radius", colour_565_file(), [](FileEditor &file) {
        file.set<std::uint8_t>(file.section(attributes) + 24, 4);
        file.set<std::uint8_t>(file.section(attributes) + 48, 5);
        file.set<std::uint8_t>(file.section(attributes) + 49, 0);
    });
    files.add("3.6.1-half-a-material", shorten(materials, 8, 8));
    files.add("3.6.2-kd-2", set_in<float>(materials, 4, 2));
    files.add("3.6.3-exponent-0", set_in<float>(materials, 12, 0));
    files.add("3.6.4-environment", set_in<float>(materials, 20, -1));
    files.add("3.6.5-reserved", set_in<std::uint8_t>(materials, 19, 1));
    files.add("3.7.1-half-a-light", shorten(lights, 8, 8));
    files.add("3.7.2-kind", set_in<std::uint8_t>(lights, 0, 3));
    files.add("3.7.3-negative-intensity", set_in<float>(lights, 4, -1));
    files.add("3.7.4-position-is-infinite", set_in<float>(lights, 16, std::numeric_limits<float>::infinity()));
    files.add("3.7.5-direction-of-length-2", set_in<float>(lights, 36, 2));
    files.add("3.7.5-direction-is-zero", [](FileEditor &file) {
        for (std::size_t axis = 0; axis < 3; ++axis)
            file.set<float>(file.section(lights) + 28 + 4 * axis, 0);
    });
    files.add("3.7.5-direction-is-nan", set_in<float>(lights, 32, std::numeric_limits<float>::quiet_NaN()));
    files.add("3.7.6-spot-exponent", set_in<float>(lights, 40, 2000));
    files.add("3.7.7-reserved", set_in<std::uint8_t>(lights, 45, 1));
    files.add("3.8.1-short-texture", shorten(texture, 8, 8));
    files.add("3.8.2-kind", set_in<std::uint8_t>(texture, 0, 3));
    files.add("3.8.3-scale", set_in<float>(texture, 8, 0));
    files.add("3.8.4-reserved", set_in<std::uint8_t>(texture, 20, 1));
    files.add("3.9.1-one-light-for-two-streams", shorten(lights, 48, 48));
    files.add("3.9.2-texture-values-without-palette", [](FileEditor &file) { // gives its section an unknown type
        const std::size_t entry = file.entry(texture);
        file.set<std::uint32_t>(entry, 9);
        file.set<std::uint16_t>(entry + 6, 0);
    });
    files.add("3.9.3-materials-without-stream", [](FileEditor &file) { // removes the fourth of seven records
        const std::size_t at = file.section(attributes) + 3 * 24;
        for (std::size_t i = 0; i < 3 * 24; ++i)
            file.set<std::uint8_t>(at + i, file.get<std::uint8_t>(at + i + 24));
        file.shorten(attributes, 0, 24, 24);
    });
}

// Damages plane `plane` of a filtered stream: `damage` gets the offsets of the stream, of the plane and of its end.
// Takes the first stream, from coarse to fine, of chunk 0 of a level that has the filter and stores that plane raw.
Collection::Edit in_plane(Filter filter, std::size_t plane,
                          const std::function<void(FileEditor &, std::size_t, std::size_t, std::size_t)> &damage) {
    return [=](FileEditor &file) {
        const AttributeSet set = every_attribute(ColourFormat::rgb888, 5);
        for (std::uint32_t level = 1; level <= file.get<std::uint8_t>(36); ++level) {
            std::size_t stream = file.section(SectionType::level_chunks, level);
            for (std::size_t s = 0; s < streams_of(set).size(); ++s) {
                const auto entry = file.get<std::uint32_t>(file.chunk(level) + kChunkEntryFixedBytes + 4 * s);
                const auto size = [&](std::size_t p) { return file.get<std::uint32_t>(stream + 4 * p); };
                if (static_cast<Filter>(entry >> 24 & 127) == filter && size(plane) > 1 && size(plane) >> 31 == 0) {
                    std::size_t at = stream + kPlaneEntryBytes * plane_count(filter);
                    for (std::size_t p = 0; p < plane; ++p)
                        at += size(p) & 0xFFFFFF;
                    return damage(file, stream, at, at + size(plane));
                }
                stream += entry & 0xFFFFFF;
            }
        }
        assert(false && "no such stream");
    };
}

// Flips a bit of a filtered shadow stream so that its frame decodes to codes with bits set after the last code.
// Searches all bits, because one byte of the frame determines the last byte of the codes.
void set_bits_behind_codes(FileEditor &file) {
    const Result<Reader> reader = Reader::open(file.bytes());
    const StreamList streams = streams_of(reader->parameters().attributes);
    for (int level = 1; level <= reader->depth(); ++level) {
        std::size_t stream = file.section(SectionType::level_chunks, static_cast<std::uint32_t>(level));
        for (std::size_t s = 0; s < streams.size(); ++s) {
            const auto entry =
                file.get<std::uint32_t>(file.chunk(static_cast<std::uint32_t>(level)) + kChunkEntryFixedBytes + 4 * s);
            const std::size_t end = stream + (entry & 0xFFFFFF);
            for (std::size_t bit = 8 * (stream + kPlaneEntryBytes);
                 bit < 8 * end && static_cast<Filter>(entry >> 24) == Filter::shadow; ++bit) {
                FileEditor damaged = file;
                damaged.flip(bit);
                damaged.repair();
                const ValidationReport report = validate(damaged.bytes(), {.threads = 1});
                if (!report.valid() && report.findings[0].message.starts_with("6.6.1 "))
                    return file.flip(bit);
            }
            stream = end;
        }
    }
    assert(false && "no such stream");
}

void add_filter_files(Collection &files) {
    using Place = std::size_t;
    files.add("6.6.1-bits-behind-filtered-lit-fractions", filtered_regions_file(), set_bits_behind_codes);
    files.add("5.8.1-plane-of-another-size", filtered_file(),
              in_plane(Filter::texture, 0, [](FileEditor &file, Place stream, Place, Place) {
                  file.set<std::uint8_t>(stream, static_cast<std::uint8_t>(file.get<std::uint8_t>(stream) - 1));
              }));
    files.add("5.8.1-reserved-bit", filtered_file(),
              in_plane(Filter::normal, 1,
                       [](FileEditor &file, Place stream, Place, Place) { file.set<std::uint8_t>(stream + 3, 1); }));
    files.add("5.8.1-planes-past-the-end", filtered_file(),
              in_plane(Filter::normal, 1,
                       [](FileEditor &file, Place stream, Place, Place) { file.set<std::uint8_t>(stream + 6, 1); }));
    files.add("5.8.2-no-pair-and-no-escape", small_filtered_file(),
              in_plane(Filter::normal, 0,
                       [](FileEditor &file, Place, Place codes, Place) { file.set<std::uint8_t>(codes, 31); }));
    files.add("5.8.3-escape-outside-the-map", filtered_file(),
              in_plane(Filter::normal, 1,
                       [](FileEditor &file, Place, Place escapes, Place) { file.set<std::uint8_t>(escapes + 1, 64); }));
}

void add_mapped_files(Collection &files) {
    using enum SectionType;
    const auto set_brick = [](std::size_t field, std::uint16_t flip) {
        return [=](FileEditor &file) {
            const std::size_t at = file.section(level_bricks, 3) + field;
            file.set<std::uint16_t>(at, static_cast<std::uint16_t>(file.get<std::uint16_t>(at) ^ flip));
        };
    };
    files.add("3.2.5-zstd-chunks-in-a-mapped-file", set<std::uint64_t>(40, kMappedFeature));
    files.add("3.2.15-bricks-in-a-packed-file", mapped_file(), set<std::uint64_t>(40, 0));
    files.add("3.2.16-alignment-of-bricks", mapped_file(), set_entry<std::uint32_t>(level_bricks, 2, 16, 128));
    files.add("3.2.16-alignment-of-chunks", mapped_file(), set_entry<std::uint32_t>(level_chunks, 2, 16, 64));
    files.add("5.4.4-compressed-stream", mapped_file(), [](FileEditor &file) {
        const std::size_t at = file.chunk(3) + kChunkEntryFixedBytes;
        file.set<std::uint32_t>(at, (file.get<std::uint32_t>(at) - 1) | 1U << 31);
    });
    files.add("5.10.1-padding", mapped_file(),
              [](FileEditor &file) { file.set<std::uint8_t>(file.section(level_chunks, 1) + 1, 1); });
    files.add("5.10.2-bricks-of-12-bytes", mapped_file(), [](FileEditor &file) {
        const std::size_t at = file.entry(level_bricks, 3);
        file.set<std::uint32_t>(at + 12, 12);
        file.set<std::uint64_t>(at + 48, 2 * file.get<std::uint64_t>(at + 48));
    });
    files.add("5.11.1-half-a-brick", mapped_chunks_file(), [](FileEditor &file) {
        for (const std::size_t chunk : {std::size_t{0}, std::size_t{1}}) {
            const std::size_t at = file.chunk(5, chunk) + 28;
            file.set<std::uint32_t>(at, file.get<std::uint32_t>(at) + (chunk == 0 ? ~0U : 1U));
        }
    });
    files.add("5.11.2-place", mapped_file(), set_brick(offsetof(BrickRecord, y), 1));
    files.add("5.11.2-first-node", mapped_file(), set_brick(offsetof(BrickRecord, first_node), 1));
    files.add("5.11.2-node-map", mapped_file(), set_brick(offsetof(BrickRecord, node_map) + 3, 1));
    files.add("5.11.3-cone", mapped_chunks_file(), set_brick(offsetof(BrickRecord, cone_cosine), 1));
    files.add("5.11.4-radius", mapped_file(), set_brick(offsetof(BrickRecord, largest_radius), 1));
    files.add("5.11.4-flags", mapped_file(), set_brick(offsetof(BrickRecord, largest_radius), 0x200));
}

void add_chunk_files(Collection &files) {
    using enum SectionType;
    const auto in_chunk = [](std::uint32_t level, std::size_t at, std::uint8_t value) {
        return [=](FileEditor &file) { file.set<std::uint8_t>(file.section(level_chunks, level) + at, value); };
    };
    files.add("4.2-zero-mask", in_chunk(2, 0, 0));
    files.add("4.4-one-child-more", many_chunks_file(), in_chunk(1, 0, 0x7F));
    files.add("5.2-brick-count", set_chunk<std::uint32_t>(3, 0, 40 - 12, 1 + 1));
    files.add("5.3.1-root-too-deep", set_chunk<std::uint8_t>(2, 0, 40, 1));
    files.add("5.3.2-root-outside", set_chunk<std::uint64_t>(2, 0, 0, 1));
    files.add("5.3.3-no-points", set_chunk<std::uint32_t>(2, 0, 16, 0));
    files.add("5.3.4-nodes", set_chunk<std::uint32_t>(2, 0, 20, 60000));
    files.add("5.3.5-parents", set_chunk<std::uint32_t>(1, 0, 24, 1));
    files.add("5.3.6-bricks", set_chunk<std::uint32_t>(1, 0, 28, 2));
    files.add("5.3.7-cone", set_chunk<std::uint16_t>(2, 0, 36, 8192));
    files.add("5.4.1-filter-5", set_chunk<std::uint8_t>(2, 0, 51, 5));
    files.add("5.4.2-stored-size", set_chunk<std::uint32_t>(2, 0, 52, 3));
    files.add("5.4.3-normals-from-one-byte", [](FileEditor &file) {
        file.set<std::uint32_t>(104, kDefaultChunkPoints);
        const std::size_t at = file.chunk(3);
        const std::array<std::uint32_t, 4> counts{32768, 4096, 512, 64}; // points, nodes, parents, bricks
        for (std::size_t i = 0; i < counts.size(); ++i)
            file.set<std::uint32_t>(at + 16 + 4 * i, counts[i]);
        for (const std::size_t stream : {std::size_t{0}, std::size_t{1}})
            file.set<std::uint32_t>(at + kChunkEntryFixedBytes + 4 * stream, 1U << 31 | 1U);
    });
    files.add("5.5.1-no-whole-entry", [](FileEditor &file) { file.shorten(level_directory, 1, 8, 8); });
    files.add("5.5.2-reserved", set_chunk<std::uint8_t>(2, 0, 44, 1));
    files.add("5.5.3-order", many_chunks_file(), set_chunk<std::uint64_t>(5, 1, 0, 0));
    files.add("5.5.4-parent-of-level-1", set_chunk<std::uint32_t>(1, 0, 32, 1));
    files.add("5.5.5-parent-chunk", many_chunks_file(), set_chunk<std::uint32_t>(5, 1, 32, 7));
    files.add("5.5.6-beside-its-parent", many_chunks_file(), [](FileEditor &file) { // a parent other than the last
        const std::size_t at = file.chunk(5);
        assert(file.get<std::uint8_t>(file.chunk(4) + 40) > 0);
        file.set<std::uint64_t>(at, (std::uint64_t{1} << 3 * file.get<std::uint8_t>(at + 40)) - 1);
    });
    files.add("5.5.7-nodes-of-the-parent", many_chunks_file(), [](FileEditor &file) {
        const std::size_t at = file.chunk(5, 7) + 20;
        file.set<std::uint32_t>(at, file.get<std::uint32_t>(at) + 1);
    });
    files.add("5.5.8-past-the-end", many_chunks_file(), [](FileEditor &file) { // whose masks are a frame
        const std::size_t at = file.chunk(5);
        file.set<std::uint32_t>(at + kChunkEntryFixedBytes, 1U << 31 | (file.get<std::uint32_t>(at + 20) - 1));
    });
    files.add("5.5.9-a-chunk-less", filtered_file(), [](FileEditor &file) {
        const std::uint32_t entry_bytes = file.get<std::uint32_t>(file.entry(level_directory, 5) + 12);
        file.shorten(level_directory, 5, entry_bytes, entry_bytes);
    });
    files.add("5.5.11-two-entries-of-half-the-size", [](FileEditor &file) {
        const std::size_t at = file.entry(level_directory, 2);
        file.set<std::uint32_t>(at + 12, file.get<std::uint32_t>(at + 12) / 2);
        file.set<std::uint64_t>(at + 48, 2 * file.get<std::uint64_t>(at + 48));
    });
    files.add("5.5.10-raw-size", [](FileEditor &file) {
        const std::size_t at = file.entry(level_chunks, 3) + 40;
        file.set<std::uint64_t>(at, file.get<std::uint64_t>(at) + 1);
        file.set<std::uint64_t>(64, file.get<std::uint64_t>(64) + 1);
    });
    FileEditor chunk_damage(every_attribute_file());
    chunk_damage.flip(8 * every_attribute_file().size() - 1);
    chunk_damage.repair(false);
    files.add_as_is("5.6.4-flipped-bit-in-the-finest-level", chunk_damage.bytes());
    // The masks of the first chunk of level 5 are a zstd frame: magic, descriptor, content size, blocks.
    const auto in_frame = [](std::size_t at) {
        return [=](FileEditor &file) {
            const std::size_t byte = file.section(level_chunks, 5) + at;
            file.set<std::uint8_t>(byte, static_cast<std::uint8_t>(file.get<std::uint8_t>(byte) ^ 0x20));
        };
    };
    files.add("5.6.1-older-frame", many_chunks_file(), in_frame(1));
    files.add("5.6.1-frame-with-a-window", many_chunks_file(), in_frame(4));
    files.add("5.6.2-content-size", many_chunks_file(), in_frame(5));
    files.add("5.6.3-damaged-block", many_chunks_file(), in_frame(9));
    files.add("5.7.1-cone-too-narrow", many_chunks_file(), set_chunk<std::int16_t>(5, 0, 38, 32767));
    add_filter_files(files);
    const auto edit_model = [](const std::function<void(Model &)> &edit) {
        Model model = sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.2);
        edit(model);
        return encode(model);
    };
    files.add_as_is("6.1.4-reserved-bits-of-a-normal",
                    edit_model([](Model &model) { model.levels[3].points.normals[1] |= 0x8000; }));
    files.add_as_is("6.2.2-radius-too-large", edit_model([](Model &model) { model.levels[3].points.radii[1] = 204; }));
    files.add_as_is("6.4.1-no-such-material",
                    edit_model([](Model &model) { model.levels[3].points.materials[1] = 3; }));
    files.add_as_is("7.1-no-average", edit_model([](Model &model) { model.levels[2].points.colours[1] ^= 1; }));
    files.add("8.1-content-id", [](FileEditor &file) { file.flip(8 * 72); });
}

} // namespace

namespace {

// A third of the points two-sided, N = 65,536, colours 565.
Bytes two_sided_file() {
    Model model = sphere_model(4, {.colour = ColourFormat::rgb565}, 0.3);
    std::vector<std::uint16_t> &normals = model.levels.back().points.normals;
    for (std::size_t i = 0; i < normals.size(); i += 3)
        normals[i] |= kTwoSidedBit;
    average_levels(model, 1);
    return value_of(encode_model(model, {.compression_level = 19, .threads = 1}));
}

} // namespace

std::vector<ValidFile> valid_files() {
    std::vector<ValidFile> files = valid_surroundings_files();
    const std::vector<ValidFile> others = {
        {"every-attribute.pbvg", every_attribute_file()},
        {"many-chunks.pbvg", many_chunks_file()},
        {"colour-565.pbvg", colour_565_file()},
        {"filtered.pbvg", filtered_file()},
        {"filtered-565.pbvg", encode_filtered(sphere_model(5, every_attribute(ColourFormat::rgb565, 5), 0.3, 7))},
        {"filtered-regions.pbvg", filtered_regions_file()},
        {"smallest.pbvg", encode(sphere_model(2, {}, 0.05))},
        {"mapped.pbvg", mapped_file()},
        {"mapped-chunks.pbvg", mapped_chunks_file()},
        {"two-sided.pbvg", two_sided_file()}};
    files.insert(files.end(), others.begin(), others.end());
    for (const std::vector<ValidFile> &more : {valid_small_files(), valid_field_files(), valid_side_files()})
        files.insert(files.end(), more.begin(), more.end());
    return files;
}

std::vector<InvalidFile> invalid_files() {
    Collection files(every_attribute_file());
    add_header_files(files);
    add_table_files(files);
    add_section_files(files);
    add_chunk_files(files);
    add_mapped_files(files);
    add_surroundings_files(files);
    add_small_files(files);
    add_field_files(files);
    add_side_files(files);
    return files.take();
}

} // namespace pbm::test
