#include "largest_piece.h"

#include <algorithm>
#include <numeric>

namespace pbm::sample {

void keep_largest_piece(Isosurface &surface) {
    if (surface.position.empty())
        return;
    std::vector<std::uint32_t> parent(surface.position.size());
    std::iota(parent.begin(), parent.end(), 0u);
    const auto root = [&parent](std::uint32_t v) {
        while (parent[v] != v)
            v = parent[v] = parent[parent[v]];
        return v;
    };
    for (const auto &t : surface.triangle)
        for (const std::uint32_t v : {t[1], t[2]}) {
            const std::uint32_t a = root(t[0]);
            const std::uint32_t b = root(v);
            parent[std::max(a, b)] = std::min(a, b);
        }
    std::vector<std::uint32_t> size(parent.size());
    for (std::uint32_t v = 0; v < parent.size(); ++v)
        ++size[root(v)];
    const auto largest = static_cast<std::uint32_t>(std::max_element(size.begin(), size.end()) - size.begin());
    std::vector<std::uint32_t> renamed(parent.size());
    std::uint32_t kept = 0;
    for (std::uint32_t v = 0; v < parent.size(); ++v)
        if (root(v) == largest) {
            surface.position[kept] = surface.position[v];
            surface.normal[kept] = surface.normal[v];
            renamed[v] = kept++;
        }
    surface.position.resize(kept);
    surface.normal.resize(kept);
    std::erase_if(surface.triangle, [&](const auto &t) { return root(t[0]) != largest; });
    for (auto &t : surface.triangle)
        t = {renamed[t[0]], renamed[t[1]], renamed[t[2]]};
}

} // namespace pbm::sample
