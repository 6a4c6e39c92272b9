// Files with ground plane, its rasters and a panorama: BVG.md 3.9 to 3.11.
#include "collection.h"
#include "unit/support/test_models.h"

#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

#include <limits>

namespace pbm::test {

namespace {

Bytes encode(const Model &model, Storage storage) {
    return value_of(
        encode_model(model, {.storage = storage, .compression_level = 19, .chunk_points = 512, .threads = 1}));
}

// Every attribute, two lights with shadows, and a second material for the ground.
Model shaded_model(std::uint32_t panorama_height, std::uint32_t ground_edge) {
    Model model = sphere_model(2, every_attribute(ColourFormat::rgb888, 2), 0.3);
    add_surroundings(model, panorama_height, ground_edge);
    model.parameters.ground->material = 2;
    return model;
}

// Two tiles of level 0 in the panorama, one filtered and one of noise.
const Bytes &shaded_file() {
    static const Bytes file = encode(shaded_model(64, 64), Storage::packed);
    return file;
}

const Bytes &shaded_mapped_file() {
    static const Bytes file = encode(shaded_model(8, 16), Storage::mapped);
    return file;
}

// One texel high: a panorama of a single level.
const Bytes &tiny_file() {
    static const Bytes file = encode(shaded_model(1, 2), Storage::packed);
    return file;
}

// A ground plane without texture and lit fractions, below a model without materials; a panorama.
const Bytes &plain_ground_file() {
    static const Bytes file = [] {
        Model model = sphere_model(2, {.lights = 1, .shadow_bits = {{{1, 1, 1}}}}, 0.3);
        model.parameters.materials.resize(2);
        model.parameters.ground = {.centre = {1, 0, 1}, .half_edge = 2, .material = 1, .texture = {}};
        model.images.panorama = test_image(8, 4, 3);
        return encode(model, Storage::packed);
    }();
    return file;
}

using Edit = Collection::Edit;

// Sets a field of the header, or, `in_tile`, of the entry of tile `tile` of a raster.
template <class T> Edit set_raster(SectionType type, std::size_t field, T value) {
    return [=](FileEditor &file) { file.set<T>(file.section(type) + field, value); };
}
template <class T> Edit set_tile(SectionType type, std::size_t tile, std::size_t field, T value) {
    return set_raster<T>(type, 32 + 16 * tile + field, value);
}

// Removes the last bytes of the panorama, which ends the file.
Edit cut_panorama(std::uint64_t bytes) {
    return [=](FileEditor &file) {
        file.shorten(SectionType::panorama, 0, bytes, 1);
        file.set<std::uint32_t>(file.entry(SectionType::panorama) + 12, 0);
    };
}

// Flips a bit. Repairs the hashes of sections, table and header, but not those of chunks and tiles.
Bytes with_flipped_bit(Bytes file, std::size_t at) {
    FileEditor editor(std::move(file));
    editor.flip(8 * at);
    editor.repair(false);
    return editor.bytes();
}

void add_ground_files(Collection &files) {
    using enum SectionType;
    files.add("3.9.4-no-such-material", shaded_file(), set_in<std::uint8_t>(ground_plane, 16, 3));
    files.add("3.9.5-raster-without-texture", shaded_file(), shorten(ground_plane, 32, 800));
    files.add("3.9.6-lights-with-a-gap", shaded_file(), set_entry<std::uint32_t>(ground_lit, 1, 8, 2));
    files.add("3.11.1-short-ground-plane", shaded_file(), shorten(ground_plane, 824, 8));
    files.add("3.11.2-centre-is-nan", shaded_file(),
              set_in<float>(ground_plane, 8, std::numeric_limits<float>::quiet_NaN()));
    files.add("3.11.3-half-edge-0", shaded_file(), set_in<float>(ground_plane, 12, 0));
    files.add("3.11.4-reserved", shaded_file(), set_in<std::uint8_t>(ground_plane, 20, 1));
    files.add("3.8.3-turbulence-of-the-ground", shaded_file(), set_in<float>(ground_plane, 32 + 12, -1));
    files.add("3.2.7-light-8", shaded_file(), set_entry<std::uint32_t>(ground_lit, 1, 8, 8));
    files.add("3.2.16-alignment-of-a-raster", shaded_mapped_file(), set_entry<std::uint32_t>(panorama, 0, 16, 128));
}

void add_raster_files(Collection &files) {
    using enum SectionType;
    const auto section = [](const Bytes &file, SectionType type) { return FileEditor(file).section(type); };
    files.add("3.10.1-half-a-header", tiny_file(), cut_panorama(32 + 16 + 6 - 30));
    files.add("3.10.2-a-thousand-tiles", tiny_file(), set_raster<std::uint32_t>(panorama, 16, 1000));
    files.add_as_is("3.10.3-flipped-bit", with_flipped_bit(tiny_file(), section(tiny_file(), panorama) + 9));
    files.add("3.10.4-three-texels-wide", tiny_file(), set_raster<std::uint32_t>(panorama, 8, 3));
    files.add("3.10.4-four-channels", tiny_file(), set_raster<std::uint8_t>(panorama, 22, 4));
    files.add("3.10.4-higher-than-wide", tiny_file(), set_raster<std::uint32_t>(panorama, 12, 4));
    files.add("3.10.5-alignment-2", tiny_file(), set_raster<std::uint16_t>(panorama, 20, 2));
    files.add("3.10.6-reserved", tiny_file(), set_raster<std::uint8_t>(panorama, 25, 1));
    files.add("3.10.7-a-tile-less", shaded_file(), [](FileEditor &file) {
        const std::size_t at = file.section(panorama) + 16;
        file.set<std::uint32_t>(at, file.get<std::uint32_t>(at) - 1);
    });
    files.add("3.10.8-reserved", tiny_file(), set_tile<std::uint8_t>(panorama, 0, 12, 1));
    files.add("3.10.9-filter-8", tiny_file(), set_tile<std::uint8_t>(panorama, 0, 11, 8));
    files.add("3.10.10-stored-size", tiny_file(), set_tile<std::uint8_t>(panorama, 0, 8, 5));
    files.add("3.10.10-zstd-tile-in-a-mapped-file", shaded_mapped_file(),
              set_tile<std::uint32_t>(ground_texture, 0, 8, 1U << 31));
    files.add("3.10.11-past-the-end", shaded_file(), [](FileEditor &file) {
        const std::size_t at = file.section(panorama);
        const std::size_t last = at + 32 + 16 * (file.get<std::uint32_t>(at + 16) - std::size_t{2}) + 8; // filtered
        file.set<std::uint32_t>(last, file.get<std::uint32_t>(last) + 1);
    });
    files.add("3.10.11-a-byte-left", tiny_file(), [](FileEditor &file) {
        file.bytes().push_back(0);
        file.set<std::uint64_t>(16, file.bytes().size());
        for (const std::size_t field : {std::size_t{32}, std::size_t{40}}) {
            const std::size_t at = file.entry(panorama) + field;
            file.set<std::uint64_t>(at, file.get<std::uint64_t>(at) + 1);
        }
        file.set<std::uint64_t>(64, file.get<std::uint64_t>(64) + 1);
    });
    files.add_as_is("3.10.12-flipped-bit", with_flipped_bit(shaded_file(), shaded_file().size() - 1));
    // Tile 0 of the panorama has 2x1 texels, 6 bytes, and stands at the first multiple of 64.
    const auto tiles = [](FileEditor &file, SectionType type) {
        const std::size_t at = file.section(type);
        return align_stream(at + 32 + 16 * std::size_t{file.get<std::uint32_t>(at + 16)});
    };
    files.add("3.10.13-padding", shaded_mapped_file(),
              [=](FileEditor &file) { file.set<std::uint8_t>(tiles(file, panorama) + 6, 1); });
    files.add("3.10.14-no-mean", shaded_mapped_file(), [=](FileEditor &file) {
        const std::size_t at = tiles(file, ground_lit);
        file.set<std::uint8_t>(at, static_cast<std::uint8_t>(file.get<std::uint8_t>(at) ^ 1));
    });
    files.add("3.10.14-no-mean-in-linear-light", shaded_mapped_file(), [=](FileEditor &file) {
        const std::size_t at = tiles(file, panorama);
        file.set<std::uint8_t>(at, static_cast<std::uint8_t>(file.get<std::uint8_t>(at) ^ 1));
    });
    files.add("3.10.15-panorama-as-lit-fractions", plain_ground_file(),
              set_entry<std::uint32_t>(panorama, 0, 0, static_cast<std::uint32_t>(ground_lit)));
    files.add("3.10.16-count", shaded_file(), set_entry<std::uint64_t>(panorama, 0, 48, 7));
    files.add("8.1-panorama", tiny_file(), [](FileEditor &file) { file.flip(8 * file.bytes().size() - 8); });
}

} // namespace

std::vector<ValidFile> valid_surroundings_files() {
    return {{"shaded.pbvg", shaded_file()},
            {"shaded-mapped.pbvg", shaded_mapped_file()},
            {"shaded-tiny.pbvg", tiny_file()},
            {"plain-ground.pbvg", plain_ground_file()}};
}

void add_surroundings_files(Collection &files) {
    add_ground_files(files);
    add_raster_files(files);
}

} // namespace pbm::test
