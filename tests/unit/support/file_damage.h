// What is wrong with files, and what damage does to them.
#pragma once

#include "unit/support/file_editor.h"
#include "unit/support/test_models.h"

#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/reader.h"

#include <gtest/gtest.h>

namespace pbm::test {

// First thing that is wrong with `file`, by the reader's reading.
inline Status read_everything(ByteView file) {
    Result<Reader> reader = Reader::open(file);
    return reader ? reader->verify_all(1) : Status(reader.error());
}

// Flips one to three bits of a copy of `good`, from byte first_byte(round) on, and repairs all hashes, again and again;
// reader and validator must agree on each. Returns how many copies they refused.
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
