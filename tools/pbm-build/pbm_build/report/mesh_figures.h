// What --mesh-report says of the faces of one scan.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace pbm::build {

// Equal positions are one vertex. Faces are triangles with three vertices; of those with the same vertices one counts.
struct MeshFigures {
    std::string input; // which of several inputs; empty where there is only one
    std::string state; // "as read", "as repaired"
    std::uint64_t positions = 0, vertices = 0, edges = 0, faces = 0;
    std::uint64_t isolated_vertices = 0; // without a face
    std::uint64_t repeated_faces = 0;    // with the vertices of another face
    std::uint64_t flat_faces = 0;        // two corners are one vertex
    std::uint64_t parts = 0;             // connected through edges
    std::uint64_t closed_parts = 0;      // without an edge that has only one face
    std::uint64_t largest_part_faces = 0;
    double largest_part_share = 0; // of the area, 0..1
    std::uint64_t border_edges = 0, border_loops = 0, longest_loop = 0;
    std::uint64_t complex_edges = 0, complex_vertices = 0; // of more than two faces; of more than one fan of faces
    std::uint64_t turned_faces = 0;                        // wound against most of their sheet
    std::uint64_t inward_sheets = 0;                       // closed, and wound inwards
    std::uint64_t one_sided_sheets = 0;                    // like a Moebius strip
    std::int64_t euler_characteristic = 0;                 // vertices - edges + faces
    std::optional<std::uint64_t> genus;                    // handles of all parts; of a manifold with two sides

    bool is_closed() const { return faces > 0 && border_edges == 0; }
};

// One line each, with a final newline.
std::string to_text(const MeshFigures &figures);

} // namespace pbm::build
