// A scan as plain arrays: what every reader delivers and what the pipeline samples.
#pragma once

#include "pbm_format/error.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pbm::build {

// Reflection coefficients of one material (dissertation section 4.6, Phong). Colour is sRGB 0..255.
struct SurfaceMaterial {
    float ka = 0.2F, kd = 0.7F, ks = 0.1F, power = 16.0F;
    std::array<std::uint8_t, 3> colour{204, 204, 204};
    float environment = 0.0F; // blending factor 0..1
};

// What became of one attribute of the input file.
struct AttributeReport {
    enum class Fate : std::uint8_t { kept, converted, dropped };
    std::string name; // as the input names it, e.g. "vertex.confidence"
    Fate fate = Fate::kept;
    std::string note; // what it became, or why it was dropped
};

// Arrays run in parallel with `positions`, or are empty where the input has no such attribute.
struct Surface {
    std::vector<glm::dvec3> positions; // model units, all finite
    std::vector<glm::uvec3> triangles; // indices < positions.size(); polygons are fanned, strips unrolled
    std::vector<glm::vec3> normals;    // as given, any length; zero length means "none here"
    std::vector<std::array<std::uint8_t, 3>> colours; // sRGB
    std::vector<float> radii;                         // splat radius, model units, > 0
    std::vector<std::uint8_t> material_ids;           // < materials.size()
    std::vector<SurfaceMaterial> materials;           // empty: the default material
    std::vector<AttributeReport> report;              // in the order of the file
    std::uint64_t dropped_vertices = 0;               // not finite
    std::uint64_t dropped_triangles = 0;              // fewer than three different corners, or at a dropped vertex
};

// What a caller may ask of every reader.
struct ReadOptions {
    bool strict = false;                       // refuse (`bad_input`) instead of dropping anything
    std::function<void(double done)> progress; // called now and then from the calling thread, 0..1; may be empty
};

// The last step of every reader: removes vertices with a coordinate that is not finite, with everything that hangs on
// them, and counts them; with ReadOptions::strict refuses a surface that is less than the file said.
//
// errors  bad_input  no vertex is left; with `strict` something was dropped
Result<Surface> finished(Surface surface, const ReadOptions &options);

} // namespace pbm::build
