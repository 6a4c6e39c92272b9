// For programs whose data may be larger than the memory: large blocks of the heap lie in temporary files, whose pages
// the system writes out and reads back. A program that links this has its operator new.
#pragma once

#include "system/error.h"

#include <cstddef>
#include <cstdint>
#include <string>

namespace pbm {

// From now on blocks of 16 KiB and more lie in files of `folder` that have no name: they are gone with the process,
// however it ends. When more than 85 % of `limit` are resident, pages of these blocks are written out, and those of
// files that are read are dropped. A child process (child_process.h) shares the blocks that there are: it must not
// write to them. It allocates none.
//
// errors  io  the folder takes no file without a name
Status page_heap(const std::string &folder, std::uint64_t limit);

} // namespace pbm
