#include "pbm_scan/mesh_reader.h"

#include "pbm_scan/mesh_text.h"

#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <OpenMesh/Core/System/omstream.hh>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <istream>
#include <mutex>
#include <streambuf>
#include <utility>

namespace pbm::build {
namespace {

using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;
using Fate = AttributeReport::Fate;

// Takes what OpenMesh reads into plain arrays: half the time of a half-edge mesh, and no face is lost at non-manifold
// edges.
class ArrayImporter final : public OpenMesh::IO::BaseImporter {
  public:
    std::vector<glm::dvec3> positions;
    std::vector<glm::uvec3> triangles;
    std::vector<glm::vec3> normal_sums; // of the unit normals of a vertex's corners
    std::vector<glm::vec3> first_normals;
    bool normals_differ = false;
    bool out_of_range = false;
    std::size_t faces = 0;                // of three or more different corners
    std::size_t degenerate_triangles = 0; // of faces that are not degenerate as a whole

    VertexHandle add_vertex(const OpenMesh::Vec3f &p) override { return add(glm::dvec3(p[0], p[1], p[2])); }
    VertexHandle add_vertex(const OpenMesh::Vec3d &p) override { return add(glm::dvec3(p[0], p[1], p[2])); }
    VertexHandle add_vertex() override { return add(glm::dvec3(0.0)); }
    FaceHandle add_face(const VHandles &corners) override;
    void set_normal(VertexHandle vertex, const OpenMesh::Vec3f &n) override;
    void set_normal(VertexHandle vertex, const OpenMesh::Vec3d &n) override { set_normal(vertex, OpenMesh::Vec3f(n)); }
    size_t n_vertices() const override { return positions.size(); }
    size_t n_faces() const override { return faces; }
    size_t n_edges() const override { return 0; }

    // Nothing else is asked of OpenMesh.
    HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
    FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f> &) override {}
    void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f> &) override {}
    void set_face_texindex(FaceHandle, int) override {}
    void set_point(VertexHandle, const OpenMesh::Vec3f &) override {}
    void set_halfedge(VertexHandle, HalfedgeHandle) override {}
    void set_color(VertexHandle, const OpenMesh::Vec3uc &) override {}
    void set_color(VertexHandle, const OpenMesh::Vec4uc &) override {}
    void set_color(VertexHandle, const OpenMesh::Vec3f &) override {}
    void set_color(VertexHandle, const OpenMesh::Vec4f &) override {}
    void set_texcoord(VertexHandle, const OpenMesh::Vec2f &) override {}
    void set_texcoord(VertexHandle, const OpenMesh::Vec3f &) override {}
    void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f &) override {}
    void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f &) override {}
    void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo &) override {}
    void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo &) override {}
    void set_status(EdgeHandle, const OpenMesh::Attributes::StatusInfo &) override {}
    void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo &) override {}
    void set_next(HalfedgeHandle, HalfedgeHandle) override {}
    void set_face(HalfedgeHandle, FaceHandle) override {}
    void request_face_texcoords2D() override {}
    void set_color(EdgeHandle, const OpenMesh::Vec3uc &) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec4uc &) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec3f &) override {}
    void set_color(EdgeHandle, const OpenMesh::Vec4f &) override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3f &) override {}
    void set_normal(FaceHandle, const OpenMesh::Vec3d &) override {}
    void set_color(FaceHandle, const OpenMesh::Vec3uc &) override {}
    void set_color(FaceHandle, const OpenMesh::Vec4uc &) override {}
    void set_color(FaceHandle, const OpenMesh::Vec3f &) override {}
    void set_color(FaceHandle, const OpenMesh::Vec4f &) override {}
    void add_texture_information(int, std::string) override {}

  private:
    VertexHandle add(const glm::dvec3 &position) {
        positions.push_back(position);
        return VertexHandle(static_cast<int>(positions.size()) - 1);
    }
};

FaceHandle ArrayImporter::add_face(const VHandles &corners) {
    const auto bad = [this](VertexHandle v) {
        return v.idx() < 0 || static_cast<std::size_t>(v.idx()) >= positions.size();
    };
    if (std::any_of(corners.begin(), corners.end(), bad)) {
        out_of_range = true;
        return FaceHandle();
    }
    const std::size_t before = triangles.size();
    std::size_t degenerate = 0;
    for (std::size_t i = 2; i < corners.size(); ++i) {
        const glm::uvec3 t(corners[0].idx(), corners[i - 1].idx(), corners[i].idx());
        if (t.x != t.y && t.y != t.z && t.x != t.z)
            triangles.push_back(t);
        else
            ++degenerate;
    }
    if (triangles.size() == before)
        return FaceHandle();
    degenerate_triangles += degenerate;
    ++faces;
    return FaceHandle(static_cast<int>(faces) - 1);
}

void ArrayImporter::set_normal(VertexHandle vertex, const OpenMesh::Vec3f &n) {
    if (vertex.idx() < 0 || static_cast<std::size_t>(vertex.idx()) >= positions.size()) {
        out_of_range = true;
        return;
    }
    if (normal_sums.size() != positions.size()) {
        normal_sums.resize(positions.size(), glm::vec3(0.0F));
        first_normals.resize(positions.size(), glm::vec3(0.0F));
    }
    const glm::vec3 normal(n[0], n[1], n[2]);
    const float length = glm::length(normal);
    if (!(length > 0.0F) || !std::isfinite(length))
        return;
    glm::vec3 &first = first_normals[static_cast<std::size_t>(vertex.idx())];
    if (first == glm::vec3(0.0F))
        first = normal;
    normals_differ = normals_differ || first != normal;
    normal_sums[static_cast<std::size_t>(vertex.idx())] += normal / length;
}

// A text as a stream that can be rewound, without another copy of it.
class TextBuffer final : public std::streambuf {
  public:
    explicit TextBuffer(std::string &text) { setg(text.data(), text.data(), text.data() + text.size()); }

  protected:
    pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
        char *base = from == std::ios_base::beg ? eback() : from == std::ios_base::cur ? gptr() : egptr();
        if (offset < eback() - base || offset > egptr() - base)
            return pos_type(off_type(-1));
        setg(eback(), base + offset, egptr());
        return pos_type(gptr() - eback());
    }
    pos_type seekpos(pos_type position, std::ios_base::openmode mode) override {
        return seekoff(off_type(position), std::ios_base::beg, mode);
    }
};

// While it lives, OpenMesh says nothing: the checks have said it better. (Its streams leak when targets are exchanged.)
class Silence {
  public:
    Silence() { omerr().disable(), omlog().disable(); }
    ~Silence() { omerr().enable(), omlog().enable(); }
    Silence(const Silence &) = delete;
    Silence &operator=(const Silence &) = delete;
};

Status import(MeshText &text, MeshFormat format, ArrayImporter &importer) {
    static std::mutex one_at_a_time;
    const std::lock_guard lock(one_at_a_time);
    const Silence silence;
    TextBuffer buffer(text.for_openmesh);
    std::istream in(&buffer);
    OpenMesh::IO::Options wanted(OpenMesh::IO::Options::VertexNormal);
    if (text.binary)
        wanted += OpenMesh::IO::Options::Binary;
    bool ok = false;
    switch (format) {
    case MeshFormat::obj: ok = OpenMesh::IO::OBJReader().read(in, importer, wanted); break;
    case MeshFormat::off: ok = OpenMesh::IO::OFFReader().read(in, importer, wanted); break;
    case MeshFormat::stl: ok = OpenMesh::IO::STLReader().read(in, importer, wanted); break;
    }
    if (!ok || importer.out_of_range)
        return Error{ErrorCode::bad_input, 0, "OpenMesh cannot read the file; convert the scan to PLY"};
    return {};
}

// STL's facets may lose corners to each other when they are welded; nothing else may be missing.
Status compare(const MeshText &text, MeshFormat format, const ArrayImporter &importer) {
    const bool welded = format == MeshFormat::stl;
    if ((!welded && importer.positions.size() != text.vertices) ||
        (welded ? importer.faces > text.faces : importer.faces != text.faces))
        return Error{ErrorCode::bad_input, 0,
                     "OpenMesh found " + std::to_string(importer.positions.size()) + " vertices and " +
                         std::to_string(importer.faces) + " faces where the file says " +
                         std::to_string(text.vertices) + " and " + std::to_string(text.faces) +
                         "; convert the scan to PLY"};
    return {};
}

void take_normals(ArrayImporter &importer, MeshText &text, Surface &surface) {
    std::vector<glm::vec3> &normals = text.normals.empty() ? importer.normal_sums : text.normals;
    if (normals.empty())
        return;
    normals.resize(surface.positions.size(), glm::vec3(0.0F));
    std::size_t absent = 0;
    for (glm::vec3 &n : normals) {
        const float length = glm::length(n);
        if (!std::isfinite(length) || length < 1e-6F)
            n = glm::vec3(0.0F);
        absent += n == glm::vec3(0.0F) ? 1U : 0U;
    }
    if (absent == normals.size()) {
        surface.report.push_back({"normals", Fate::converted, "all are zero: estimated anew"});
        return;
    }
    std::string note = importer.normals_differ ? "each vertex has the mean of its corners" : "normals";
    if (absent != 0)
        note += "; " + std::to_string(absent) + " vertices have none: taken from their neighbours";
    surface.report.push_back({"normals", importer.normals_differ ? Fate::converted : Fate::kept, std::move(note)});
    surface.normals = std::move(normals);
}

// OBJ and OFF: 0..1 or 0..255.
void take_colours(const MeshText &text, Surface &surface) {
    float highest = 0;
    for (const glm::vec3 &c : text.colours)
        highest = std::max(highest, std::max(c.x, std::max(c.y, c.z)));
    if (text.colours.empty())
        return;
    if (!(highest <= 255.0F)) {
        surface.report.push_back({"vertex colours", Fate::dropped, "values above 255 are no colours"});
        return;
    }
    const float factor = highest <= 1.0F ? 255.0F : 1.0F;
    surface.colours.reserve(text.colours.size());
    for (const glm::vec3 &c : text.colours) {
        std::array<std::uint8_t, 3> bytes{};
        for (std::size_t i = 0; i < 3; ++i) {
            const float value = c[static_cast<int>(i)] * factor + 0.5F;
            bytes[i] = value >= 0.0F ? static_cast<std::uint8_t>(std::min(value, 255.0F)) : 0; // NaN: 0
        }
        surface.colours.push_back(bytes);
    }
    surface.report.push_back({"vertex colours", Fate::kept, "sRGB, 8 bits"});
}

Result<MeshText> check(std::span<const std::uint8_t> bytes, MeshFormat format) {
    switch (format) {
    case MeshFormat::obj: return check_obj(bytes);
    case MeshFormat::off: return check_off(bytes);
    case MeshFormat::stl: break;
    }
    return check_stl(bytes);
}

} // namespace

Result<Surface> read_mesh(std::span<const std::uint8_t> bytes, MeshFormat format, const ReadOptions &options) {
    Result<MeshText> text = check(bytes, format);
    if (!text)
        return text.error();
    if (options.progress)
        options.progress(0.3);
    ArrayImporter importer;
    if (const Status status = import(*text, format, importer); !status)
        return status.error();
    if (const Status status = compare(*text, format, importer); !status)
        return status.error();
    if (options.progress)
        options.progress(1.0);

    Surface surface;
    surface.positions = std::move(format == MeshFormat::stl ? importer.positions : text->positions);
    surface.triangles = std::move(importer.triangles);
    surface.dropped_triangles = text->dropped_triangles + importer.degenerate_triangles +
                                (format == MeshFormat::stl ? text->faces - importer.faces : 0);
    surface.report = {
        {"positions", AttributeReport::Fate::kept, format == MeshFormat::stl ? "equal corners welded" : ""},
        {"faces", AttributeReport::Fate::kept, "polygons as fans of triangles"}};
    surface.report.insert(surface.report.end(), text->report.begin(), text->report.end());
    take_normals(importer, *text, surface);
    take_colours(*text, surface);
    return finished(std::move(surface), options);
}

} // namespace pbm::build
