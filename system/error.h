// Errors as values: the damage, its offset, and the broken rule of BVG.md.
//
// Damaged bytes give an `Error`; errors of callers give an `assert`. Functions that return a Result or a Status throw
// nothing; all others throw at most std::bad_alloc.
// Stability: stable.
#pragma once

#include <cassert>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

namespace pbm {

// Kinds of failure. The order is not part of any contract; the names (`to_string`) are. Damage of a .pbvg is
// `truncated` to `bad_content`.
enum class ErrorCode : std::uint8_t {
    usage,               // the call makes no sense
    io,                  // the operating system refused: open, read, write, rename
    not_bvg,             // another magic number
    truncated,           // bytes are missing
    bad_hash,            // a stored hash does not match
    bad_header,          // header fields contradict each other or the limits
    bad_table,           // section table: order, overlap, sizes, padding
    bad_section,         // a small section (grid, attributes, materials, lights, texture, metadata)
    bad_directory,       // chunk directory of a level
    bad_octree,          // child masks
    bad_attribute,       // attribute values out of range
    bad_image,           // a raster: shape, tile directory, tiles, mip levels
    bad_content,         // averages, counts or content_id contradict the data
    bad_input,           // a scan (PLY, OBJ, ...) is damaged or contradicts itself
    too_large,           // over a limit of BVG.md 10
    memory,              // an allocation failed or the budget is used up
    unsupported_version, // another version of the format
    unsupported_feature, // a required feature, codec or filter that this build does not know
};

std::string_view to_string(ErrorCode code);

// Whether the bytes of a .pbvg contradict themselves or are missing.
constexpr bool is_damage(ErrorCode code) { return code >= ErrorCode::truncated && code <= ErrorCode::bad_content; }

// Process exit code of a failure, the same for all programs: 1 usage, 2 I/O, 3 invalid or damaged input, 4 memory or
// another run-time limit, 5 unsupported version or feature.
int exit_code(ErrorCode code);

// What a check compared: a number, a hash, or text such as "1..8". May be empty.
class Value {
  public:
    struct Hash {
        std::uint64_t value;
    };
    using Held = std::variant<std::monostate, std::uint64_t, std::int64_t, double, std::string, Hash>;

    Value() = default;
    template <std::unsigned_integral Number> Value(Number number) : held_(std::uint64_t{number}) {}
    template <std::signed_integral Number> Value(Number number) : held_(std::int64_t{number}) {}
    template <std::floating_point Number> Value(Number number) {
        if (std::isfinite(number))
            held_ = double{number};
        else
            held_ = std::string(std::isnan(number) ? "nan" : number < 0 ? "-inf" : "inf"); // JSON has no such numbers
    }
    Value(Hash hash) : held_(hash) {}
    Value(std::string text) : held_(std::move(text)) {}
    Value(std::string_view text) : held_(std::string(text)) {}
    Value(const char *text) : held_(std::string(text)) {}

    bool empty() const { return held_.index() == 0; }
    const Held &held() const { return held_; }

  private:
    Held held_;
};
std::string to_string(const Value &value);
inline Value hash_value(std::uint64_t hash) { return Value::Hash{hash}; }

struct Error {
    ErrorCode code{};
    std::uint64_t offset = 0; // byte offset in the file; see has_offset
    std::string message{};    // one line; starts with the paragraph of BVG.md, if any ("4.2 ...")
    std::string_view name{};  // stable code of the fault, "octree.empty_mask", or empty; static storage
    std::string_view rule{};  // broken rule of BVG.md, "4.2", or empty
    Value expected{}, actual{};
    std::int64_t tile = -1; // number in its raster, or -1
};

inline Error usage_error(std::string message) { return {ErrorCode::usage, 0, std::move(message)}; }

// Whether `offset` has a meaning: always for damage of a .pbvg, even if it is 0; for other errors if it is not 0.
bool has_offset(const Error &error);

// For the places where std::bad_alloc becomes an error. Allocates nothing itself.
Error out_of_memory();

// A value or an `Error`. Test `ok()` (or bool) before calling `value()`.
template <class T> class [[nodiscard]] Result {
  public:
    Result(T value) : held_(std::in_place_index<0>, std::move(value)) {}
    Result(Error error) : held_(std::in_place_index<1>, std::move(error)) {}

    bool ok() const { return held_.index() == 0; }
    explicit operator bool() const { return ok(); }

    T &value() & { return assert(ok()), *std::get_if<0>(&held_); }
    const T &value() const & { return assert(ok()), *std::get_if<0>(&held_); }
    T &&value() && { return assert(ok()), std::move(*std::get_if<0>(&held_)); }
    T &operator*() & { return value(); }
    const T &operator*() const & { return value(); }
    T *operator->() { return &value(); }
    const T *operator->() const { return &value(); }

    Error &error() & { return assert(!ok()), *std::get_if<1>(&held_); }
    const Error &error() const & { return assert(!ok()), *std::get_if<1>(&held_); }
    Error &&error() && { return assert(!ok()), std::move(*std::get_if<1>(&held_)); }

  private:
    std::variant<T, Error> held_;
};

// Success without a value, or an `Error`.
class [[nodiscard]] Status {
  public:
    // As a default, it would fill the room of the error with zeros first.
    Status() {} // NOLINT(modernize-use-equals-default)
    Status(Error error) : error_(std::move(error)) {}

    bool ok() const { return !error_.has_value(); }
    explicit operator bool() const { return ok(); }
    Error &error() & { return assert(!ok()), *error_; }
    const Error &error() const & { return assert(!ok()), *error_; }
    Error &&error() && { return assert(!ok()), std::move(*error_); }

  private:
    std::optional<Error> error_;
};

} // namespace pbm
