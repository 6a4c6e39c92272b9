// Verdicts on files, and random damage.
#pragma once

#include "unit/support/file_editor.h"
#include "unit/support/test_models.h"

#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/load_model.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <set>

namespace pbm::test {

// Whether load_model may accept the file despite `error`: the rule is for validators only (BVG.md 8.3), or the tile
// belongs to a mip level that is not loaded.
inline bool is_unread(const Error &error) {
    const std::set<std::string_view> rules{"3.2.12", "3.2.14", "3.10.13", "3.10.14", "5.2",
                                           "7.1",    "8.1",    "17.1.2",  "17.3.1",  "17.6.1"};
    return rules.contains(error.rule) || error.tile >= 0;
}

// Expects that a changed byte of the stream's sections of a level is found by the validator, and by whoever loads the
// model.
inline void expect_changes_are_found(const Bytes &file, PointStream kind, int level) {
    const Reader reader = value_of(Reader::open(file));
    for (const SectionType type : {SectionType::stream_directory, SectionType::stream_values}) {
        const SectionEntry *section = reader.section(type, instance_of(kind, level));
        const std::uint64_t step = 1 + section->stored_bytes / 40;
        for (std::uint64_t at = 0; at < section->stored_bytes; at += step) {
            Bytes damaged = file;
            damaged[section->offset + at] ^= 0x10;
            ASSERT_FALSE(validate(damaged).valid()) << to_string(type) << " " << at;
            Result<Reader> other = Reader::open(damaged);
            EXPECT_FALSE(other && load_model(*other)) << to_string(type) << " " << at;
        }
    }
}

// Opens and loads the file without the checks that only `verify` makes.
inline Status load_everything(ByteView file) {
    Result<Reader> reader = Reader::open(file);
    const Result<Model> model = reader ? load_model(*reader, {.threads = 1, .fields = true}) : reader.error();
    return model ? Status() : Status(model.error());
}

// Returns the result of `verify`. Reader and load_model must agree with it, except on errors in parts that they need
// not read.
inline Status read_everything(ByteView file) {
    Status status = verify(file, {.threads = 1});
    const Status loaded = load_everything(file);
    EXPECT_TRUE(loaded ? status.ok() || is_unread(status.error()) : !status.ok())
        << (loaded ? status : loaded).error().message;
    return status;
}

// Each round flips one to three bits of a copy of `good`, at or after byte first_byte(round), and repairs all hashes.
// `verify` and `validate` must agree. Returns the number of refused copies.
template <class FirstByte> int count_refused(const Bytes &good, int rounds, FirstByte &&first_byte) {
    Random random(17);
    int refused = 0;
    for (int round = 0; round < rounds; ++round) {
        FileEditor editor(good);
        const std::size_t start = first_byte(round);
        for (std::uint64_t flips = 1 + random.below(3); flips > 0; --flips)
            editor.flip(8 * start + random.below(8 * (good.size() - start)));
        editor.repair();
        const Bytes &file = editor.bytes();
        const Status status = read_everything(file);
        EXPECT_EQ(status.ok(), validate(file, {.threads = 1}).valid())
            << "round " << round << ": " << (status ? "valid" : status.error().message);
        refused += status ? 0 : 1;
    }
    return refused;
}

} // namespace pbm::test
