// Files of few points with features that the larger ones lack: the deepest grid, a frame with a checksum, extensions of
// a later minor version, and the worked example of BVG.md (appendix D).
#include "collection.h"
#include "unit/support/test_models.h"

#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace pbm::test {

namespace {

constexpr std::uint32_t kUnknownType = 9;

// A model with one material, without levels.
Model model_of(int depth, AttributeSet set) {
    Model model;
    model.metadata = R"({"generator":"test"})";
    model.parameters.grid = {.depth = depth, .origin = {-1, -2, -3}, .voxel_size = 2.0 / (1U << depth)};
    model.parameters.attributes = set;
    model.parameters.materials.resize(1);
    return model;
}

// Depth 16: two opposite corners of the grid, each with a neighbour, and two voxels that meet in the grid's centre.
Bytes deepest_file() {
    constexpr std::uint32_t kLast = 65535, kMiddle = 32768;
    const std::array codes{morton_encode(0, 0, 0),
                           morton_encode(1, 0, 0),
                           morton_encode(kMiddle - 1, kMiddle - 1, kMiddle - 1),
                           morton_encode(kMiddle, kMiddle, kMiddle),
                           morton_encode(kLast, kLast, kLast - 1),
                           morton_encode(kLast, kLast, kLast)};
    Model model = model_of(kMaxDepth, {});
    PointAttributes points;
    points.resize(codes.size(), {});
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const auto [x, y, z] = morton_decode(codes[i]);
        points.normals[i] = quantise_normal(x + 0.5 - kMiddle, y + 0.5 - kMiddle, z + 0.5 - kMiddle);
        points.radii[i] = 255 - 12 * kMaxDepth; // the edge of a voxel
    }
    set_levels(model, {codes.begin(), codes.end()}, std::move(points), 1);
    return value_of(encode_model(model, {.threads = 1}));
}

// The last stream of the file is a frame of 32 equal bytes. It gets the optional checksum of RFC 8878: the low half of
// the XXH64 of the content.
const Bytes &checksum_file() {
    static const Bytes file = [] {
        constexpr std::array<std::uint8_t, 4> kChecksum{0x6B, 0xC2, 0x3C, 0x6D};
        constexpr std::uint32_t kLevel = 2, kStreams = 3;
        FileEditor editor(value_of(encode_model(sphere_model(kLevel, {}, 0.3), {.filters = false, .threads = 1})));
        const std::size_t stream = editor.chunk(kLevel) + kChunkEntryFixedBytes + 4 * (kStreams - 1);
        const std::uint32_t frame_bytes = editor.get<std::uint32_t>(stream) & 0xFFFFFF;
        const std::size_t frame = editor.bytes().size() - frame_bytes;
        assert(editor.get<std::uint32_t>(stream) >> 31 == 1 && editor.get<std::uint8_t>(frame + 4) == 0x20);
        editor.set<std::uint8_t>(frame + 4, 0x24);
        editor.bytes().insert(editor.bytes().end(), kChecksum.begin(), kChecksum.end());
        const std::size_t section = editor.entry(SectionType::level_chunks, kLevel);
        editor.set<std::uint32_t>(stream, editor.get<std::uint32_t>(stream) + 4);
        editor.set<std::uint64_t>(section + 32, editor.get<std::uint64_t>(section + 32) + 4);
        editor.set<std::uint64_t>(16, editor.bytes().size());
        editor.repair();
        return editor.bytes();
    }();
    return file;
}

// A later minor version may add an optional feature and a section that a reader may ignore.
const Bytes &unknown_extras_file() {
    static const Bytes file = [] {
        const WriteOptions options{
            .compression_level = 19, .filters = false, .chunk_points = kMinChunkPoints, .threads = 1};
        Model model = sphere_model(3, {}, 0.2);
        const Bytes without = value_of(encode_model(model, options));
        model.parameters.lights.resize(1); // gives the section an unknown type
        FileEditor editor(value_of(encode_model(model, options)));
        const std::size_t entry = editor.entry(SectionType::lights);
        editor.set<std::uint32_t>(entry, kUnknownType);
        editor.set<std::uint16_t>(entry + 6, 0);
        editor.set<std::uint64_t>(48, 1);
        editor.set<std::uint16_t>(10, 7);
        for (std::size_t i = 72; i < 88; ++i) // content_id does not cover the section
            editor.set<std::uint8_t>(i, without[i]);
        editor.repair();
        return editor.bytes();
    }();
    return file;
}

// A sphere whose surface is said to be closed.
Bytes closed_file(Storage storage) {
    Model model = sphere_model(4, {}, 0.3);
    model.parameters.closed = true;
    return value_of(encode_model(model, {.storage = storage, .compression_level = 19, .threads = 1}));
}

// A sphere whose upper half has a material of round points.
Bytes shapes_file(Storage storage) {
    Model model = sphere_model(4, {.material = true}, 0.3);
    model.parameters.materials.resize(2);
    model.parameters.materials[1].shape = PointShape::round;
    Level &finest = model.levels.back();
    for (std::size_t i = 0; i < finest.points.size(); ++i) {
        const bool is_round = (finest.points.normals[i] & 1 << 12) == 0; // its z is not negative
        finest.points.materials[i] = is_round ? 1 : 0;
        if (is_round)
            finest.points.normals[i] |= kTwoSidedBit;
    }
    average_levels(model, 1);
    return value_of(encode_model(model, {.storage = storage, .compression_level = 19, .threads = 1}));
}

// A sphere half of whose points reflect the panorama in their colour, and half of them in their colour by a quarter.
Bytes tints_file(Storage storage) {
    Model model = sphere_model(4, {.colour = ColourFormat::rgb888, .material = true}, 0.3);
    model.parameters.materials.assign(2, {.environment = 0.75F, .tint = 255});
    model.parameters.materials[1].tint = 64;
    Level &finest = model.levels.back();
    for (std::size_t i = 0; i < finest.points.size(); ++i)
        finest.points.materials[i] = (finest.points.normals[i] & 1 << 12) == 0 ? 0 : 1;
    average_levels(model, 1);
    Image &panorama = model.images.panorama;
    panorama = {.width = 32, .height = 16, .channels = 3, .texels = {}};
    for (std::uint32_t y = 0; y < panorama.height; ++y)
        for (std::uint32_t x = 0; x < panorama.width; ++x)
            for (const std::uint32_t channel : {8 * x, 255 - 16 * y, 4 * (x + y)})
                panorama.texels.push_back(static_cast<std::uint8_t>(channel));
    return value_of(encode_model(model, {.storage = storage, .compression_level = 19, .threads = 1}));
}

// Octant 0 has 320 voxels, each alone in its node. Octant 7 has 512 voxels in pairs and, in its last octant, a sheet of
// 23 voxels, which is a chunk of its own with N = 512.
Bytes worked_example_file() {
    constexpr int kDepth = 5;
    constexpr std::uint32_t kSheet = 24; // smallest x, y and z of the sheet
    std::vector<MortonCode> codes;
    for (std::uint32_t x = 0; x < 16; x += 2)
        for (std::uint32_t y = 0; y < 16; y += 2) {
            for (std::uint32_t z = 0; z < 10; z += 2)
                codes.push_back(morton_encode(x, y, z));
            for (std::uint32_t z = 16; z < 24; ++z)
                codes.push_back(morton_encode(16 + x, 16 + y, z));
        }
    for (std::uint32_t x = 0; x < 8; ++x)
        for (std::uint32_t y = 0; y < (x < 7 ? 3U : 2U); ++y)
            codes.push_back(morton_encode(kSheet + x, kSheet + y, kSheet + 2));
    std::sort(codes.begin(), codes.end());
    Model model = model_of(kDepth, {.colour = ColourFormat::rgb888});
    PointAttributes points;
    points.resize(codes.size(), model.parameters.attributes);
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const auto [x, y, z] = morton_decode(codes[i]);
        points.radii[i] = kMaxFinestRadius;
        const bool of_sheet = std::min({x, y, z}) >= kSheet;
        const int u = static_cast<int>(x) - 28, v = static_cast<int>(y) - 25;
        points.normals[i] = of_sheet ? quantise_normal(2 * u + 1, 3 * v - u, 30) : quantise_normal(0, 0, 1);
        set_point_colour(points, i, ColourFormat::rgb888,
                         of_sheet ? Rgb8{static_cast<std::uint8_t>(180 + 3 * u), static_cast<std::uint8_t>(120 + 4 * v),
                                         static_cast<std::uint8_t>(90 + 2 * u - v)}
                                  : Rgb8{128, 128, 128});
        if (of_sheet && u == 2 && v == 0) { // one point with other normal and colour
            points.normals[i] = quantise_normal(30, -2, 6);
            set_point_colour(points, i, ColourFormat::rgb888, {250, 60, 40});
        }
    }
    set_levels(model, std::move(codes), std::move(points), 1);
    return value_of(encode_model(model, {.compression_level = 19, .chunk_points = kMinChunkPoints, .threads = 1}));
}

} // namespace

std::vector<ValidFile> valid_small_files() {
    return {{"closed.pbvg", closed_file(Storage::packed)},
            {"closed-mapped.pbvg", closed_file(Storage::mapped)},
            {"depth-16.pbvg", deepest_file()},
            {"frame-checksum.pbvg", checksum_file()},
            {"shapes.pbvg", shapes_file(Storage::packed)},
            {"shapes-mapped.pbvg", shapes_file(Storage::mapped)},
            {"tints.pbvg", tints_file(Storage::packed)},
            {"tints-mapped.pbvg", tints_file(Storage::mapped)},
            {"unknown-extras.pbvg", unknown_extras_file()},
            {"worked-example.pbvg", worked_example_file()}};
}

void add_small_files(Collection &files) {
    FileEditor damaged(unknown_extras_file()); // repairs no hash; no other hash covers the section
    damaged.flip(std::uint64_t{8} * damaged.section(SectionType{kUnknownType}));
    files.add_as_is("3.2.14-unknown-section", damaged.bytes());
    const Bytes shapes = shapes_file(Storage::packed);
    files.add("18.1.1-critical", shapes, set_entry<std::uint16_t>(SectionType::shapes, 0, 6, 1));
    files.add("18.2.1-too-short", shapes, shorten(SectionType::shapes, 8, 8));
    files.add("5.6.3-checksum", checksum_file(), [](FileEditor &file) { file.flip(8 * file.bytes().size() - 1); });
}

} // namespace pbm::test
