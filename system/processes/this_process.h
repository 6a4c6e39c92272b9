// Settings of the program's own process: signals, heap, memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace pbm {

// Makes failed writes return errors instead of raising SIGPIPE or SIGXFSZ. Also makes the use of a standard stream that
// the caller has closed an error. Call first in `main`.
void make_write_errors_returns();

// If another process truncates a mapped file, the program ends with a line on standard error, which names the file if
// /proc is there, and exit code 2 instead of SIGBUS. Call first in `main`.
void end_when_mapped_file_shrinks(std::string_view program);

// From now on such a program goes on instead, and reads zeros where the file was: for a window, which notices what
// became of its file by a FileStamp.
void read_zeros_when_mapped_file_shrinks();

// Lets the heap grow at once and in pages of 2 MB, if C library and kernel support that: touching a small page for the
// first time takes a microsecond. For programs that soon use some 10 MB and then end. Call before they are allocated.
// Returns the address space of these pages, which the heap uses from its start; empty without support, or if the
// address space is limited.
std::span<std::byte> use_large_pages();

// Allocates pages before they are touched, so that another thread need not wait for the kernel to clear them.
void populate(std::span<std::byte> pages);

// Gives the calling thread the lowest priority for good, for work that nobody waits for.
void lower_priority();

// The limit of this process' address space, bytes (ulimit -v); absent if there is none.
std::optional<std::uint64_t> address_space_limit();

// Largest resident memory of this process so far, bytes.
std::uint64_t peak_memory();

} // namespace pbm
