// Where a picture differs from its truth: at outlines, at contours within the object, at sharp edges, or elsewhere.
#pragma once

#include "fidelity.h"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pbm {

// An edge of the mesh with one face, or whose faces meet at more than kSharp.
struct SharpEdge {
    glm::dvec3 from, to; // model space
};
inline constexpr double kSharp = 30; // degrees

// Vertices at one position count as one vertex; faces without an area do not count.
std::vector<SharpEdge> sharp_edges(const TriangleMesh &mesh);

// Sums over the pixels that differ from the background in one of both pictures. *At an outline*: rays within 2 pixels
// miss the object; *at a contour*: their depths jump; *at an edge*: a visible sharp edge lies within 2 pixels.
struct ErrorPlaces {
    enum Place : std::uint8_t { outline, outline_at_edge, contour, contour_at_edge, edge, elsewhere, count };

    std::array<std::uint64_t, count> pixels{}, squared_error{};
};

// `truth` holds the rays of `camera`, `colours` the traced picture.
void add_error_places(std::span<const SharpEdge> edges, const Camera &camera, const PictureTruth &truth,
                      std::span<const Srgb> colours, const Framebuffer &drawn, ErrorPlaces &to);

// One line for each place: pixels, its share of the squared error, and the PSNR if it had none.
std::string to_text(const ErrorPlaces &places);

} // namespace pbm
