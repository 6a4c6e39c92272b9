#include <pbm/scan.h>

#include <glm/common.hpp>

#include <cstdio>

int main(int argc, char **argv) {
    if (argc != 2)
        return 1;
    const auto scan = pbm::build::read_surface(argv[1], {});
    if (!scan) {
        std::fprintf(stderr, "%s: %s\n", argv[1], scan.error().message.c_str());
        return pbm::exit_code(scan.error().code);
    }
    glm::dvec3 low = scan->positions[0], high = low; // a scan has a vertex, and all of them are finite
    for (const glm::dvec3 &position : scan->positions) {
        low = glm::min(low, position);
        high = glm::max(high, position);
    }
    std::printf("%zu vertices, %zu triangles\n", scan->positions.size(), scan->triangles.size());
    std::printf("x %.9g..%.9g, y %.9g..%.9g, z %.9g..%.9g\n", low.x, high.x, low.y, high.y, low.z, high.z);
    for (const pbm::build::AttributeReport &line : scan->report)
        if (line.fate == pbm::build::Fate::dropped)
            std::printf("dropped: %s (%s)\n", line.name.c_str(), line.note.c_str());
}
