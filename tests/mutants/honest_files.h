// Small whole files of every format and many dialects: what mutants are made of.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pbm::mutants {

enum class Format : std::uint8_t { ply_ascii, ply_binary, obj, off, stl_ascii, stl_binary };
constexpr int kFormats = 6;

const char *to_string(Format format);

struct HonestFile {
    std::string name;
    Format format{};
    std::string bytes;
};

// The same on every call.
std::vector<HonestFile> honest_files();

} // namespace pbm::mutants
