#include "ply_writer.h"

namespace pbm::sample {

namespace {

std::string header(const TriangleMesh &mesh, PlyEncoding encoding, const std::string &comment) {
    return "ply\nformat " + std::string(format_name(encoding)) + " 1.0\ncomment " + comment + "\nelement vertex " +
           std::to_string(mesh.position.size()) +
           "\nproperty float x\nproperty float y\nproperty float z\n"
           "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face " +
           std::to_string(mesh.triangle.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

void append_binary(const TriangleMesh &mesh, Bytes &out) {
    const auto add = [&out](const auto &values) { // little-endian, as they lie in memory
        const auto *const bytes = reinterpret_cast<const std::uint8_t *>(&values);
        out.insert(out.end(), bytes, bytes + sizeof values);
    };
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
        add(mesh.position[i]);
        add(mesh.color[i]);
    }
    for (const auto &triangle : mesh.triangle) {
        out.push_back(3);
        add(triangle);
    }
}

void append_ascii(const TriangleMesh &mesh, Bytes &out) {
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis)
            put_text(out, mesh.position[i][axis]);
        for (const std::uint8_t channel : mesh.color[i])
            put_text(out, unsigned{channel});
        out.back() = '\n';
    }
    for (const auto &triangle : mesh.triangle) {
        put_text(out, 3U);
        for (const std::uint32_t vertex : triangle)
            put_text(out, vertex);
        out.back() = '\n';
    }
}

} // namespace

Bytes encode_ply(const TriangleMesh &mesh, PlyEncoding encoding, const std::string &comment) {
    const std::string head = header(mesh, encoding, comment);
    Bytes out(head.begin(), head.end());
    if (encoding == PlyEncoding::ascii) {
        append_ascii(mesh, out);
    } else {
        out.reserve(out.size() + 15 * mesh.position.size() + 13 * mesh.triangle.size());
        append_binary(mesh, out);
    }
    return out;
}

} // namespace pbm::sample
