// What a program asks of the operating system for itself: signals, heap, memory.
#pragma once

#include <cstdint>
#include <string_view>

namespace pbm {

// Signals that would end a program whose write fails (SIGPIPE, SIGXFSZ) become error returns, and so does the use of a
// standard stream that the caller has closed. Call first in `main`.
void make_write_errors_returns();

// A mapped file that another process makes shorter ends the program with a line on standard error and exit code 2
// instead of SIGBUS. Call first in `main`.
void end_when_mapped_file_shrinks(std::string_view program);

// Lets the heap of a program that soon fills some 10 MB and then ends grow at once and in pages of 2 MB, where C
// library and kernel can: touching a small page for the first time takes a microsecond. Call first in `main`.
void use_large_pages();

// Largest resident memory of this process so far, bytes.
std::uint64_t peak_memory();

} // namespace pbm
