// Files whose points have sides or offsets. BVG.md 19
#include "collection.h"
#include "unit/support/test_models.h"

#include "pbm_format/container/point_streams.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

#include <algorithm>

namespace pbm::test {

namespace {

using enum SectionType;

constexpr std::uint32_t kSideDepth = 5;
constexpr std::uint32_t kOfLevel1 = instance_of(PointStream::sides, 1),
                        kOfFinest = instance_of(PointStream::sides, kSideDepth);

Model model_with_sides() {
    Model model = sphere_model(kSideDepth, every_attribute(ColourFormat::rgb888, kSideDepth), 0.3);
    add_sides(model);
    return model;
}

Bytes encode_sides_file(const Model &model, Storage storage) {
    return value_of(encode_model(
        model, {.storage = storage, .compression_level = 19, .chunk_points = kMinChunkPoints, .threads = 1}));
}

// Mapped: its values are raw, so that edits reach them.
const Bytes &sides_file() {
    static const Bytes file = encode_sides_file(model_with_sides(), Storage::mapped);
    return file;
}

Model model_with_offsets() {
    Model model = sphere_model(kSideDepth, {}, 0.3);
    add_offsets(model);
    return model;
}

const Bytes &offsets_file() {
    static const Bytes file = encode_sides_file(model_with_offsets(), Storage::mapped);
    return file;
}

// Sets a byte of the values of level 1, which has one chunk of 8 points: a mask, the normals, the rest.
Collection::Edit set_value(std::size_t at, std::uint8_t value) {
    return [=](FileEditor &file) { file.set<std::uint8_t>(file.section(stream_values, kOfLevel1) + at, value); };
}

Collection::Edit set_in_entry(std::size_t field, std::uint32_t value) {
    return [=](FileEditor &file) { file.set<std::uint32_t>(file.section(stream_directory, kOfLevel1) + field, value); };
}

// A packed file whose finest level is one chunk, the sides of which are said to take one stored byte.
Bytes swollen_file() {
    Model model = sphere_model(kSideDepth, {}, 0.45);
    add_sides(model);
    FileEditor editor(value_of(encode_model(model, {.threads = 1})));
    const std::size_t directory = editor.section(stream_directory, kOfFinest);
    editor.set<std::uint32_t>(directory + 8, 1U << 31 | 1U);
    editor.set<std::uint32_t>(directory + 12, 2 * kMaxExpansion);
    editor.repair();
    return editor.bytes();
}

} // namespace

std::vector<ValidFile> valid_side_files() {
    FileEditor unknown(sides_file()); // a kind that nobody knows: nothing of its directory and values is verified
    constexpr std::uint32_t kUnknown = 0x200 + 1; // kind 2 has no meaning
    for (const SectionType type : {stream_directory, stream_values})
        for (std::uint32_t level = 1; level <= kSideDepth; ++level)
            unknown.set<std::uint32_t>(unknown.entry(type, instance_of(PointStream::sides, static_cast<int>(level))) +
                                           8,
                                       kUnknown - 1 + level);
    unknown.set<std::uint32_t>(unknown.section(stream_directory, kUnknown) + 12, 1);
    unknown.repair();
    return {{"sides.pbvg", encode_sides_file(model_with_sides(), Storage::packed)},
            {"sides-mapped.pbvg", sides_file()},
            {"unknown-point-stream.pbvg", unknown.bytes()},
            {"offsets.pbvg", encode_sides_file(model_with_offsets(), Storage::packed)},
            {"offsets-mapped.pbvg", offsets_file()}};
}

void add_side_files(Collection &files) {
    const auto add = [&](const std::string &name, const Collection::Edit &edit) {
        files.add(name, sides_file(), edit);
    };
    add("3.2.7-kind-0-of-point-streams", set_entry<std::uint32_t>(stream_directory, kOfLevel1, 8, 1));
    add("19.1.1-critical", set_entry<std::uint16_t>(stream_values, kOfLevel1, 6, 1));
    add("19.1.2-no-values", set_entry<std::uint32_t>(stream_values, kOfFinest, 0, 250));
    add("19.2.1-too-short", [](FileEditor &file) {
        file.shorten(stream_directory, kOfFinest, kPointStreamEntryBytes, kPointStreamEntryBytes);
    });
    add("19.2.2-filter", set_in_entry(8, 7U << 24));
    add("19.2.3-raw-size", set_in_entry(12, 0));
    files.add_as_is("19.2.4-sides-from-one-byte", swollen_file());
    add("19.2.5-count", set_entry<std::uint64_t>(stream_values, kOfLevel1, 48, 9));
    FileEditor damaged(sides_file());
    damaged.flip(std::uint64_t{8} * damaged.section(stream_values, kOfFinest));
    damaged.repair(false);
    files.add_as_is("19.3.1-flipped-bit", damaged.bytes());
    add("19.4.1-empty-mask", set_value(0, 0));
    add("19.4.1-other-size", set_value(0, 1));
    add("19.4.2-two-sided", set_value(2, 0x20));
    add("19.4.3-cone", [](FileEditor &file) {
        file.set<std::uint16_t>(file.chunk(1) + 36, 0x155); // along x: no normal is opposite
        file.set<std::int16_t>(file.chunk(1) + 38, -32766);
    });
    const auto add_offset = [&](const std::string &name, std::size_t at, std::uint8_t value) {
        files.add(name, offsets_file(), [=](FileEditor &file) {
            file.set<std::uint8_t>(file.section(stream_values, instance_of(PointStream::offsets, 1)) + at, value);
        });
    };
    add_offset("19.6.1-empty-mask", 0, 0);
    add_offset("19.6.1-other-size", 0, 1);
    add_offset("19.6.2-beyond-the-voxel", 1, 15);
    add_offset("19.6.2-below-the-voxel", 1, 0xF1);
}

} // namespace pbm::test
