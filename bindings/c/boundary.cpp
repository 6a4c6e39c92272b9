#include "boundary.h"

#include "system/threads/cancellation.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <new>
#include <stdexcept>
#include <string_view>

namespace pbm::c_api {
namespace {

constexpr std::int32_t kMaxThreadsAsked = 1024; // as on the command line

thread_local const CallbackScope *innermost = nullptr;

// Copies a text, cut between two characters of UTF-8 where it does not fit.
template <std::size_t Size> void copy_text(std::string_view from, char (&to)[Size]) noexcept {
    std::size_t length = std::min(from.size(), Size - 1);
    while (length < from.size() && length > 0 && (static_cast<unsigned char>(from[length]) & 0xC0U) == 0x80U)
        --length;
    std::copy_n(from.data(), length, to);
    to[length] = 0;
}

pbm_code fill(pbm_error *error, pbm_code code, std::uint64_t offset, std::string_view name, std::string_view rule,
              std::string_view message) noexcept {
    if (error == nullptr)
        return code;
    error->code = code;
    error->offset = offset;
    copy_text(name, error->name);
    copy_text(rule, error->rule);
    copy_text(message, error->message);
    return code;
}

} // namespace

pbm_code succeed(pbm_error *error) noexcept { return fill(error, PBM_OK, PBM_NO_OFFSET, "", "", ""); }

pbm_code fail(pbm_error *error, const Error &what) noexcept {
    return fill(error, static_cast<pbm_code>(exit_code(what.code)), has_offset(what) ? what.offset : PBM_NO_OFFSET,
                what.name, what.rule, what.message);
}

pbm_code fail_with_exception(pbm_error *error) noexcept {
    constexpr auto kOutOfMemory = "out of memory";
    try {
        throw;
    } catch (const Cancelled &) {
        return fill(error, PBM_CANCELLED, PBM_NO_OFFSET, "", "", "cancelled by a callback or another thread");
    } catch (const Pending &pending) {
        return fill(error, PBM_PENDING, pending.range.offset, "", "",
                    "bytes of the file have not arrived yet: call again");
    } catch (const std::bad_alloc &) {
        return fill(error, PBM_LIMIT, PBM_NO_OFFSET, "system.memory", "", kOutOfMemory);
    } catch (const std::length_error &) { // of a container that cannot become so large
        return fill(error, PBM_LIMIT, PBM_NO_OFFSET, "system.memory", "", kOutOfMemory);
    } catch (const std::exception &other) {
        return fill(error, PBM_LIMIT, PBM_NO_OFFSET, "", "", other.what());
    } catch (...) { // of a callback in C++
        return fill(error, PBM_USAGE, PBM_NO_OFFSET, "", "", "an exception was thrown through the library");
    }
}

Status check_threads(std::int32_t threads) {
    if (threads >= 0 && threads <= kMaxThreadsAsked)
        return {};
    return usage_error("threads is " + std::to_string(threads) + ", not 0 .. " + std::to_string(kMaxThreadsAsked));
}

CallbackScope::CallbackScope(const void *handle) : handle_(handle), outer_(std::exchange(innermost, this)) {}
CallbackScope::~CallbackScope() { innermost = outer_; }

bool CallbackScope::is_inside(const void *handle) {
    for (const CallbackScope *scope = innermost; scope != nullptr; scope = scope->outer_)
        if (scope->handle_ == handle)
            return true;
    return false;
}

std::uintptr_t next_handle() {
    constexpr std::uintptr_t kFirst = 0x1001, kStep = 16; // odd: no address of an object
    static std::atomic<std::uintptr_t> next{kFirst};
    return next.fetch_add(kStep);
}

} // namespace pbm::c_api

const char *pbm_version() { return PBM_VERSION; }
