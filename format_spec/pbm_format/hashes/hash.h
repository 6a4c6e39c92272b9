// XXH3 hashes, which detect changed bytes. BVG.md 1.3
#pragma once

#include "system/bytes.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace pbm {

// XXH3, 64 bits, seed 0.
[[gnu::pure]] std::uint64_t hash64(ByteView bytes);

// XXH3, 128 bits, low half first.
using Hash128 = std::array<std::uint64_t, 2>;

// 32 hexadecimal digits, high half first.
std::string hexadecimal(const Hash128 &hash);

// XXH3-128 of bytes in pieces; the result does not depend on how they are split.
class StreamingHash {
  public:
    StreamingHash();
    StreamingHash(const StreamingHash &) = delete;
    StreamingHash &operator=(const StreamingHash &) = delete;
    ~StreamingHash();

    void add(ByteView bytes);
    Hash128 finish() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace pbm
