// Poses of scans: a matrix in a file of its own, or an alignment file that names several scans.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <glm/mat4x4.hpp>

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

struct PosedScan {
    std::string file;
    std::optional<glm::dmat4> pose; // from the scan's coordinates to those of all
};

// The scans among `inputs`, in their order. An alignment file of the Stanford repository (`.conf`: lines "bmesh FILE
// X Y Z QX QY QZ QW") stands for the scans that it names, beside it. Its quaternions are those of the inverse rotation,
// as Stanford's programs write them. `poses`: none, or a file for each input: 16 numbers, row by row, the last row 0 0
// 0 1.
//
// errors  io         a pose or a scan of an alignment file cannot be opened; the message names it
//         bad_input  no such matrix; a line of an alignment file that makes no sense
//         usage      another number of poses than of inputs; poses for an alignment file
Result<std::vector<PosedScan>> posed_scans(std::span<const std::string> inputs, std::span<const std::string> poses);

// The scans that an alignment file names; none of another file.
std::vector<NamedFile> scans_of_alignment(const std::string &path);

// Moves positions, scanner positions, normals and radii.
void pose(Surface &surface, const glm::dmat4 &matrix);

} // namespace pbm::build
