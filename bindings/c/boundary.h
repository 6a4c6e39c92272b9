// The border between C and C++: errors, structures that carry their size, handles, callbacks.
#pragma once

#include "pbm.h"

#include "system/bytes.h"
#include "system/error.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace pbm::c_api {

// The error with the name of its file in front.
inline Error of_file(const char *path, Error error) {
    error.message = std::string(path) + ": " + error.message;
    return error;
}

// Thrown where a call cannot go on before bytes arrive; nothing below catches it.
struct Pending {
    FileRange range; // one of those that are missing
};

// Fills `error`, which may be null, and returns its code.
pbm_code succeed(pbm_error *error) noexcept;
pbm_code fail(pbm_error *error, const Error &what) noexcept;

// Of the exception that is being handled.
pbm_code fail_with_exception(pbm_error *error) noexcept;

// Calls `work`, which returns a Status. No exception leaves.
template <class Work> pbm_code guarded(pbm_error *error, const Work &work) noexcept {
    try {
        const Status status = work();
        return status ? succeed(error) : fail(error, status.error());
    } catch (...) {
        return fail_with_exception(error);
    }
}

// Copies a structure of the caller. `since`: bytes that it had in version 1.0.
//
// errors  usage  null, not initialised by PBM_NEW, or of a later version
template <class Structure>
Result<Structure> read_structure(const Structure *given, const char *name, std::size_t since = sizeof(Structure)) {
    if (given == nullptr)
        return usage_error(std::string(name) + " is null");
    const std::size_t size = given->struct_size;
    if (size < since)
        return usage_error(std::string(name) + ".struct_size is " + std::to_string(size) +
                           "; initialise it with PBM_NEW");
    if (size > sizeof(Structure))
        return usage_error(std::string(name) + " is of a later version of pbm.h than this library");
    Structure copy{};
    std::memcpy(static_cast<void *>(&copy), given, size);
    return copy;
}

// Fills a structure of the caller, which may be of an earlier version.
template <class Structure, class Fill> Status fill_structure(Structure *structure, const char *name, const Fill &fill) {
    Result<Structure> copy = read_structure(structure, name);
    if (!copy)
        return copy.error();
    if (Status filled = fill(*copy); !filled)
        return filled;
    std::memcpy(static_cast<void *>(structure), &*copy, copy->struct_size);
    return {};
}

// Errors of a number of threads.
Status check_threads(std::int32_t threads);

// While it lives, this thread is in a callback of a call with `handle`.
class CallbackScope {
  public:
    explicit CallbackScope(const void *handle);
    ~CallbackScope();
    CallbackScope(const CallbackScope &) = delete;
    CallbackScope &operator=(const CallbackScope &) = delete;

    static bool is_inside(const void *handle);

  private:
    const void *handle_;
    const CallbackScope *outer_;
};

// A number that no handle of the process had before.
std::uintptr_t next_handle();

// The open objects of one kind. A handle is a number that is used once, so that closed handles and pointers to anything
// else are told from open ones.
template <class Handle, class Object> class Handles {
  public:
    Handle *add(std::unique_ptr<Object> object) {
        auto entry = std::make_shared<Entry>();
        entry->object = std::move(object);
        const std::uintptr_t number = next_handle();
        const std::lock_guard lock(mutex_);
        entries_.emplace(number, std::move(entry));
        return reinterpret_cast<Handle *>(number); // NOLINT(performance-no-int-to-ptr): never dereferenced
    }

    // Calls `work(object)`, which returns a Status, while no other thread uses the object.
    template <class Work> Status use(Handle *handle, const char *name, const Work &work) {
        auto entry = find(handle, name);
        if (!entry)
            return entry.error();
        const std::lock_guard lock((*entry)->mutex);
        if ((*entry)->object == nullptr)
            return closed(name);
        return work(*(*entry)->object);
    }

    // Calls `work(object)` without waiting for threads that use the object.
    template <class Work> Status notify(Handle *handle, const char *name, const Work &work) {
        const std::lock_guard lock(mutex_); // remove() waits for it before it destroys the object
        const auto found = entries_.find(reinterpret_cast<std::uintptr_t>(handle));
        if (found == entries_.end())
            return closed(name);
        work(*found->second->object);
        return {};
    }

    // Null does nothing.
    Status remove(Handle *handle, const char *name) {
        if (handle == nullptr)
            return {};
        auto entry = find(handle, name);
        if (!entry)
            return entry.error();
        {
            const std::lock_guard lock(mutex_);
            entries_.erase(reinterpret_cast<std::uintptr_t>(handle));
        }
        const std::lock_guard lock((*entry)->mutex);
        (*entry)->object.reset();
        return {};
    }

  private:
    struct Entry {
        std::mutex mutex; // guards the object
        std::unique_ptr<Object> object;
    };

    static Error closed(const char *name) {
        return usage_error(std::string(name) + " is no open handle: it was closed, or is something else");
    }

    Result<std::shared_ptr<Entry>> find(Handle *handle, const char *name) {
        if (handle == nullptr)
            return usage_error(std::string(name) + " is null");
        if (CallbackScope::is_inside(handle))
            return usage_error(std::string(name) + ": a callback may not call with the handle that it serves");
        const std::lock_guard lock(mutex_);
        const auto found = entries_.find(reinterpret_cast<std::uintptr_t>(handle));
        if (found == entries_.end())
            return closed(name);
        return found->second;
    }

    std::mutex mutex_; // guards the entries
    std::map<std::uintptr_t, std::shared_ptr<Entry>> entries_;
};

} // namespace pbm::c_api
