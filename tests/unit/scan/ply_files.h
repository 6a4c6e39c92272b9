// PLY files as strings, and the results of read_ply.
#pragma once

#include "pbm_scan/ply/ply_reader.h"
#include "unit/scan/readings.h"

#include <array>
#include <bit>
#include <cstring>

namespace pbm::test {

inline Result<build::Surface> read_ply_bytes(std::span<const std::uint8_t> bytes, const build::ReadOptions &options) {
    return build::read_ply({bytes}, options);
}
using PlyFile = Reading<read_ply_bytes>;

inline Result<build::Surface> read(const std::string &text, const build::ReadOptions &options = {}) {
    return read_ply_bytes(bytes_of(text), options);
}
inline build::Surface surface(const std::string &text) { return PlyFile::surface(text); }
inline Error error(const std::string &text, const build::ReadOptions &options = {}) {
    return PlyFile::error(text, options);
}

inline std::string replaced(std::string text, std::string_view from, std::string_view to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

// Appends `value` as a binary file holds it.
template <class T> void put(std::string &out, T value, bool big_endian) {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof value);
    const bool swap = big_endian == (std::endian::native == std::endian::little);
    for (std::size_t i = 0; i < bytes.size(); ++i)
        out += bytes[swap ? bytes.size() - 1 - i : i];
}

inline const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";

inline const std::string kTriangle = "ply\nformat ascii 1.0\nelement vertex 3\n" + kXyz +
                                     "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                     "0 0 0\n1 0 0\n0 1.5 -2e-1\n3 0 1 2\n";

// Two triangles over four vertices, normals and colours.
inline std::string binary_square(bool big_endian) {
    std::string out =
        std::string("ply\nformat ") + (big_endian ? "binary_big_endian" : "binary_little_endian") +
        " 1.0\nelement vertex 4\n" + kXyz +
        "property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar "
        "green\nproperty uchar blue\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
    for (const auto &[x, y] : {std::array{0.F, 0.F}, {1.F, 0.F}, {1.F, 2.5F}, {0.F, 2.5F}}) {
        for (const float value : {x, y, 0.25F, 0.F, 0.F, 1.F})
            put(out, value, big_endian);
        out += "\x0a\xc8\x0d"; // colours that look like line ends
    }
    for (const std::array<std::int32_t, 3> &face : {std::array{0, 1, 2}, {0, 2, 3}}) {
        out += '\3';
        for (const std::int32_t corner : face)
            put(out, corner, big_endian);
    }
    return out;
}

// Two points with the materials of the dissertation; the rows are left to append.
inline const std::string kMaterials =
    "ply\nformat ascii 1.0\nelement vertex 2\n" + kXyz +
    "property uchar material_index\nelement material 2\nproperty float ka\nproperty float "
    "kd\nproperty float ks\nproperty float power\nproperty float clr_r\nproperty float "
    "clr_g\nproperty float clr_b\nproperty float envmapfactor\nend_header\n";

} // namespace pbm::test
