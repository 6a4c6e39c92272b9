// For programs whose data may be larger than the memory: large blocks of the heap lie in a temporary file, whose pages
// the system writes out and reads back. A program that links this library has its operator new.
#pragma once

#include "system/error.h"

#include <cstddef>
#include <cstdint>
#include <string>

namespace pbm {

// From now on blocks of 16 KiB and more that together exceed 40 % of `limit` lie in a file of `folder` that has no
// name: it is gone with the process, however it ends. When more than 60 % of `limit` are resident, pages of these
// blocks, and then of files that are read, are given back to the system's cache of files: it writes them when it needs
// the memory, and a page that is used again before costs no reading. `limit` is first reduced by 256 MiB, but to no
// less than its half, since a thread looks at the memory every two milliseconds, or as soon as it gets a processor. A
// child process (child_process.h) shares the blocks that there are: it must not write to them. It allocates none.
//
// errors  io  the folder takes no file without a name
Status page_heap(const std::string &folder, std::uint64_t limit);

// Why an allocation failed: the message of a program that ends with std::bad_alloc.
//
// errors  memory  the folder had no room for a block; the text names the folder
Status paged_heap_room();

} // namespace pbm
