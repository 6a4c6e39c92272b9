// The sample model: a fossil ammonite as a range scanner would deliver it.
#pragma once

#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pbm::sample {

// A closed 2-manifold, counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<glm::vec3> position;                    // metres, right-handed, +Y up
    std::vector<std::array<std::uint8_t, 3>> color;     // sRGB, one per position
    std::vector<std::array<std::uint32_t, 3>> triangle; // indices into position
};

struct AmmoniteOptions {
    std::size_t vertices = 1'000'000; // approximate; kMinVertices..kMaxVertices
    std::uint32_t seed = 1;
    int threads = 0;                                 // 0: one per processor; does not change the result
    std::function<void(const char *stage)> on_stage; // called on the calling thread when a stage begins, if set
};

constexpr std::size_t kMinVertices = 10'000;
constexpr std::size_t kMaxVertices = 10'000'000;

// Makes the ammonite: 16 cm across, standing on its edge, the coil facing +Z. The number of vertices is within 5 % of
// `options.vertices`; edges have nearly equal lengths. The result is the same on every machine for the same vertices
// and seed.
// Throws std::bad_alloc; needs about 110 bytes per vertex.
TriangleMesh make_ammonite(const AmmoniteOptions &options);

} // namespace pbm::sample
