#include "pbm_build/report/mesh_figures.h"

#include "pbm_build/report/build_statistics.h"
#include "pbm_scan/text/printable.h"

namespace pbm::build {

std::string to_text(const MeshFigures &figures) {
    const auto line = [](const char *name, const std::string &text) {
        return formatted("  %-9s ", name) + text + "\n";
    };
    std::string text = "mesh" + (figures.input.empty() ? "" : " of " + figures.input) + ", " + figures.state + ":\n";
    text += line("size", counted(figures.vertices, "vertex") + " at " + counted(figures.positions, "position") + ", " +
                             counted(figures.edges, "edge") + ", " + counted(figures.faces, "face"));
    text += line("parts", counted(figures.parts, "part") + ", " + std::to_string(figures.closed_parts) +
                              " closed; the largest has " + counted(figures.largest_part_faces, "face") +
                              formatted(", %.4g %% of the area", 100 * figures.largest_part_share));
    text += line("border", figures.border_edges == 0 ? "none: closed"
                                                     : counted(figures.border_loops, "loop") + " of " +
                                                           counted(figures.border_edges, "edge") + ", the longest of " +
                                                           std::to_string(figures.longest_loop));
    text += line("complex", counted(figures.complex_edges, "edge") + " of more than two faces, " +
                                counted(figures.complex_vertices, "vertex") + " of more than one fan");
    text += line("winding", counted(figures.turned_faces, "face") + " against the others, " +
                                counted(figures.inward_sheets, "sheet") + " inwards, " +
                                std::to_string(figures.one_sided_sheets) + " with one side only");
    text += line("unused", counted(figures.isolated_vertices, "vertex") + " without a face, " +
                               counted(figures.repeated_faces, "repeated face") + ", " +
                               counted(figures.flat_faces, "face") + " with two corners at one position");
    text += line("Euler", "characteristic " + std::to_string(figures.euler_characteristic) +
                              (figures.genus ? ", genus " + std::to_string(*figures.genus)
                                             : ", no genus: not a manifold with two sides"));
    return text;
}

} // namespace pbm::build
