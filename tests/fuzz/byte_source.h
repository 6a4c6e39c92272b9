// The bytes of a fuzz input in order. After the last byte it starts again, so that a short input can fill a large
// chunk.
#pragma once

#include "system/bytes.h"

namespace pbm::test {

class ByteSource {
  public:
    // `bytes` must not be empty.
    explicit ByteSource(ByteView bytes) : bytes_(bytes) {}

    std::uint8_t next() {
        const std::uint8_t byte = bytes_[at_];
        at_ = at_ + 1 < bytes_.size() ? at_ + 1 : 0;
        return byte;
    }
    std::size_t below(std::size_t limit) {
        const std::size_t low = next();
        return (low | std::size_t{next()} << 8) % limit;
    }
    // An allocation of exactly this size: a sanitizer sees any access beyond.
    Bytes bytes(std::size_t size) {
        Bytes result(size);
        for (std::uint8_t &byte : result)
            byte = next();
        return result;
    }

  private:
    ByteView bytes_;
    std::size_t at_ = 0;
};

} // namespace pbm::test
