// What the readers make of scans: one line of JSON per file. usage: describe_scan FILE...
//
//   {"exit": 0, "vertices": 3, "triangles": 1, "dropped_vertices": 0, "dropped_triangles": 0,
//    "attributes": ["colours", "normals", "radii", "materials"], "report": ["vertex.x y z: kept (positions)", ...]}
//   {"exit": 3, "offset": 120, "message": "line 9: ..."}
#include "pbm_scan/surface_reader.h"

#include <array>
#include <iostream>
#include <string>

namespace {

using pbm::build::AttributeReport;
using pbm::build::Surface;

std::string json_text(const std::string &text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            out += '\\';
        out += c >= ' ' && c <= '~' ? c : '?';
    }
    return out + "\"";
}

void describe(const Surface &surface) {
    std::cout << "{\"exit\": 0, \"vertices\": " << surface.positions.size()
              << ", \"triangles\": " << surface.triangles.size()
              << ", \"dropped_vertices\": " << surface.dropped_vertices
              << ", \"dropped_triangles\": " << surface.dropped_triangles << ", \"attributes\": [";
    const std::array<std::pair<const char *, bool>, 4> attributes{
        {{"colours", !surface.colours.empty() || !surface.face_colours.empty()},
         {"normals", !surface.normals.empty()},
         {"radii", !surface.radii.empty()},
         {"materials", !surface.material_ids.empty()}}};
    const char *separator = "";
    for (const auto &[name, there] : attributes)
        if (there)
            std::cout << std::exchange(separator, ", ") << '"' << name << '"';
    std::cout << "], \"report\": [";
    constexpr std::array kFates{"kept", "converted", "dropped"};
    separator = "";
    for (const AttributeReport &line : surface.report)
        std::cout << std::exchange(separator, ", ")
                  << json_text(line.name + ": " + kFates[static_cast<std::size_t>(line.fate)] + " (" + line.note + ")");
    std::cout << "]}\n";
}

} // namespace

int main(int argc, char **argv) {
    for (int i = 1; i < argc; ++i) {
        const pbm::Result<Surface> surface = pbm::build::read_surface(std::string(argv[i]), {});
        if (surface)
            describe(*surface);
        else
            std::cout << "{\"exit\": " << pbm::exit_code(surface.error().code)
                      << ", \"offset\": " << surface.error().offset
                      << ", \"message\": " << json_text(surface.error().message) << "}\n";
    }
    return 0;
}
