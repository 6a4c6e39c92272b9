// Replaces only operator new and delete.
#include "allocation_count.h"

#include <cstddef>
#include <cstdlib>
#include <new>

#include <malloc.h>

namespace pbm::faults {
namespace {

void *take(std::size_t size, std::size_t alignment) {
    if (!count.allow())
        return nullptr;
    void *const block = alignment > alignof(std::max_align_t) ? ::memalign(alignment, size) : std::malloc(size);
    if (block != nullptr)
        count.took(::malloc_usable_size(block));
    return block;
}

void *take_or_throw(std::size_t size, std::size_t alignment) {
    void *const block = take(size, alignment);
    if (block == nullptr)
        throw std::bad_alloc();
    return block;
}

void give(void *block) {
    if (block != nullptr)
        count.gave(::malloc_usable_size(block));
    std::free(block);
}

} // namespace

bool reuses_memory() { return false; }

} // namespace pbm::faults

using namespace pbm::faults;

void *operator new(std::size_t size) { return take_or_throw(size, 0); }
void *operator new[](std::size_t size) { return take_or_throw(size, 0); }
void *operator new(std::size_t size, std::align_val_t to) { return take_or_throw(size, static_cast<std::size_t>(to)); }
void *operator new[](std::size_t size, std::align_val_t to) {
    return take_or_throw(size, static_cast<std::size_t>(to));
}
void *operator new(std::size_t size, const std::nothrow_t &) noexcept { return take(size, 0); }
void *operator new[](std::size_t size, const std::nothrow_t &) noexcept { return take(size, 0); }
void operator delete(void *block) noexcept { give(block); }
void operator delete[](void *block) noexcept { give(block); }
void operator delete(void *block, std::size_t) noexcept { give(block); }
void operator delete[](void *block, std::size_t) noexcept { give(block); }
void operator delete(void *block, std::align_val_t) noexcept { give(block); }
void operator delete[](void *block, std::align_val_t) noexcept { give(block); }
void operator delete(void *block, std::size_t, std::align_val_t) noexcept { give(block); }
void operator delete[](void *block, std::size_t, std::align_val_t) noexcept { give(block); }
