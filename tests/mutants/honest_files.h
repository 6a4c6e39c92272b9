// Small whole files of every format and many dialects: what mutants are made of.
#pragma once

#include <cstddef>
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

inline constexpr const char *kFreeText = "free text"; // name of texts whose words do not keep to lines

struct HonestFile {
    std::string name;
    Format format{};
    std::string bytes;            // of an E57: what lies in its pages, since checksums find any other damage
    std::size_t bytes_behind = 0; // that belong to nothing
};

// The same on every call. Clouds, and glTF.
std::vector<HonestFile> honest_meshes();
std::vector<HonestFile> honest_clouds();

} // namespace pbm::mutants
