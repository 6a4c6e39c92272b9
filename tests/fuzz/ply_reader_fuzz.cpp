// Law: for any bytes, read_ply returns an Error of one line, or a Surface with arrays of equal length, valid indices
// and finite numbers. Memory is at most a small multiple of the input.
#include "pbm_scan/ply/ply_reader.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

namespace {

void require(bool holds) {
    if (!holds)
        std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const pbm::Result<pbm::build::Surface> result = pbm::build::read_ply({data, size}, {});
    if (!result) {
        require(!result.error().message.empty() && result.error().message.find('\n') == std::string::npos);
        require(result.error().offset <= size);
        return 0;
    }
    const pbm::build::Surface &s = *result;
    const std::size_t count = s.positions.size();
    require(count != 0 && count + s.dropped_vertices <= size);
    require(s.normals.empty() || s.normals.size() == count);
    require(s.colours.empty() || s.colours.size() == count);
    require(s.radii.empty() || s.radii.size() == count);
    require(s.material_ids.empty() || s.material_ids.size() == count);
    require(s.materials.size() <= 8 && s.triangles.size() <= size);
    for (const glm::dvec3 &p : s.positions)
        require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    for (const glm::uvec3 &t : s.triangles)
        require(t.x < count && t.y < count && t.z < count && t.x != t.y && t.y != t.z && t.x != t.z);
    for (const glm::vec3 &n : s.normals)
        require(std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z));
    for (const float radius : s.radii)
        require(radius > 0.0F && std::isfinite(radius));
    for (const std::uint8_t id : s.material_ids)
        require(id < s.materials.size());
    return 0;
}
