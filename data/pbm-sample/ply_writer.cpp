#include "ply_writer.h"

#include <charconv>

namespace pbm::sample {

namespace {

std::string header(const TriangleMesh &mesh, PlyEncoding encoding, const std::string &comment) {
    return "ply\nformat " + std::string(encoding == PlyEncoding::ascii ? "ascii" : "binary_little_endian") +
           " 1.0\ncomment " + comment + "\nelement vertex " + std::to_string(mesh.position.size()) +
           "\nproperty float x\nproperty float y\nproperty float z\n"
           "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face " +
           std::to_string(mesh.triangle.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

template <class T> void put(Bytes &out, T value) {
    const std::size_t at = out.size();
    out.resize(at + sizeof(T));
    std::memcpy(out.data() + at, &value, sizeof(T));
}

void append_binary(const TriangleMesh &mesh, Bytes &out) {
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
        for (const float x : mesh.position[i])
            put(out, x);
        for (const std::uint8_t c : mesh.color[i])
            put(out, c);
    }
    for (const auto &triangle : mesh.triangle) {
        put(out, std::uint8_t{3});
        for (const std::uint32_t vertex : triangle)
            put(out, vertex);
    }
}

// Appends the shortest decimal that reads back the same, then `after`.
template <class Number> void put_text(Bytes &out, Number value, char after) {
    char digits[32];
    const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
    out.insert(out.end(), digits, end);
    out.push_back(static_cast<std::uint8_t>(after));
}

void append_ascii(const TriangleMesh &mesh, Bytes &out) {
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
        for (const float x : mesh.position[i])
            put_text(out, x, ' ');
        const auto &c = mesh.color[i];
        put_text(out, unsigned{c[0]}, ' ');
        put_text(out, unsigned{c[1]}, ' ');
        put_text(out, unsigned{c[2]}, '\n');
    }
    for (const auto &t : mesh.triangle) {
        put_text(out, 3U, ' ');
        put_text(out, t[0], ' ');
        put_text(out, t[1], ' ');
        put_text(out, t[2], '\n');
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
