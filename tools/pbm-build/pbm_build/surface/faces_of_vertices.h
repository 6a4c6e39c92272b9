// The faces at each of some vertices of a surface.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <span>
#include <vector>

namespace pbm::build {

class FacesOfVertices {
  public:
    // Of the vertices in [first, end) for which is_wanted(vertex). Reads all triangles twice.
    template <class Wanted>
    FacesOfVertices(const Surface &surface, std::size_t first, std::size_t end, const Wanted &is_wanted)
        : first_(static_cast<std::uint32_t>(first)), starts_(end - first + 1) {
        const auto count = static_cast<std::uint32_t>(end - first);
        const auto visit = [&](const auto &use) {
            for (std::size_t i = surface.triangles.size(); i-- > 0;)
                for (int corner = 0; corner < 3; ++corner) {
                    const std::uint32_t vertex = surface.triangles[i][corner] - first_; // large if it is below `first`
                    if (vertex < count && is_wanted(vertex + first_))
                        use(vertex, static_cast<std::uint32_t>(i));
                }
        };
        visit([&](std::uint32_t vertex, std::uint32_t) { ++starts_[vertex]; });
        std::size_t sum = 0;
        for (std::size_t &start : starts_)
            start = sum += start;
        faces_.resize(sum);
        visit([&](std::uint32_t vertex, std::uint32_t face) { faces_[--starts_[vertex]] = face; });
    }

    // In ascending order; none for a vertex that was not wanted.
    std::span<const std::uint32_t> at(std::size_t vertex) const {
        const std::size_t begin = starts_[vertex - first_];
        return std::span(faces_).subspan(begin, starts_[vertex - first_ + 1] - begin);
    }

  private:
    std::uint32_t first_;
    std::vector<std::size_t> starts_;  // [vertices + 1]
    std::vector<std::uint32_t> faces_; // indices of triangles
};

} // namespace pbm::build
