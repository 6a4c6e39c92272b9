// Valid files, and the verdict on them after an edit: for tests of single checks.
#pragma once

#include "unit/support/file_damage.h"
#include "unit/support/file_editor.h"
#include "unit/support/test_models.h"

#include "pbm_format/container/section_encoder.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <functional>

namespace pbm::test {

using Edit = std::function<void(FileEditor &)>;
using enum SectionType;

inline const Bytes &rich_file() {
    static const Bytes file =
        value_of(encode_model(sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.3),
                              {.compression_level = 19, .filters = false, .chunk_points = 512, .threads = 1}));
    return file;
}

// Several chunks at levels 4 and 5.
inline const Bytes &chunks_file(Storage storage = Storage::packed) {
    static const Bytes packed = value_of(encode_model(sphere_model(5, {}), {.chunk_points = 512, .threads = 1}));
    static const Bytes mapped =
        value_of(encode_model(sphere_model(5, {}), {.storage = Storage::mapped, .chunk_points = 512, .threads = 1}));
    return storage == Storage::packed ? packed : mapped;
}

// A sphere without its last voxel: its number of points is not a multiple of 8, so the last shadow byte has spare bits.
inline Model incomplete_sphere() {
    Model model = sphere_model(3, every_attribute(ColourFormat::rgb888, 3), 0.3);
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = value_of(expand_level(codes, model.levels[level].masks, 512));
    codes.pop_back();
    const LevelMasks masks = encode_octree(codes, 3);
    for (std::size_t level = 0; level < masks.size(); ++level)
        model.levels[level].masks = masks[level];
    model.levels.back().points.resize(codes.size(), model.parameters.attributes);
    average_levels(model, 1);
    return model;
}

inline const Bytes &mapped_file() {
    static const Bytes file =
        value_of(encode_model(incomplete_sphere(), {.storage = Storage::mapped, .chunk_points = 512, .threads = 1}));
    return file;
}

// Edits `good`, repairs its hashes and returns the result of `verify`. `validate` and a reader must report the same
// code and offset.
inline Status verdict(const Bytes &good, const Edit &edit) {
    FileEditor editor(good);
    edit(editor);
    editor.repair();
    Status status = read_everything(editor.bytes());
    const ValidationReport report = validate(editor.bytes(), {.threads = 1});
    EXPECT_EQ(status.ok(), report.valid());
    if (!status && !report.valid()) {
        EXPECT_EQ(status.error().code, report.findings[0].code) << status.error().message;
        EXPECT_EQ(status.error().offset, report.findings[0].offset) << status.error().message;
    }
    if (const Status loaded = load_everything(editor.bytes()); !status && !loaded) {
        EXPECT_EQ(status.error().code, loaded.error().code) << loaded.error().message;
        EXPECT_EQ(status.error().offset, loaded.error().offset) << loaded.error().message;
    }
    return status;
}

// Expects the edited file to be refused with `code` at `offset`.
inline void expect_refusal(const Bytes &good, const Edit &edit, ErrorCode code, std::uint64_t offset) {
    const Status status = verdict(good, edit);
    ASSERT_FALSE(status) << to_string(code) << " at " << offset;
    EXPECT_EQ(status.error().code, code) << status.error().message;
    EXPECT_EQ(status.error().offset, offset) << status.error().message;
}

template <class T> Edit set(std::size_t at, T value) {
    return [=](FileEditor &file) { file.set<T>(at, value); };
}

inline Edit set_byte(std::size_t at, std::uint8_t value) { return set<std::uint8_t>(at, value); }

struct Directories {
    Reader reader;
    AttributeSet set;

    explicit Directories(const Bytes &file)
        : reader(value_of(Reader::open(file))), set(reader.parameters().attributes) {}
    const LevelDirectory &level(int number) { return *value_of(reader.directory(number)); }
    // Encodes a level's directory, changes one field of one entry and decodes it.
    template <class T> Result<LevelDirectory> decode(int number, std::size_t chunk, std::size_t field, T value) {
        Bytes bytes = encode_directory(level(number), set);
        std::memcpy(bytes.data() + chunk * chunk_entry_bytes(set) + field, &value, sizeof value);
        return decode_bytes(number, bytes);
    }
    Result<LevelDirectory> decode_bytes(int number, ByteView bytes) {
        return decode_directory(bytes, number, set, reader.header().chunk_points,
                                number == 1 ? nullptr : &level(number - 1),
                                *reader.section(level_chunks, static_cast<std::uint32_t>(number)));
    }
};

inline void expect_place(const Result<LevelDirectory> &decoded, std::uint64_t offset,
                         ErrorCode code = ErrorCode::bad_directory) {
    ASSERT_FALSE(decoded) << offset;
    EXPECT_EQ(decoded.error().code, code) << decoded.error().message;
    EXPECT_EQ(decoded.error().offset, offset) << decoded.error().message;
}

} // namespace pbm::test
