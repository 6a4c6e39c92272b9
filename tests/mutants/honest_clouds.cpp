// Honest files of point clouds, and of glTF.
#include "mutants/honest_files.h"
#include "mutants/sheet.h"
#include "unit/scan/e57_files.h"
#include "unit/scan/laz_files.h"

#include <cstdint>

namespace pbm::mutants {
namespace {

// Two scans of the sheet; of the second one some lines of sight have no echo.
std::string ptx(bool coloured) {
    std::string text;
    for (const bool second : {false, true}) {
        text += "5\n5\n0.5 1 9\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0.5 1 9 1\n";
        for (int i = 0; i < kVertices; ++i) {
            const Vertex v = vertex(i);
            text += second && i % 9 == 4 ? "0 0 0" : number(v.x - 0.5F) + " " + number(v.y) + " " + number(v.z - 9);
            text += coloured ? " 0.25 10 " + std::to_string(10 * i) + " 255\n" : " 0.5\n";
        }
    }
    return text;
}

std::string e57(bool scaled) {
    std::vector<float> x, y, z;
    std::vector<std::int64_t> rows, columns, colour;
    std::array<std::vector<std::int64_t>, 3> steps;
    for (int i = 0; i < kVertices; ++i) {
        const Vertex v = vertex(i);
        x.push_back(v.x);
        y.push_back(v.y);
        z.push_back(v.z);
        steps[0].push_back(i % kEdge);
        steps[1].push_back(i / kEdge);
        steps[2].push_back(i % 7);
        rows.push_back(i / kEdge);
        columns.push_back(i % kEdge);
        colour.push_back(10 * i);
    }
    test::E57ScanText floats{.columns = {test::e57_floats("cartesianX", x), test::e57_floats("cartesianY", y),
                                         test::e57_floats("cartesianZ", z), test::e57_integers("rowIndex", 0, 31, rows),
                                         test::e57_integers("columnIndex", 0, 4, columns),
                                         test::e57_floats("intensity", x)}};
    const std::string scale = R"(scale="0.25" offset="1")";
    test::E57ScanText integers{.columns = {test::e57_integers("cartesianX", -3, 9, steps[0], scale),
                                           test::e57_integers("cartesianY", 0, 1023, steps[1], scale),
                                           test::e57_integers("cartesianZ", 0, 7, steps[2], scale),
                                           test::e57_integers("colorRed", 0, 255, colour),
                                           test::e57_integers("colorGreen", 0, 255, colour),
                                           test::e57_integers("colorBlue", 0, 255, colour)}};
    integers.stream_bytes = 7;
    integers.other_packets = true;
    integers.more = R"(<pose><rotation><w>1</w></rotation><translation><x type="Float">2.5</x></translation></pose>)";
    return scaled ? test::e57_contents({integers, floats}) : test::e57_contents({floats});
}

// Format 3 of LAS 1.2, or format 7 of LAS 1.4 with bytes of its own behind each point. One point is withheld.
std::string las(bool is_new) {
    const std::size_t header = is_new ? 375 : 227, size = is_new ? 40 : 34;
    std::string file = "LASF";
    file.resize(header);
    const auto put = [&](std::size_t at, auto value) { std::memcpy(file.data() + at, &value, sizeof value); };
    put(24, static_cast<std::uint8_t>(1));
    put(25, static_cast<std::uint8_t>(is_new ? 4 : 2));
    put(94, static_cast<std::uint16_t>(header));
    put(96, static_cast<std::uint32_t>(header));
    put(104, static_cast<std::uint8_t>(is_new ? 7 : 3));
    put(105, static_cast<std::uint16_t>(size));
    put(107, static_cast<std::uint32_t>(is_new ? 0 : kVertices));
    if (is_new)
        put(247, static_cast<std::uint64_t>(kVertices));
    for (std::size_t axis = 0; axis < 3; ++axis) {
        put(131 + 8 * axis, 0.125);
        put(155 + 8 * axis, 500000.0);
    }
    file.resize(header + kVertices * size);
    for (int i = 0; i < kVertices; ++i) {
        const Vertex v = vertex(i);
        const std::size_t at = header + static_cast<std::size_t>(i) * size;
        for (std::size_t axis = 0; const float value : {v.x, v.y, v.z})
            put(at + 4 * axis++, static_cast<std::int32_t>(8 * value));
        put(at + 12, static_cast<std::uint16_t>(10 * i));
        put(at + 15, static_cast<std::uint8_t>(i != 7 ? 0 : is_new ? 0x04 : 0x80));
        put(at + (is_new ? 16 : 15) + (is_new ? 0 : 2), static_cast<std::uint8_t>(i % 3));
        put(at + (is_new ? 30 : 28), static_cast<std::uint16_t>(256 * i));
    }
    return file;
}

// Records of coordinate reference systems and others before the points, a long one behind them.
std::string las_with_records() {
    std::string file = las(true), records;
    const auto record = [](const char *user, std::uint16_t id, const std::string &content, bool is_long) {
        std::string head(is_long ? 60 : 54, '\0');
        head.replace(2, std::strlen(user), user);
        std::memcpy(head.data() + 18, &id, sizeof id);
        const auto length = static_cast<std::uint16_t>(content.size());
        std::memcpy(head.data() + 20, &length, sizeof length);
        return head + content;
    };
    const std::string keys("\1\0\1\0\0\0\2\0\0\x0c\0\0\1\0\x2b\x0b\1\x0c\xb1\x87\1\0\0\0", 24);
    records += record("LASF_Projection", 34735, keys, false) + record("LASF_Projection", 34737, "NAD83|", false) +
               record("LASF_Spec", 7, "void", false) + record("made for tests", 1, "text", false);
    const auto put = [&file](std::size_t at, auto value) { std::memcpy(file.data() + at, &value, sizeof value); };
    put(96, static_cast<std::uint32_t>(375 + records.size()));
    put(100, std::uint32_t{4});
    put(235, static_cast<std::uint64_t>(file.size() + records.size()));
    put(243, std::uint32_t{1});
    return file.insert(375, records) +
           record("LASF_Projection", 2112, R"(PROJCS["a",GEOGCS["b"],UNIT["US survey foot",0.3048006096]])", true);
}

// The same points, pointwise or in layers.
std::string laz(bool is_new) {
    const std::string whole = las(is_new);
    const std::size_t size = is_new ? 40 : 34;
    std::vector<std::string> records;
    for (std::size_t at = whole.size() - kVertices * size; at < whole.size(); at += size)
        records.push_back(whole.substr(at, size));
    return test::laz_file({.format = is_new ? 7U : 3U,
                           .version = is_new ? 3U : 2U,
                           .chunks = {10, 10, 5},
                           .are_equal = true,
                           .extra = is_new ? 4U : 0U},
                          records);
}

// Version 3, with harmonics of the first degree, before it is compressed.
std::string spz() {
    std::string file = "NGSP";
    append(file, std::uint32_t{3});
    append(file, static_cast<std::uint32_t>(kVertices));
    file += std::string("\1\3\0\0", 4); // degree, bits of the fraction
    for (int i = 0; i < kVertices; ++i) {
        const Vertex v = vertex(i);
        for (const float value : {v.x, v.y, v.z})
            file.append({static_cast<char>(8 * value), '\0', '\0'});
    }
    return file + std::string(std::size_t{kVertices} * (1 + 3 + 3 + 4 + 9), 'x');
}

std::string pcd_header(const std::string &data) {
    return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity quality\n"
           "SIZE 4 4 4 4 1\nTYPE F F F F U\nCOUNT 1 1 1 1 1\nWIDTH 5\nHEIGHT 5\nVIEWPOINT 0 0 3 1 0 0 0\n"
           "POINTS 25\nDATA " +
           data + "\n";
}

// A packed colour with a sign, a field of no values, a rotation, text behind the points.
std::string pcd_packed() {
    std::string text =
        "# .PCD v0.7\nFIELDS x y z rgba none\nSIZE 4 4 4 4 1\nTYPE F F F I U\nCOUNT 1 1 1 1 0\nWIDTH 25\n"
        "HEIGHT 1\nVIEWPOINT 0 0 3 0.5 0.5 0.5 0.5\nDATA ascii\n";
    for (int i = 0; i < kVertices; ++i)
        text += place(i) + " -36443" + std::to_string(10 + i) + "\n";
    return text;
}

std::string pcd_ascii() {
    std::string text = pcd_header("ascii");
    for (int i = 0; i < kVertices; ++i)
        text += (i == 7 ? std::string("nan nan nan") : place(i)) + " 0.5 " + std::to_string(i) + "\n";
    return text;
}

// Compressed: column by column, as literal runs of LZF.
std::string pcd_binary(bool compressed) {
    std::string rows, columns;
    for (int column = 0; column < 5; ++column)
        for (int i = 0; i < kVertices; ++i) {
            const Vertex v = vertex(i);
            if (column == 4)
                columns += static_cast<char>(i);
            else
                append(columns, std::array<float, 4>{v.x, v.y, v.z, 0.5F}[static_cast<std::size_t>(column)]);
        }
    for (std::size_t i = 0; i < kVertices; ++i) {
        for (std::size_t column = 0; column < 4; ++column)
            rows += columns.substr(4 * (column * kVertices + i), 4);
        rows += columns[std::size_t{16} * kVertices + i];
    }
    if (!compressed)
        return pcd_header("binary") + rows;
    std::string packed;
    for (std::size_t at = 0; at < columns.size(); at += 32) {
        const std::string run = columns.substr(at, 32);
        packed += static_cast<char>(run.size() - 1);
        packed += run;
    }
    std::string file = pcd_header("binary_compressed");
    append(file, static_cast<std::uint32_t>(packed.size()));
    append(file, static_cast<std::uint32_t>(columns.size()));
    return file + packed;
}

// Kinds: numbers alone; names and commas; a count first; degrees, and a colour in one number; colours and labels
// without names, beside numbers of Fortran and of old libraries.
enum class Table { plain, named, counted, degrees, labels };
std::string table(Table kind) {
    std::string text = kind == Table::named     ? "x,y,z,red,green,blue,intensity,classification\n"
                       : kind == Table::degrees ? "lon lat height rgb\n"
                       : kind == Table::labels  ? ""
                       : kind == Table::counted ? std::to_string(kVertices) + "\n"
                                                : "# made for tests\n";
    for (int i = 0; i < kVertices; ++i) {
        std::string row = place(i);
        if (kind == Table::named) {
            row += " " + std::to_string(10 * i) + " 0 255 0.5 " + std::to_string(i % 5);
            for (char &c : row)
                c = c == ' ' ? ',' : c;
        } else if (kind == Table::counted)
            row += " -" + std::to_string(100 * i) + " 7 128 " + std::to_string(i);
        else if (kind == Table::degrees)
            row += " -" + std::to_string(100000 * i);
        else if (kind == Table::labels) {
            if (i == 9)
                row = "nan 0 0";
            else
                row += "D0";
            row.append(" 200 ").append(std::to_string(60 + i)).append(" 30 ").append(std::to_string(i % 4));
        }
        text += row + "\n";
    }
    return text;
}

std::string base64(std::string_view bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (std::size_t at = 0; at < bytes.size(); at += 3) { // of whole threes
        std::uint32_t bits = 0;
        for (const char c : bytes.substr(at, 3))
            bits = bits << 8 | static_cast<unsigned char>(c);
        for (int shift = 18; shift >= 0; shift -= 6)
            text += kDigits[bits >> shift & 63];
    }
    return text;
}

// The sheet, once as triangles and once as points, the former shown by two nodes.
std::string gltf(bool is_binary) {
    std::string buffer;
    for (int i = 0; i < kVertices; ++i) {
        const Vertex v = vertex(i);
        for (const float value : {v.x, v.y, v.z})
            append(buffer, value);
    }
    const std::size_t places = buffer.size();
    for (const Triangle &t : triangles())
        for (const int corner : t)
            append(buffer, static_cast<std::uint16_t>(corner));
    const std::size_t corners = buffer.size() - places;
    buffer.resize((buffer.size() + 11) / 12 * 12);
    const auto number = [](std::size_t value) { return std::to_string(value); };
    std::string text =
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],)"
        R"("nodes":[{"mesh":0,"children":[2]},{"mesh":1,"scale":[2,2,2]},{"mesh":0,"translation":[0,0,5]}],)"
        R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]},)"
        R"({"primitives":[{"attributes":{"POSITION":0},"mode":0}]}],)"
        R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
        number(kVertices) + R"(},{"bufferView":1,"componentType":5123,"type":"SCALAR","count":)" + number(corners / 2) +
        R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + number(places) + R"(},{"buffer":0,"byteOffset":)" +
        number(places) + R"(,"byteLength":)" + number(corners) + R"(}],"buffers":[{"byteLength":)" +
        number(buffer.size());
    if (!is_binary)
        return text + R"(,"uri":"data:application/octet-stream;base64,)" + base64(buffer) + "\"}]}";
    text += "}]}";
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string file = "glTF";
    append(file, std::uint32_t{2});
    append(file, static_cast<std::uint32_t>(28 + text.size() + buffer.size()));
    append(file, static_cast<std::uint32_t>(text.size()));
    file += "JSON" + text;
    append(file, static_cast<std::uint32_t>(buffer.size()));
    return file + std::string("BIN\0", 4) + buffer;
}

// A skin, morph targets, instances, hidden nodes, points by indices, two scenes, extensions.
std::string gltf_scene() {
    std::string buffer;
    for (int i = 0; i < kVertices; ++i) {
        const Vertex v = vertex(i);
        for (const float value : {v.x, v.y, v.z})
            append(buffer, value);
    }
    for (const Triangle &t : triangles())
        for (const int corner : t)
            append(buffer, static_cast<std::uint16_t>(corner));
    const std::size_t joints = buffer.size(), weights = joints + std::size_t{4} * kVertices;
    buffer.resize(weights);
    for (int i = 0; i < 4 * kVertices; ++i)
        append(buffer, i % 4 == 0 ? 1.0F : 0.0F);
    buffer.resize((buffer.size() + 11) / 12 * 12);
    const auto view = [](std::size_t at, std::size_t length) {
        return R"({"buffer":0,"byteOffset":)" + std::to_string(at) + R"(,"byteLength":)" + std::to_string(length) + "}";
    };
    const std::size_t places = std::size_t{12} * kVertices;
    return R"({"asset":{"version":"2.0"},"scene":1,"scenes":[{"name":"other"},{"nodes":[0,1,2,4]}],)"
           R"("extensionsUsed":["KHR_node_visibility","ACME_light"],"extras":{"key":[1]},)"
           R"("nodes":[{"mesh":0,"skin":0,"scale":[100,1,1]},{"rotation":[0,0,0,2],"children":[3]},)"
           R"({"mesh":0,"weights":[0.5],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":4}}}},)"
           R"({"mesh":1,"extensions":{"KHR_node_visibility":{"visible":false}}},{"mesh":1}],)"
           R"("skins":[{"joints":[1]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3},)"
           R"("indices":1,"targets":[{"POSITION":0}]}]},{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":0}]}],)"
           R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":25},)"
           R"({"bufferView":1,"componentType":5123,"type":"SCALAR","count":96},)"
           R"({"bufferView":2,"componentType":5121,"type":"VEC4","count":25},)"
           R"({"bufferView":3,"componentType":5126,"type":"VEC4","count":25},)"
           R"({"bufferView":0,"componentType":5126,"type":"VEC3","count":2}],"bufferViews":[)" +
           view(0, places) + "," + view(places, joints - places) + "," + view(joints, weights - joints) + "," +
           view(weights, std::size_t{16} * kVertices) + R"(],"buffers":[{"byteLength":)" +
           std::to_string(buffer.size()) + R"(,"uri":"data:application/octet-stream;base64,)" + base64(buffer) +
           "\"}]}";
}

} // namespace

std::vector<HonestFile> honest_clouds() {
    return {{"intensities", Format::ptx, ptx(false)},
            {"colours", Format::ptx, ptx(true)},
            {"floats", Format::e57, e57(false)},
            {"integers and floats", Format::e57, e57(true)},
            {"format 3", Format::las, las(false)},
            {"format 7", Format::las, las(true)},
            {"records", Format::las, las_with_records()},
            {"bytes behind", Format::las, las(false) + std::string(68, '\1'), 68},
            {"format 3", Format::laz, laz(false)},
            {"format 7", Format::laz, laz(true)},
            {"version 3", Format::spz, spz()},
            {"ascii", Format::pcd_ascii, pcd_ascii()},
            {"packed colours", Format::pcd_ascii, pcd_packed()},
            {"binary", Format::pcd_binary, pcd_binary(false)},
            {"compressed", Format::pcd_binary, pcd_binary(true)},
            {"plain", Format::table, table(Table::plain)},
            {"named", Format::table, table(Table::named)},
            {"counted", Format::table, table(Table::counted)},
            {"degrees", Format::table, table(Table::degrees)},
            {"labels", Format::table, table(Table::labels)},
            {"text", Format::gltf, gltf(false)},
            {"scene", Format::gltf, gltf_scene()},
            {"binary", Format::gltf, gltf(true)}};
}

} // namespace pbm::mutants
