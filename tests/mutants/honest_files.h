// Small whole files of every format and many dialects: what mutants are made of.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pbm::mutants {

enum class Format : std::uint8_t {
    ply_ascii,
    ply_binary,
    obj,
    off,
    stl_ascii,
    stl_binary,
    ptx,
    e57,
    las,
    laz,
    spz,
    pcd_ascii,
    pcd_binary,
    table,
    gltf
};
constexpr int kFormats = 15;

struct HonestFile {
    std::string name;
    Format format{};
    std::string bytes; // of an E57: what lies in its pages, since checksums find any other damage
};

// The same on every call. Clouds, and glTF.
std::vector<HonestFile> honest_meshes();
std::vector<HonestFile> honest_clouds();

} // namespace pbm::mutants
