// A ledger of the formats: each optional part adds a line to the report of a file without it, or changes one. Names of
// parts, comments, and texts of headers that say nothing of the scan are no parts.
#include "pbm_scan/mesh/material_text.h"
#include "unit/scan/e57_files.h"
#include "unit/scan/readings.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::build;
using namespace pbm::test;
using nlohmann::json;
using Texts = std::initializer_list<const char *>;

std::vector<std::string> lines_of(const Surface &s) {
    std::vector<std::string> lines{"coordinate reference system: " + s.crs};
    for (const AttributeReport &line : s.report)
        lines.push_back(line.name + ": " + line.note);
    return lines;
}

// Whether a file with an optional part has a line that the file without it lacks.
void expect_line(const std::string &without, const std::string &with, std::string_view name, const std::string &part) {
    const std::vector<std::string> before = lines_of(surface(without, name)), after = lines_of(surface(with, name));
    const bool is_said = std::any_of(after.begin(), after.end(), [&](const std::string &line) {
        return std::find(before.begin(), before.end(), line) == before.end();
    });
    EXPECT_TRUE(is_said) << name << ": " << part;
}

template <class T> void put(std::string &file, std::size_t at, T value) {
    std::memcpy(file.data() + at, &value, sizeof value);
}

std::string ply(const std::string &vertex, const std::string &face = "", const std::string &element = "",
                const std::string &comment = "") {
    const auto property = [](const std::string &what) { return what.empty() ? "" : "property " + what + "\n"; };
    const auto value = [](const std::string &what) {
        return what.empty() ? "\n" : what.starts_with("list") ? " 1 0\n" : " 0.5\n";
    };
    std::string text = "ply\nformat ascii 1.0\n" + comment + "element vertex 3\nproperty float x\nproperty float y\n" +
                       "property float z\n" + property(vertex) +
                       "element face 1\nproperty list uchar int vertex_indices\n" + property(face) + element +
                       "end_header\n";
    for (const char *const place : {"0 0 0", "1 0 0", "0 1 0"})
        text += std::string(place) + value(vertex);
    return text + "3 0 1 2" + value(face) + (element.empty() ? "" : "1 0\n");
}

TEST(Ledger, EveryPartOfPlyHasALine) {
    const std::string base = ply("");
    for (const char *name : {"nx", "red", "alpha", "radius", "material_index", "confidence", "quality", "intensity",
                             "scalar_time", "s", "scale_0", "rot_0", "f_rest_0", "opacity", "two_sided", "vendor"})
        expect_line(base, ply(std::string("float ") + name), "scan.ply", name);
    expect_line(base, ply("list uchar int marks"), "scan.ply", "a list of vertices");
    for (const char *name : {"red", "alpha", "nx", "texnumber", "quality", "flags"})
        expect_line(base, ply("", std::string("float ") + name), "scan.ply", name);
    expect_line(base, ply("", "list uchar float texcoord"), "scan.ply", "texcoord");
    for (const char *name : {"edge", "camera", "tristrips", "range_grid", "material", "vendor"})
        expect_line(base, ply("", "", std::string("element ") + name + " 1\nproperty list uchar int values\n"),
                    "scan.ply", name);
    expect_line(base, ply("", "", "", "comment TextureFile no.png\n"), "scan.ply", "TextureFile");
    expect_line(base, base + "more", "scan.ply", "bytes behind");
}

TEST(Ledger, EveryStatementOfObjHasALine) {
    const std::string base = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (const char *line : {"v 0 0 1 0.5",
                             "v 0 0 1 0.5 0.5",
                             "v 0 0 1 1 0 0",
                             "v 0 0 1 1 0 0 0.5",
                             "vn 0 0 1",
                             "vt 0 0",
                             "vt 0 0 0.5",
                             "vp 0 0",
                             "p 1",
                             "l 1 2",
                             "g a",
                             "o a",
                             "mg 1 2",
                             "curv 0 1 1 2",
                             "curv2 1 2",
                             "surf 0 1 0 1 1",
                             "cstype bezier",
                             "deg 3",
                             "bmat u 1",
                             "step 1",
                             "parm u 0 1",
                             "trim 0 1 1",
                             "hole 0 1 1",
                             "scrv 0 1 1",
                             "sp 1",
                             "end",
                             "con 1 0 1 1",
                             "ctech cparm 1",
                             "stech cparma 1",
                             "bevel on",
                             "c_interp on",
                             "d_interp on",
                             "lod 3",
                             "shadow_obj a.obj",
                             "trace_obj a.obj",
                             "usemap a",
                             "maplib a.map",
                             "call a.obj",
                             "csh -ls",
                             "usemtl a",
                             "mtllib no.mtl",
                             "vendor 1",
                             "#MRGB ffffffff"})
        expect_line(base, base + line + "\n", "scan.obj", line);
    expect_line(base, base + "vn 0 0 1\nf 1//1 2//1 3//7\n", "scan.obj", "an index of a normal");
    expect_line(base, base + "vt 0 0\nf 1/1 2/1 3/7\n", "scan.obj", "an index of texture coordinates");
    expect_line(base, base.substr(0, base.size() - 1), "scan.obj", "an open end");
}

TEST(Ledger, EveryStatementOfMaterialsHasALine) {
    const auto lines = [](const std::string &statement) {
        std::vector<NamedMaterial> materials;
        std::vector<AttributeReport> report;
        read_materials("newmtl a\n" + statement + "\n", Material{}, materials, report);
        return report.size();
    };
    for (const char *statement :
         {"Kd 1 0 0",     "Ka 1 1 1",     "Ks 1 1 1",   "Ke 1 1 1",   "Tf 1 1 1",    "Ni 1.5",     "Ns 10",
          "illum 2",      "sharpness 9",  "d 0.5",      "Tr 0.5",     "d -halo 0.5", "refl a.png", "map_Ka a.png",
          "map_Ks a.png", "map_Ns a.png", "map_aat on", "disp a.png", "decal a.png", "Pr 1",       "Pm 1",
          "Ps 1",         "Pc 1",         "Pcr 1",      "aniso 1",    "anisor 1",    "vendor 1",   "Kd spectral a.rfl",
          "Kd xyz 1 1"})
        EXPECT_EQ(lines(statement), 1U) << statement;
    for (const char *option : {"-blendu off", "-blendv off", "-cc on", "-mm 0 1", "-t 1 1 1", "-texres 8", "-boost 2",
                               "-bm 1", "-imfchan r", "-type sphere"})
        EXPECT_EQ(lines(std::string("map_Kd ") + option + " a.png"), 1U) << option;
    for (const char *statement : {"bump a.png", "map_bump -bm 2 a.png", "norm a.png", "map_Ke a.png", "map_Pr a.png",
                                  "map_Pm a.png"}) // the image has a line
        EXPECT_EQ(lines(statement), 0U) << statement;
}

TEST(Ledger, EveryPartOfOffHasALine) {
    const auto off = [](const char *keyword, const std::string &vertex, const std::string &face) {
        return keyword + ("\n3 1 0\n0 0 0" + vertex + "\n1 0 0" + vertex + "\n0 1 0" + vertex + "\n3 0 1 2" + face) +
               "\n";
    };
    const std::string base = off("OFF", "", "");
    expect_line(base, off("NOFF", " 0 0 1", ""), "scan.off", "normals");
    expect_line(base, off("COFF", " 255 0 0", ""), "scan.off", "colours of vertices");
    expect_line(off("COFF", " 255 0 0 255", ""), off("COFF", " 255 0 0 90", ""), "scan.off", "opacity of vertices");
    expect_line(base, off("STOFF", " 0 0", ""), "scan.off", "texture coordinates");
    expect_line(base, off("OFF", " 7", ""), "scan.off", "further numbers");
    expect_line(base, off("OFF", "", " 7"), "scan.off", "an index of a colour");
    expect_line(base, off("OFF", "", " 255 0 0"), "scan.off", "colours of faces");
    expect_line(off("OFF", "", " 1.0 0 0 1.0"), off("OFF", "", " 1.0 0 0 0.5"), "scan.off", "opacity of faces");
    expect_line(base, base + "more\n", "scan.off", "text behind");
}

TEST(Ledger, EveryPartOfStlHasALine) {
    std::string base(84 + 50, '\0');
    base[80] = 1;
    put(base, 96, std::array<float, 9>{0, 0, 0, 1, 0, 0, 0, 1, 0});
    const auto changed = [&base](std::size_t at, const std::string &bytes) {
        return std::string(base).replace(at, bytes.size(), bytes);
    };
    expect_line(base, changed(132, "\1"), "scan.stl", "attribute bytes");
    expect_line(base, changed(132, "\1\x80"), "scan.stl", "attribute bytes of VisCAM");
    expect_line(base, changed(0, "COLOR=abcd"), "scan.stl", "COLOR= in the header");
    expect_line(changed(0, "COLOR=abcd"), changed(0, "COLOR=abcd,MATERIAL=abcdabcdabcd"), "scan.stl", "MATERIAL=");
    expect_line(base, base + "x", "scan.stl", "bytes behind");
    const std::string text =
        "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
        "endfacet\nendsolid\n";
    expect_line(text, std::string(text).insert(6, "color 1 0 0\n"), "scan.stl", "color");
}

TEST(Ledger, EveryPartOfGltfHasALine) {
    const json base = json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"materials":[{}],
        "accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":3}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,
        "uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})");
    const auto expect_said = [&base](const std::string &patch) {
        json changed = base;
        changed.merge_patch(json::parse(patch));
        expect_line(base.dump(), changed.dump(), "scan.gltf", patch);
    };
    for (
        const char *patch :
        {R"({"cameras":[{}]})", R"({"animations":[{}]})", R"({"skins":[{}]})", R"({"extras":{"key":1}})",
         R"({"extensionsUsed":["ACME_light"]})", R"({"extensions":{"ACME_light":{}}})",
         R"({"extensions":{"KHR_lights_punctual":{"lights":[]}}})",
         R"({"extensions":{"CESIUM_RTC":{"center":[1,2,3]}}})", R"({"scenes":[{"nodes":[0]},{"name":"other"}]})",
         R"({"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]},{"primitives":[]}]})",
         R"({"nodes":[{"mesh":0,"rotation":[0,0,0,2]}]})", R"({"nodes":[{"mesh":0,"extras":{}}]})",
         R"({"nodes":[{"mesh":0,"name":"part"}]})", R"({"cameras":[{}],"nodes":[{"mesh":0,"camera":0}]})",
         R"({"cameras":[{"type":"perspective","perspective":{"yfov":1}}],"nodes":[{"mesh":0,"camera":0}]})",
         R"({"nodes":[{"mesh":0,"extensions":{"KHR_lights_punctual":{"light":0}}}]})",
         R"({"nodes":[{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}}]})",
         R"({"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0},{"mesh":0,"extensions":{"KHR_node_visibility":{"visible":false}}}]})"})
        expect_said(patch);
    const auto primitive = [](const std::string &more) {
        return R"({"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0},{)" + more + "}]}]}";
    };
    for (const char *name :
         {"NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_1", "JOINTS_0", "WEIGHTS_0", "_ACME"})
        expect_said(primitive(std::string(R"("attributes":{"POSITION":0,")") + name + R"(":0})"));
    for (const char *more : {R"("attributes":{"POSITION":0,"COLOR_0":0})", R"("attributes":{"POSITION":0},"mode":1)",
                             R"("attributes":{})", R"("attributes":{"POSITION":0},"targets":[{"POSITION":0}])",
                             R"("attributes":{"POSITION":0},"targets":[{"POSITION":0,"TANGENT":0}])",
                             R"("attributes":{"POSITION":0},"extensions":{"KHR_materials_variants":{}})"})
        expect_said(primitive(more));
    for (const char *more :
         {R"("doubleSided":true)", R"("alphaMode":"BLEND")", R"("normalTexture":{})", R"("occlusionTexture":{})",
          R"("emissiveTexture":{})", R"("emissiveFactor":[1,0,0])",
          R"("pbrMetallicRoughness":{"metallicRoughnessTexture":{}})", R"("extensions":{"KHR_materials_unlit":{}})",
          R"("extensions":{"KHR_materials_pbrSpecularGlossiness":{}})",
          R"("extensions":{"KHR_materials_pbrSpecularGlossiness":{"specularGlossinessTexture":{}}})",
          R"("extensions":{"KHR_materials_specular":{"specularTexture":{}}})",
          R"("extensions":{"KHR_materials_specular":{"specularColorTexture":{}}})",
          R"("extensions":{"KHR_materials_clearcoat":{}})",
          R"("pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1]},"emissiveFactor":[1,0,0])"})
        expect_said(std::string(R"({"materials":[{)") + more + "}]}");
    const auto glb = [text = base.dump()](const std::string &chunks) {
        const std::string json_chunk = text + std::string((4 - text.size() % 4) % 4, ' ');
        return "glTF" + little_endian(2U) +
               little_endian(static_cast<std::uint32_t>(20 + json_chunk.size() + chunks.size())) +
               little_endian(static_cast<std::uint32_t>(json_chunk.size())) + "JSON" + json_chunk + chunks;
    };
    expect_line(glb(""), glb(little_endian(4U) + "ACMEdata"), "scan.glb", "a further chunk");
    expect_line(glb(""), glb("") + "x", "scan.glb", "bytes behind");
}

TEST(Ledger, EveryNodeOfE57HasALine) {
    const std::vector<double> zeros{0, 1, 2};
    const std::vector<std::int64_t> counts{0, 1, 2};
    const auto scan = [&](std::vector<E57Column> more, const std::string &elements = "") {
        more.insert(more.begin(), {e57_floats("cartesianX", zeros), e57_floats("cartesianY", zeros),
                                   e57_floats("cartesianZ", zeros)});
        E57ScanText text;
        text.columns = std::move(more);
        text.more = elements;
        return text;
    };
    const std::string base = e57_file({scan({})});
    for (const char *name : {"intensity", "isIntensityInvalid", "isColorInvalid", "colorRed", "rowIndex", "columnIndex",
                             "timeStamp", "isTimeStampInvalid", "returnIndex", "returnCount", "cartesianInvalidState",
                             "sphericalRange", "sphericalInvalidState", "nor:normalX", "acme:rain"})
        expect_line(base, e57_file({scan({e57_integers(name, 0, 2, counts)})}, "", R"(xmlns:nor="n" xmlns:acme="a")"),
                    "scan.e57", name);
    for (const char *name : {"guid",
                             "name",
                             "originalGuids",
                             "description",
                             "sensorVendor",
                             "sensorModel",
                             "sensorSerialNumber",
                             "sensorHardwareVersion",
                             "sensorSoftwareVersion",
                             "sensorFirmwareVersion",
                             "temperature",
                             "relativeHumidity",
                             "atmosphericPressure",
                             "acquisitionStart",
                             "acquisitionEnd",
                             "indexBounds",
                             "cartesianBounds",
                             "sphericalBounds",
                             "intensityLimits",
                             "pointGroupingSchemes",
                             "vendor"})
        expect_line(base, e57_file({scan({}, std::string("<") + name + "/>")}), "scan.e57", name);
    expect_line(base, e57_file({scan({}, "<pose><translation><x>1</x></translation></pose>")}), "scan.e57", "pose");
    for (const char *element :
         {"<coordinateMetadata>EPSG:1</coordinateMetadata>", "<images2D><vectorChild/></images2D>",
          "<creationDateTime/>", "<e57LibraryVersion/>", "<guid/>", "<vendor/>"})
        expect_line(base, e57_file({scan({})}, element), "scan.e57", element);
    expect_line(base, e57_file({scan({})}, "", R"(xmlns:acme="a")"), "scan.e57", "an extension");
}

// A point of a format of LAS 1.4, behind these records.
std::string las(unsigned format, const std::string &records = "", const std::string &behind = "") {
    constexpr std::array<std::size_t, 11> kSizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
    std::string file = "LASF" + std::string(371, '\0') + records + std::string(kSizes.at(format), '\0') + behind;
    put(file, 24, std::array<std::uint8_t, 2>{1, 4});
    put(file, 94, std::uint16_t{375});
    put(file, 96, static_cast<std::uint32_t>(375 + records.size()));
    put(file, 100, std::uint32_t{records.empty() ? 0U : 1U});
    put(file, 104, static_cast<std::uint8_t>(format));
    put(file, 105, static_cast<std::uint16_t>(kSizes.at(format)));
    put(file, 107, std::uint32_t{1});
    put(file, 131, std::array<double, 3>{1, 1, 1});
    put(file, file.size() - behind.size() - kSizes.at(format), std::int32_t{1});
    put(file, 179, std::array<double, 2>{1, 1});
    if (!behind.empty()) { // extended records
        put(file, 235, static_cast<std::uint64_t>(file.size() - behind.size()));
        put(file, 243, std::uint32_t{1});
    }
    return file;
}

TEST(Ledger, EveryPartOfLasHasALine) {
    for (unsigned format = 0; format <= 10; ++format) { // each byte of a record, if it is not 0
        const std::string base = las(format);
        for (std::size_t at = 377 + 10; at < base.size(); ++at) {
            std::string changed = base;
            changed[at] = 1;
            expect_line(base, changed, "scan.las",
                        "byte " + std::to_string(at - 375) + " of format " + std::to_string(format));
        }
    }
    const std::string base = las(3);
    struct Record {
        const char *user;
        int id;
        std::string content;
    };
    const std::string crs = R"(PROJCS["a",UNIT["metre",1]])", keys("\1\0\1\0\0\0\1\0\0\x0c\0\0\1\0\x2b\x0b", 16);
    for (const Record &r : {Record{"LASF_Projection", 2112, crs},
                            {"LASF_Projection", 2111, "PARAM_MT[]"},
                            {"LASF_Projection", 34735, keys},
                            {"LASF_Spec", 0, "classes"},
                            {"LASF_Spec", 3, "text"},
                            {"LASF_Spec", 7, "void"},
                            {"LASF_Spec", 100, "waveform"},
                            {"copc", 1, "tree"},
                            {"LAStools", 10, "tiles"},
                            {"vendor", 123, "data"}}) {
        std::string head(54, '\0');
        head.replace(2, std::strlen(r.user), r.user);
        put(head, 18, static_cast<std::uint16_t>(r.id));
        put(head, 20, static_cast<std::uint16_t>(r.content.size()));
        const std::string name = r.user + (" " + std::to_string(r.id));
        expect_line(base, las(3, head + r.content), "scan.las", name);
        expect_line(base, las(3, "", head + std::string(6, '\0') + r.content), "scan.las", name + " behind the points");
    }
    expect_line(base, las(3, "", std::string(59, '\0')), "scan.las", "a record that is cut short");
    expect_line(base, base + "more", "scan.las", "bytes behind");
    expect_line(base, base + base.substr(375), "scan.las", "a record behind");
}

TEST(Ledger, EveryPartOfOtherCloudsHasALine) {
    const auto ptx = [](const char *shift, const char *more) {
        return std::string("2\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n") + shift + " 1\n1 2 3" +
               more + "\n4 5 6" + more + "\n";
    };
    expect_line(ptx("0 0 0", ""), ptx("0 0 0", " 0.5"), "scan.ptx", "intensities");
    expect_line(ptx("0 0 0", " 0.5"), ptx("0 0 0", " 0.5 1 2 3"), "scan.ptx", "colours");
    expect_line(ptx("0 0 0", ""), ptx("1 0 0", ""), "scan.ptx", "a matrix");
    const auto pcd = [](const std::string &field, const char *count, const char *viewpoint, int rows) {
        const bool has_one = !field.empty();
        const auto more = [&](const char *text) { return has_one ? std::string(" ") + text : ""; };
        std::string text = "# .PCD v0.7\nFIELDS x y z" + more(field.c_str()) + "\nSIZE 4 4 4" + more("4") +
                           "\nTYPE F F F" + more("F") + "\nCOUNT 1 1 1" + more(count) + "\nWIDTH 2\nHEIGHT " +
                           std::to_string(rows) + "\nVIEWPOINT " + viewpoint + "\nDATA ascii\n";
        for (int i = 0; i < 2 * rows; ++i)
            text += "1 2 " + std::to_string(i) + more(*count == '2' ? "7 8" : *count == '1' ? "7" : "") + "\n";
        return text;
    };
    const char *const kIdentity = "0 0 0 1 0 0 0";
    const std::string base = pcd("", "1", kIdentity, 1);
    for (const char *name : {"rgb", "rgba", "normal_x", "intensity", "curvature", "label", "r", "i", "vendor"})
        expect_line(base, pcd(name, "1", kIdentity, 1), "scan.pcd", name);
    for (const char *count : {"0", "2"})
        expect_line(base, pcd("histogram", count, kIdentity, 1), "scan.pcd", count);
    for (const char *viewpoint : {"0 0 9 1 0 0 0", "0 0 0 0.5 0.5 0.5 0.5", "0 0 0"})
        expect_line(base, pcd("", "1", viewpoint, 1), "scan.pcd", viewpoint);
    expect_line(base, pcd("", "1", kIdentity, 2), "scan.pcd", "rows and columns");
    expect_line(base, base + "more\n", "scan.pcd", "text behind");
    for (const char *column : {"nx", "red", "rgb", "intensity", "classification", "gps_time", "vendor"})
        expect_line("x,y,z\n1,2,3\n4,5,6\n", std::string("x,y,z,") + column + "\n1,2,3,7\n4,5,6,8\n", "scan.csv",
                    column);
    for (const char *text : {"x,y,z\nm,m,m\n1,2,3\n4,5,6\n", "x,y,z\n1,2,3\n4,5,6 # end\n", "x,y,z\n1,2,3\n4,5,6"})
        expect_line("x,y,z\n1,2,3\n4,5,6\n", text, "scan.csv", text);
    const auto spz = [](char degree, char flags) {
        return "NGSP" + little_endian(3U) + little_endian(1U) + std::string{degree, 12, flags, 0} +
               std::string(static_cast<std::size_t>(20 + 3 * degree * (degree + 2)), '\xFF');
    };
    expect_line(spz(0, 0), spz(1, 0), "scan.spz", "harmonics");
    expect_line(spz(0, 0), spz(0, 1), "scan.spz", "flags");
    expect_line(spz(0, 0), spz(0, 0) + "x", "scan.spz", "bytes behind");
}

} // namespace
