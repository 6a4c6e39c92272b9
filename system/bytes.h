// Little-endian records: reading untrusted bytes, writing exact ones. BVG.md 1.
// Stability: stable.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

namespace pbm {

static_assert(std::endian::native == std::endian::little, "records are copied as they lie in the file");

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;

inline ByteView as_bytes(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()};
}

// Bytes `offset` to `offset + bytes - 1` of a file.
struct FileRange {
    std::uint64_t offset = 0, bytes = 0;
    bool operator==(const FileRange &) const = default;
};

// Clamps a budget of memory (bytes) to half of the machine's address space.
constexpr std::uint64_t addressable(std::uint64_t budget) {
    return std::min<std::uint64_t>(budget, std::numeric_limits<std::size_t>::max() / 2);
}

// Bytes `offset` to `offset + count - 1`. Offsets in files have 64 bits, addresses may have 32: this function is the
// one place that narrows them. A range outside `bytes` is an error of the caller; the result is then empty.
inline ByteView slice(ByteView bytes, std::uint64_t offset, std::uint64_t count) {
    const bool is_inside = offset <= bytes.size() && count <= bytes.size() - offset;
    assert(is_inside);
    return is_inside ? bytes.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(count)) : ByteView();
}

// The value whose bytes begin at `at`, at any alignment.
template <class T> T load(const std::uint8_t *at) {
    static_assert(std::is_trivially_copyable_v<T>);
    T value{};
    std::memcpy(&value, at, sizeof value);
    return value;
}

// Writes the bytes of `value` from `at` on, at any alignment.
template <class T> void store(std::uint8_t *at, const T &value) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::memcpy(at, &value, sizeof value);
}

// Reads fixed-width little-endian values one after the other. After the first read past the end every
// read returns zero and `ok()` is false: read a whole record, then test once.
class ByteReader {
  public:
    explicit ByteReader(ByteView bytes) : bytes_(bytes) {}

    template <class T> T read() {
        static_assert(std::is_arithmetic_v<T>);
        if (bytes_.size() - at_ < sizeof(T)) {
            ok_ = false;
            at_ = bytes_.size();
            return T{};
        }
        const T value = load<T>(bytes_.data() + at_);
        at_ += sizeof(T);
        return value;
    }
    std::uint8_t u8() { return read<std::uint8_t>(); }
    std::uint16_t u16() { return read<std::uint16_t>(); }
    std::int16_t i16() { return read<std::int16_t>(); }
    std::uint32_t u32() { return read<std::uint32_t>(); }
    std::uint64_t u64() { return read<std::uint64_t>(); }
    float f32() { return read<float>(); }
    double f64() { return read<double>(); }

    // Skips `count` reserved bytes and remembers the first nonzero one of all calls.
    void zeros(std::size_t count) {
        while (count-- > 0) {
            const std::uint8_t byte = u8();
            reserved_ = reserved_ == 0 ? byte : reserved_;
        }
    }

    bool ok() const { return ok_; }
    bool reserved_clear() const { return reserved_ == 0; }
    std::uint8_t reserved() const { return reserved_; } // 0 if all were zero
    std::size_t offset() const { return at_; }

  private:
    ByteView bytes_;
    std::size_t at_ = 0;
    bool ok_ = true;
    std::uint8_t reserved_ = 0;
};

// Appends fixed-width little-endian values.
class ByteWriter {
  public:
    template <class T> void write(T value) {
        static_assert(std::is_arithmetic_v<T>);
        const std::size_t at = bytes_.size();
        bytes_.resize(at + sizeof(T));
        std::memcpy(bytes_.data() + at, &value, sizeof(T));
    }
    void u8(std::uint8_t value) { write(value); }
    void u16(std::uint16_t value) { write(value); }
    void i16(std::int16_t value) { write(value); }
    void u32(std::uint32_t value) { write(value); }
    void u64(std::uint64_t value) { write(value); }
    void f32(float value) { write(value); }
    void f64(double value) { write(value); }
    void zeros(std::size_t count) { bytes_.resize(bytes_.size() + count); }
    void append(ByteView bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }

    std::size_t size() const { return bytes_.size(); }
    const Bytes &bytes() const { return bytes_; }
    Bytes take() { return std::move(bytes_); }

  private:
    Bytes bytes_;
};

} // namespace pbm
