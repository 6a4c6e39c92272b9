#include "cgal_peer.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/mst_orient_normals.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>

#include <cstddef>
#include <tuple>

namespace pbm::bench {

std::vector<glm::dvec3> cgal_normals(std::span<const glm::dvec3> points) {
    using Kernel = CGAL::Simple_cartesian<double>;
    using Oriented = std::tuple<Kernel::Point_3, Kernel::Vector_3, std::size_t>;
    constexpr unsigned kNeighbours = 18;
    std::vector<Oriented> all;
    all.reserve(points.size());
    for (const glm::dvec3 &p : points)
        all.emplace_back(Kernel::Point_3(p.x, p.y, p.z), Kernel::Vector_3(0, 0, 0), all.size());
    const auto maps = CGAL::parameters::point_map(CGAL::Nth_of_tuple_property_map<0, Oriented>())
                          .normal_map(CGAL::Nth_of_tuple_property_map<1, Oriented>());
    CGAL::pca_estimate_normals<CGAL::Sequential_tag>(all, kNeighbours, maps);
    const auto end = CGAL::mst_orient_normals(all, kNeighbours, maps);
    std::vector<glm::dvec3> normals(points.size());
    for (auto i = all.begin(); i != end; ++i) {
        const auto &[point, normal, index] = *i;
        normals[index] = {normal.x(), normal.y(), normal.z()};
    }
    return normals;
}

} // namespace pbm::bench
