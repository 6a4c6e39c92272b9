#pragma once

#include <vector>

namespace pbm {

// Empties a vector and frees its memory. `values = {}` keeps it: that assigns an empty list.
template <class T> void free_memory(std::vector<T> &values) { values = std::vector<T>(); }

} // namespace pbm
