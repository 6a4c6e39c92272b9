// Replaces malloc of the C library for the program and its libraries.
#include "allocation_count.h"

#include <cerrno>
#include <cstddef>
#include <cstring>

#include <malloc.h>

// glibc's names of the functions behind malloc.
extern "C" {
void *__libc_malloc(std::size_t size);                          // NOLINT(bugprone-reserved-identifier)
void *__libc_memalign(std::size_t alignment, std::size_t size); // NOLINT(bugprone-reserved-identifier)
void *__libc_realloc(void *block, std::size_t size);            // NOLINT(bugprone-reserved-identifier)
void __libc_free(void *block);                                  // NOLINT(bugprone-reserved-identifier)
}

namespace pbm::faults {
namespace {

void *counted(void *block) {
    if (block != nullptr)
        count.took(::malloc_usable_size(block));
    return block;
}

void *refused() {
    errno = ENOMEM;
    return nullptr;
}

} // namespace

bool reuses_memory() { return true; }

} // namespace pbm::faults

using namespace pbm::faults;

extern "C" {

void *malloc(std::size_t size) { return count.allow() ? counted(__libc_malloc(size)) : refused(); }

void free(void *block) {
    if (block != nullptr)
        count.gave(::malloc_usable_size(block));
    __libc_free(block);
}

void *calloc(std::size_t number, std::size_t size) {
    std::size_t bytes = 0;
    if (__builtin_mul_overflow(number, size, &bytes) || !count.allow())
        return refused();
    void *block = counted(__libc_malloc(bytes));
    return block == nullptr ? nullptr : std::memset(block, 0, bytes);
}

void *realloc(void *block, std::size_t size) {
    if (!count.allow())
        return refused();
    const std::size_t before = block == nullptr ? 0 : ::malloc_usable_size(block);
    void *const moved = __libc_realloc(block, size);
    if (moved != nullptr || size == 0)
        count.gave(before);
    return counted(moved);
}

void *memalign(std::size_t alignment, std::size_t size) {
    return count.allow() ? counted(__libc_memalign(alignment, size)) : refused();
}
void *aligned_alloc(std::size_t alignment, std::size_t size) { return ::memalign(alignment, size); }
int posix_memalign(void **block, std::size_t alignment, std::size_t size) {
    *block = ::memalign(alignment, size);
    return *block == nullptr ? ENOMEM : 0;
}

} // extern "C"
