// Counts what a file announces, on its own: without the readers' code, and only as well as the counts need. Where a
// reader loads something else than is counted here, one of the two is wrong.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace pbm::mutants {

struct Announced {
    std::uint64_t vertices = 0;         // not of STL
    std::uint64_t unnamed_vertices = 0; // of these, which a reader may leave out: no index names them
    // Triangles, degenerate ones included. A face of n corners, all different, has n - 2; one in which corners are
    // equal has 1 to n - 2, since readers may take equal corners for one; one of fewer than three counts as one.
    std::uint64_t min_triangles = 0, max_triangles = 0;
    bool something_unknown = false; // the file holds more than vertices and faces: the reader must say what it dropped
};

// Nothing where the text or bytes cannot be counted.
std::optional<Announced> count_ply(std::string_view bytes);
std::optional<Announced> count_obj(std::string_view bytes);
std::optional<Announced> count_off(std::string_view bytes);
std::optional<Announced> count_stl(std::string_view bytes);
std::optional<Announced> count_gltf(std::string_view bytes);
std::optional<Announced> count_ptx(std::string_view bytes);
std::optional<Announced> count_e57(std::string_view bytes); // what lies in the pages
std::optional<Announced> count_las(std::string_view bytes);
std::optional<Announced> count_spz(std::string_view bytes); // unpacked
std::optional<Announced> count_pcd(std::string_view bytes);
std::optional<Announced> count_table(std::string_view bytes);

} // namespace pbm::mutants
