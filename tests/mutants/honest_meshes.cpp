#include "mutants/honest_files.h"

#include "mutants/sheet.h"

#include <string_view>

namespace pbm::mutants {
namespace {

std::string ply_header(const std::string &encoding, const std::string &vertex_properties, std::size_t vertices,
                       const std::string &face_properties, std::size_t faces) {
    return "ply\nformat " + encoding + " 1.0\ncomment made for tests\nelement vertex " + std::to_string(vertices) +
           "\n" + vertex_properties + "element face " + std::to_string(faces) + "\n" + face_properties + "end_header\n";
}

constexpr const char *kPlace = "property float x\nproperty float y\nproperty float z\n";

std::string ply_ascii() {
    const std::vector<Triangle> faces = triangles();
    std::string text = ply_header("ascii", kPlace, kVertices, "property list uchar int vertex_indices\n", faces.size());
    for (int i = 0; i < kVertices; ++i)
        text += place(i) + "\n";
    for (const Triangle &t : faces)
        text += "3 " + corners(t, 0) + "\n";
    return text;
}

// Normals, colours, a confidence, quads, an unknown element, and CR LF line ends.
std::string ply_ascii_rich() {
    std::string text =
        "ply\r\nformat ascii 1.0\r\nelement camera 2\r\nproperty float view\r\nproperty list uchar float "
        "lens\r\nelement vertex 25\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\n"
        "property float nx\r\nproperty float ny\r\nproperty float nz\r\nproperty uchar red\r\n"
        "property uchar green\r\nproperty uchar blue\r\nproperty float confidence\r\nelement face 16\r\n"
        "property list uchar int vertex_index\r\nproperty uchar flags\r\nend_header\r\n"
        "0.5 2 1 2\r\n1.5 0\r\n";
    for (int i = 0; i < kVertices; ++i)
        text += place(i) + " 0 0.6 0.8 " + std::to_string(10 * i) + " 128 7 0.5\r\n";
    for (int row = 0; row + 1 < kEdge; ++row)
        for (int column = 0; column + 1 < kEdge; ++column) {
            const int i = row * kEdge + column;
            text += "4 " + std::to_string(i) + " " + std::to_string(i + 1) + " " + std::to_string(i + kEdge + 1) + " " +
                    std::to_string(i + kEdge) + " 0\r\n";
        }
    return text;
}

std::string ply_binary(bool big_endian) {
    const std::vector<Triangle> faces = triangles();
    std::string bytes =
        ply_header(big_endian ? "binary_big_endian" : "binary_little_endian",
                   std::string(kPlace) + "property uchar red\nproperty uchar green\nproperty uchar blue\n", kVertices,
                   "property list uchar int vertex_indices\n", faces.size());
    for (int i = 0; i < kVertices; ++i) {
        const Vertex v = vertex(i);
        for (const float value : {v.x, v.y, v.z})
            append(bytes, value, big_endian);
        bytes += static_cast<char>(i);
        bytes += "ab";
    }
    for (const Triangle &t : faces) {
        bytes += static_cast<char>(3);
        for (const int corner : t)
            append(bytes, static_cast<std::int32_t>(corner), big_endian);
    }
    return bytes;
}

// Doubles, a list on vertices, ushort counts and uint corners, polygons of several sizes.
std::string ply_binary_lists() {
    std::string bytes = ply_header("binary_little_endian",
                                   "property double x\nproperty double y\nproperty list uchar short marks\n"
                                   "property double z\n",
                                   kVertices, "property uchar flags\nproperty list ushort uint vertex_index\n", 8);
    for (int i = 0; i < kVertices; ++i) {
        const Vertex v = vertex(i);
        append(bytes, 8.5e6 + static_cast<double>(v.x));
        append(bytes, static_cast<double>(v.y));
        bytes += static_cast<char>(i % 3);
        for (int k = 0; k < i % 3; ++k)
            append(bytes, static_cast<std::int16_t>(k));
        append(bytes, static_cast<double>(v.z));
    }
    for (int row = 0; row < 8; ++row) {
        bytes += static_cast<char>(row);
        const int count = 3 + row % 3;
        append(bytes, static_cast<std::uint16_t>(count));
        for (int k = 0; k < count; ++k)
            append(bytes, static_cast<std::uint32_t>((row + k * kEdge) % kVertices));
    }
    return bytes;
}

// Names in capital letters; Gaussian splats; text behind the last face.
std::string ply_of_others() {
    const std::vector<Triangle> faces = triangles();
    std::string text =
        "ply\nformat ascii 1.0\nelement Vertex 25\nproperty float X\nproperty float Y\nproperty float Z\n"
        "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float opacity\n"
        "property float scale_0\nproperty float scale_1\nproperty float scale_2\nproperty float rot_0\n"
        "property float rot_1\nproperty float rot_2\nproperty float rot_3\nelement Face 32\n"
        "property list uchar int Vertex_Indices\nend_header\n";
    for (int i = 0; i < kVertices; ++i)
        text += place(i) + " -1.#IND 1.5D+0 1e0 0.25 -4 -4 -4 1 0 0 0.0\n";
    for (const Triangle &t : faces)
        text += "3 " + corners(t, 0) + "\n";
    return text;
}

std::string obj(bool announced) {
    const std::vector<Triangle> faces = triangles();
    std::string text = "# made for tests\n";
    if (announced)
        text += "#\n# Vertices: 25\n# Faces: 32\n#\n";
    text += "o sheet\n";
    for (int i = 0; i < kVertices; ++i)
        text += "v " + place(i) + "\n";
    for (const Triangle &t : faces)
        text += "f " + corners(t, 1) + "\n";
    return text + (announced ? "# 25 vertices, 32 faces\n" : "");
}

std::string obj_rich() {
    std::string text = "mtllib sheet.mtl\ng sheet\n";
    for (int i = 0; i < kVertices; ++i)
        text += "v " + place(i) + " 0.5 0.25 1\n";
    text += "vt 0 0\nvt 1 1\nvn 0 0 1\nvn 0 0.6 0.8\nusemtl grey\ns off\n";
    for (int row = 0; row + 1 < kEdge; ++row) {
        const int i = row * kEdge + 1;
        text += "f " + std::to_string(i) + "/1/1 " + std::to_string(i + 1) + "/2/2 " + std::to_string(i + kEdge + 1) +
                "/1/1 " + std::to_string(i + kEdge) + "/2/1\n";
        text += "f -1//1 -2//2 \\\n -" + std::to_string(kEdge + 1 + row) + "//1\n";
    }
    return text + "l 1 2 3\n";
}

// Colours of ZBrush, indices of normals that do not exist, numbers of old libraries, colours of some vertices.
std::string obj_of_others() {
    std::string text = "mtllib \"sheet 1.mtl\"\no sheet\ng a b\ns 1\n";
    for (int i = 0; i < kVertices; ++i)
        text += "v " + place(i) + (i % 2 == 0 ? " 0.5 0.25 1.000001\n" : "\n");
    text += "#MRGB ";
    for (int i = 0; i < kVertices; ++i)
        text += "ffc83c1e";
    text += "\nvt 0.5 0.5 0.5\nvn -1.#IND 1.#QNAN 0\nvn 0 0 1\nusemtl \"a b\"\nlod 3\n";
    for (const Triangle &t : triangles())
        text += "f " + std::to_string(t[0] + 1) + "/1/0 " + std::to_string(t[1] + 1) + "/9/2 " +
                std::to_string(t[2] + 1) + "//3\n";
    return text;
}

// Words with ends of lines behind every seventh one, and some comments.
std::string free_text(std::string text) {
    std::size_t count = 0;
    for (char &c : text)
        if (c == ' ' || c == '\n')
            c = ++count % 7 == 0 ? '\n' : ' ';
    return text;
}

std::string off(bool rich) {
    const std::vector<Triangle> faces = triangles();
    std::string text = rich ? "CNOFF\n# a comment\n25 32 0\n" : "OFF\n25 32 0\n";
    for (int i = 0; i < kVertices; ++i)
        text += place(i) + (rich ? " 0 0 1 " + std::to_string(10 * i) + " 0 255 255" : "") + "\n";
    for (const Triangle &t : faces)
        text += "3 " + corners(t, 0) + (rich ? "" : " 255 128 0") + "\n";
    return text;
}

std::string stl_ascii(bool two) {
    std::string text = "solid sheet\n";
    const std::vector<Triangle> faces = triangles();
    for (std::size_t i = 0; i < faces.size() / (two ? 1 : 2); ++i) {
        text += "  facet normal 0 0 1\n    outer loop\n";
        for (const int corner : faces[i])
            text += "      vertex " + place(corner) + "\n";
        text += "    endloop\n  endfacet\n";
        if (two && i == 15)
            text += "endsolid sheet\nsolid other\n";
    }
    return text + "endsolid\n";
}

std::string free_off() {
    std::string text = off(false); // without the colours of its faces
    for (std::size_t at = text.find(" 255 128 0"); at != std::string::npos; at = text.find(" 255 128 0", at))
        text.erase(at, 10);
    text = free_text(text);
    return text.insert(text.find('\n'), " # a comment");
}

std::string spelled_otherwise(std::string text) {
    for (std::size_t at = 0; (at = text.find("end", at)) != std::string::npos; at += 4)
        text.insert(at + 3, " ");
    return text;
}

// `attributes`: of every second facet.
std::string stl_binary(std::string header, std::uint16_t attributes = 0) {
    const std::vector<Triangle> faces = triangles();
    header.resize(80, ' ');
    append(header, static_cast<std::uint32_t>(faces.size()));
    for (const Triangle &t : faces) {
        for (int i = 0; i < 3; ++i)
            append(header, 0.0F);
        for (const int corner : t) {
            const Vertex v = vertex(corner);
            for (const float value : {v.x, v.y, v.z})
                append(header, value);
        }
        append(header, t[1] % 2 == 0 ? attributes : std::uint16_t{0});
    }
    return header;
}

} // namespace

std::vector<HonestFile> honest_meshes() {
    return {{"plain", Format::ply_ascii, ply_ascii()},
            {"rich", Format::ply_ascii, ply_ascii_rich()},
            {"little-endian", Format::ply_binary, ply_binary(false)},
            {"big-endian", Format::ply_binary, ply_binary(true)},
            {"lists", Format::ply_binary, ply_binary_lists()},
            {"of others", Format::ply_ascii, ply_of_others()},
            {"plain", Format::obj, obj(false)},
            {"announced", Format::obj, obj(true)},
            {"rich", Format::obj, obj_rich()},
            {"of others", Format::obj, obj_of_others()},
            {"face colours", Format::off, off(false)},
            {"vertex colours", Format::off, off(true)},
            {kFreeText, Format::off, free_off()},
            {"one solid", Format::stl_ascii, stl_ascii(false)},
            {"two solids", Format::stl_ascii, stl_ascii(true)},
            {kFreeText, Format::stl_ascii, free_text(stl_ascii(false))},
            {"end solid", Format::stl_ascii, spelled_otherwise(stl_ascii(true))},
            {"plain", Format::stl_binary, stl_binary("made for tests")},
            {"solid", Format::stl_binary, stl_binary("solid made for tests")},
            {"Materialise", Format::stl_binary, stl_binary("COLOR=abcd,MATERIAL=abcdefghijkl", 0x1234)},
            {"VisCAM", Format::stl_binary, stl_binary("x", 0x9234)},
            {"attributes", Format::stl_binary, stl_binary("x", 0x1234) + "more", 4}};
}

} // namespace pbm::mutants
