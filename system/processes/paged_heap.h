// For programs whose data may be larger than the memory: large blocks of the heap lie in temporary files, whose pages
// the system writes out and reads back. A program that links this has its operator new.
#pragma once

#include "system/error.h"

#include <cstddef>
#include <cstdint>
#include <string>

namespace pbm {

// From now on blocks of 16 KiB and more that together exceed 45 % of `limit` lie in a file of `folder` that has no name:
// it is gone with the process, however it ends. When more than 65 % of `limit` are resident, pages of these blocks are
// written out, and those of files that are read are dropped. Above 75 %, a signal (SIGRTMIN + 5) holds all other threads
// up until 70 % are resident, so that nothing can fill memory faster than a disk takes it. A child process
// (child_process.h) shares the blocks that there are: it must not write to them. It allocates none.
//
// errors  io  the folder takes no file without a name
Status page_heap(const std::string &folder, std::uint64_t limit);

} // namespace pbm
