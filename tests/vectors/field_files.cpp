// Files with fields. BVG.md 17
#include "collection.h"
#include "unit/support/test_models.h"

#include "pbm_format/container/field_sections.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

#include <algorithm>

namespace pbm::test {

namespace {

using enum SectionType;

constexpr std::uint32_t kFieldDepth = 5;

Model model_with_fields() {
    Model model = sphere_model(kFieldDepth, {}, 0.3);
    add_fields(model);
    return model;
}

Bytes encode_fields_file(const Model &model, Storage storage = Storage::packed) {
    return value_of(encode_model(
        model, {.storage = storage, .compression_level = 19, .chunk_points = kMinChunkPoints, .threads = 1}));
}

const Bytes &fields_file() {
    static const Bytes file = encode_fields_file(model_with_fields());
    return file;
}

// Offset of a record's byte within the section.
constexpr std::size_t in_record(std::size_t field, std::size_t at) {
    return kFieldsIdBytes + field * kFieldRecordBytes + at;
}

// Sets the size in the entry of the first chunk of a level.
Collection::Edit set_size(std::uint32_t level, std::size_t field, std::uint32_t size) {
    return [=](FileEditor &file) {
        file.set<std::uint32_t>(file.section(field_directory, level) + kFieldEntryBytes * field + 8, size);
    };
}

// A full cube of 32,768 voxels, which is one chunk, with a field of two bytes. Its values take one stored byte.
Bytes implausible_file() {
    Model model;
    model.metadata = "{}";
    model.parameters.grid.depth = kFieldDepth;
    model.parameters.materials.resize(1);
    model.parameters.fields = {{.name = "height", .unit = "m", .bytes = 2}};
    model.levels.resize(kFieldDepth + 1);
    std::size_t points = 1;
    for (std::uint32_t level = 1; level <= kFieldDepth; ++level, points *= 8)
        model.levels[level].masks.assign(points, 0xFF);
    Level &finest = model.levels.back();
    finest.points.normals.assign(points, 0);
    finest.points.radii.assign(points, 190);
    finest.fields = {Bytes(2 * points, 7)};
    average_levels(model, 1);
    FileEditor editor(value_of(encode_model(model, {.compression_level = 19, .threads = 1})));
    editor.set<std::uint32_t>(editor.section(field_directory, kFieldDepth) + 8, 1U << 31 | 1U);
    editor.repair();
    return editor.bytes();
}

Bytes with_wrong_average(std::size_t level) {
    Model model = model_with_fields();
    Bytes &column = model.levels[level].fields[1];
    column[0] ^= 1;
    return encode_fields_file(model);
}

} // namespace

std::vector<ValidFile> valid_field_files() {
    Model tiny = sphere_model(2, {}, 0.3);
    add_fields(tiny);
    return {{"fields.pbvg", fields_file()},
            {"fields-mapped.pbvg", encode_fields_file(model_with_fields(), Storage::mapped)},
            {"fields-tiny.pbvg", encode_fields_file(tiny)}};
}

void add_field_files(Collection &files) {
    const auto add = [&](const std::string &name, const Collection::Edit &edit) {
        files.add(name, fields_file(), edit);
    };
    add("17.1.1-no-values", set_entry<std::uint32_t>(field_values, kFieldDepth, 0, 250));
    add("17.1.2-not-announced", set<std::uint64_t>(48, 0));
    add("17.1.3-critical", set_entry<std::uint16_t>(field_directory, 2, 6, 1));
    add("17.2.1-no-whole-record", shorten(fields, 8, 8));
    add("17.2.2-no-name", set_in<std::uint8_t>(fields, in_record(0, 0), 0));
    add("17.2.2-name-twice", [](FileEditor &file) {
        const std::size_t at = file.section(fields);
        std::copy_n(&file.bytes()[at + in_record(0, 0)], kMaxFieldName, &file.bytes()[at + in_record(2, 0)]);
    });
    add("17.2.2-control-character", set_in<std::uint8_t>(fields, in_record(1, 0), 9));
    add("17.2.2-unit-not-utf-8", set_in<std::uint8_t>(fields, in_record(1, 32), 0xFF));
    add("17.2.2-bytes-behind-the-unit", set_in<std::uint8_t>(fields, in_record(0, 47), 'm'));
    add("17.2.3-scale-0", set_in<double>(fields, in_record(0, 56), 0));
    add("17.2.3-largest-value", set_in<double>(fields, in_record(0, 56), 1e307));
    add("17.2.4-three-bytes", set_in<std::uint8_t>(fields, in_record(0, 64), 3));
    add("17.2.4-average", set_in<std::uint8_t>(fields, in_record(0, 65), 3));
    add("17.2.5-root", set_in<std::uint16_t>(fields, in_record(0, 66), 256));
    add("17.2.6-reserved", set_in<std::uint8_t>(fields, in_record(2, 95), 1));
    files.add_as_is("17.3.1-no-average", with_wrong_average(3));
    files.add_as_is("17.3.1-no-average-of-all", with_wrong_average(0));
    add("17.4.1-too-short",
        [](FileEditor &file) { file.shorten(field_directory, kFieldDepth, 72, 3 * kFieldEntryBytes); });
    add("17.4.2-filter", set_size(1, 0, 6U << 24 | 8U));
    add("17.4.3-raw-size", set_size(1, 1, 15));
    files.add_as_is("17.4.4-values-from-one-byte", implausible_file());
    add("17.4.5-count", set_entry<std::uint64_t>(field_values, 1, 48, 9));
    FileEditor damaged(fields_file());
    damaged.flip(std::uint64_t{8} * damaged.section(field_values, kFieldDepth)); // repairs no hash of a chunk
    damaged.repair(false);
    files.add_as_is("17.5.1-flipped-bit", damaged.bytes());
    add("17.6.1-fields-id", set_in<std::uint64_t>(fields, 0, 0));
}

} // namespace pbm::test
