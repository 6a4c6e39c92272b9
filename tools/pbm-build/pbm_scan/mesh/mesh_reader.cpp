#include "pbm_scan/mesh/mesh_reader.h"

#include "pbm_scan/mesh/mesh_text.h"
#include "pbm_scan/mesh/vertex_copies.h"
#include "pbm_scan/surface/polygon.h"
#include "pbm_scan/text/text_lines.h"
#include "system/processes/child_process.h"

#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>
#include <utility>

namespace pbm::build {
namespace {

using OpenMesh::EdgeHandle;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;
// The child process sends blocks, each with a head that names its part.
enum class Part : std::uint32_t { positions, triangles, normals, materials, copies, summary };

struct BlockHead {
    Part part{};
    std::uint32_t size = 0; // bytes, at most kMaxBlock
};
constexpr std::size_t kMaxBlock = std::size_t{1} << 16;

// Result of OpenMesh: filled in the child, sent last.
struct Summary {
    std::uint64_t vertices = 0;
    std::uint64_t faces = 0;                // of three or more different corners
    std::uint64_t degenerate_triangles = 0; // of faces that are not degenerate as a whole
    std::uint64_t out_of_range = 0;         // not 0: an element named a vertex that does not exist
};

// Collects OpenMesh's elements in plain arrays: takes half the time of a half-edge mesh, and loses no face at
// non-manifold edges. Sends triangles whenever a block is full.
class ArrayImporter final : public OpenMesh::IO::BaseImporter {
  public:
    // Uses the positions of `text` where it has them, since OpenMesh's are floats.
    ArrayImporter(const ByteSink &send, const MeshText &text)
        : send_(send), exact_(text.positions), outlines_(text.outlines), material_runs_(text.material_runs),
          copies_(text.vertices, !text.material_runs.empty()) {}
    // Sends all data that was not sent yet.
    void send_rest(bool with_positions) {
        send(Part::triangles, triangles);
        if (with_positions)
            send(Part::positions, positions);
        send(Part::normals, copies_.normals());
        send(Part::materials, copies_.materials());
        send(Part::copies, copies_.copies());
        summary.vertices = positions.size();
        send(Part::summary, std::vector<Summary>{summary});
    }

    std::vector<glm::dvec3> positions;
    std::vector<glm::uvec3> triangles; // that were not sent yet
    Summary summary;

    VertexHandle add_vertex(const OpenMesh::Vec3f &p) override { return add(glm::dvec3(p[0], p[1], p[2])); }
    VertexHandle add_vertex(const OpenMesh::Vec3d &p) override { return add(glm::dvec3(p[0], p[1], p[2])); }
    VertexHandle add_vertex() override { return add(glm::dvec3(0.0)); }

    FaceHandle add_face(const VHandles &corners) override {
        corners_.clear();
        for (const VertexHandle v : corners)
            corners_.push_back(static_cast<std::uint32_t>(v.idx())); // negative: beyond all positions
        if (is_out_of_range(corners_))
            return FaceHandle();
        if (next_outline_ < outlines_.size() && outlines_[next_outline_].face == summary.faces) {
            corners_ = outlines_[next_outline_++].corners;
            if (is_out_of_range(corners_))
                return FaceHandle();
        }
        const std::size_t before = triangles.size();
        const std::size_t degenerate = triangulator_.triangulate(corners_, positions, triangles);
        // A polygon of three or more different corners counts, even if all its triangles are degenerate.
        if (triangles.size() == before && different(corners_) < 3)
            return FaceHandle();
        while (next_run_ < material_runs_.size() && material_runs_[next_run_].first_face <= summary.faces)
            material_ = material_runs_[next_run_++].material;
        copies_.apply(corners_, material_, std::span(triangles).subspan(before));
        summary.degenerate_triangles += degenerate;
        ++summary.faces;
        if (triangles.size() * sizeof(glm::uvec3) >= kMaxBlock - kMaxCorners * sizeof(glm::uvec3)) {
            send(Part::triangles, triangles);
            triangles.clear();
        }
        return FaceHandle(static_cast<int>(summary.faces) - 1);
    }

    void set_normal(VertexHandle vertex, const OpenMesh::Vec3f &n) override {
        const auto index = static_cast<std::uint32_t>(vertex.idx());
        if (!is_out_of_range({&index, 1}))
            copies_.add_normal(index, {n[0], n[1], n[2]});
    }

    void set_normal(VertexHandle vertex, const OpenMesh::Vec3d &n) override { set_normal(vertex, OpenMesh::Vec3f(n)); }
    size_t n_vertices() const override { return positions.size(); }
    size_t n_faces() const override { return summary.faces; }
    size_t n_edges() const override { return 0; }

    // Ignored elements.
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
        const std::size_t index = positions.size();
        positions.push_back(index < exact_.size() ? exact_[index] : position);
        return VertexHandle(static_cast<int>(positions.size()) - 1);
    }
    bool is_out_of_range(std::span<const std::uint32_t> vertices) {
        const bool out =
            std::any_of(vertices.begin(), vertices.end(), [this](auto v) { return v >= positions.size(); });
        summary.out_of_range |= out ? 1 : 0;
        return out;
    }

    template <class T> void send(Part part, const std::vector<T> &values) {
        static_assert(std::is_trivially_copyable_v<T>);
        constexpr std::size_t kAtOnce = kMaxBlock / sizeof(T);
        for (std::size_t i = 0; i < values.size(); i += kAtOnce) {
            const std::size_t size = std::min(kAtOnce, values.size() - i) * sizeof(T);
            const BlockHead head{part, static_cast<std::uint32_t>(size)};
            send_({reinterpret_cast<const std::uint8_t *>(&head), sizeof head});
            send_({reinterpret_cast<const std::uint8_t *>(values.data() + i), size});
        }
    }

    const ByteSink &send_;
    std::span<const glm::dvec3> exact_;
    std::span<const FaceOutline> outlines_; // instead of what OpenMesh makes of these faces
    std::size_t next_outline_ = 0;
    PolygonTriangulator triangulator_;
    std::span<const MaterialRun> material_runs_;
    std::size_t next_run_ = 0;
    std::uint16_t material_ = 0; // of the current face
    VertexCopies copies_;
    std::vector<std::uint32_t> corners_; // of the current face
};

// Reassembles the blocks of the child to arrays. The data is untrusted: memory of the child may be corrupt.
class BlockReader {
  public:
    // `may_weld`: welding may make facets degenerate. `with_positions`: the child sends positions too.
    BlockReader(const MeshText &text, bool may_weld, bool with_positions, const std::function<void(double)> &progress)
        : text_(text), may_weld_(may_weld), with_positions_(with_positions), progress_(progress) {}

    // Takes the next bytes, split anywhere.
    Status take(ByteView bytes) {
        while (!bytes.empty()) {
            const std::size_t wanted = in_block_ ? head_.size : sizeof head_;
            const std::size_t count = std::min(bytes.size(), wanted - gathered_.size());
            gathered_.insert(gathered_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
            bytes = bytes.subspan(count);
            if (gathered_.size() != wanted)
                continue;
            if (in_block_) {
                if (Status status = block(); !status)
                    return status;
            } else {
                std::memcpy(&head_, gathered_.data(), sizeof head_);
                if (head_.size == 0 || head_.size > kMaxBlock || complete_)
                    return broken();
            }
            in_block_ = !in_block_;
            gathered_.clear();
        }
        return {};
    }

    // Verifies the result after the last bytes.
    Status check() const {
        if (!complete_ || summary.out_of_range != 0)
            return broken();
        const bool vertices_agree = summary.vertices == (with_positions_ ? positions.size() : text_.vertices);
        const bool faces_agree = may_weld_ ? summary.faces <= text_.faces : summary.faces == text_.faces;
        if (!vertices_agree || !faces_agree || triangles.size() + summary.degenerate_triangles > text_.triangles)
            return bad_input("OpenMesh found " + std::to_string(summary.vertices) + " vertices and " +
                             std::to_string(summary.faces) + " faces where the file says " +
                             std::to_string(text_.vertices) + " and " + std::to_string(text_.faces) +
                             "; convert the scan to PLY");
        const std::uint64_t vertices = summary.vertices + copies.size();
        const auto valid = [&](const glm::uvec3 &t) { return t.x < vertices && t.y < vertices && t.z < vertices; };
        if (!std::all_of(triangles.begin(), triangles.end(), valid) ||
            !std::all_of(copies.begin(), copies.end(), [&](auto vertex) { return vertex < summary.vertices; }) ||
            normals.size() > vertices || materials.size() > vertices)
            return broken();
        return {};
    }

    std::vector<glm::dvec3> positions;
    std::vector<glm::uvec3> triangles;
    std::vector<glm::vec3> normals; // of the vertices, then of the copies
    std::vector<std::uint16_t> materials;
    std::vector<std::uint32_t> copies; // the vertex of each
    Summary summary;

  private:
    Status block() {
        const std::uint64_t vertices = with_positions_ ? 3 * text_.faces : text_.vertices;
        switch (head_.part) {
        case Part::positions: return with_positions_ ? append(positions, vertices) : broken();
        case Part::normals: return append(normals, vertices, 3 * text_.triangles);
        case Part::materials: return append(materials, vertices, 3 * text_.triangles);
        case Part::copies: return append(copies, 0, 3 * text_.triangles);
        case Part::triangles:
            if (progress_ && text_.triangles != 0)
                progress_(0.3 + 0.7 * static_cast<double>(triangles.size()) / static_cast<double>(text_.triangles));
            return append(triangles, text_.triangles);
        case Part::summary:
            if (gathered_.size() != sizeof summary)
                return broken();
            std::memcpy(&summary, gathered_.data(), sizeof summary);
            complete_ = true;
            return {};
        }
        return broken();
    }

    // At most `expected` values, and `more` for copies.
    template <class T> Status append(std::vector<T> &values, std::uint64_t expected, std::uint64_t more = 0) const {
        const std::size_t count = gathered_.size() / sizeof(T), before = values.size();
        if (gathered_.size() % sizeof(T) != 0 || count > expected + more - before)
            return broken();
        if (before == 0)
            values.reserve(expected);
        values.resize(before + count);
        std::memcpy(values.data() + before, gathered_.data(), gathered_.size());
        return {};
    }

    static Error broken() { return bad_input("OpenMesh went astray in this file; convert the scan to PLY"); }

    const MeshText &text_;
    bool may_weld_, with_positions_;
    const std::function<void(double)> &progress_;
    BlockHead head_;
    std::vector<std::uint8_t> gathered_; // a head, or a block
    bool in_block_ = false, complete_ = false;
};

// Runs in the child.
Status import(MeshText &text, MeshFormat format, const ByteSink &send) {
    ArrayImporter importer(send, text);
    std::istringstream in(std::move(text.for_openmesh));
    OpenMesh::IO::Options wanted(OpenMesh::IO::Options::VertexNormal);
    if (text.binary)
        wanted += OpenMesh::IO::Options::Binary;
    bool ok = false;
    switch (format) {
    case MeshFormat::obj: ok = OpenMesh::IO::OBJReader().read(in, importer, wanted); break;
    case MeshFormat::off: ok = OpenMesh::IO::OFFReader().read(in, importer, wanted); break;
    case MeshFormat::stl: ok = OpenMesh::IO::STLReader().read(in, importer, wanted); break;
    }
    if (!ok)
        return bad_input("OpenMesh cannot read the file; convert the scan to PLY");
    importer.send_rest(text.binary);
    return {};
}

// OpenMesh reads at least 20 MB/s and needs less than ten bytes per byte of text.
ChildLimits limits(std::size_t file_size) {
    const ChildLimits least;
    constexpr std::size_t kBytesPerSecond = 500'000, kMemoryPerByte = 24;
    const auto seconds = static_cast<unsigned>(std::min<std::size_t>(file_size / kBytesPerSecond, 1'000'000));
    return {.cpu_seconds = least.cpu_seconds + seconds,
            .wall_seconds = least.wall_seconds + 4 * seconds,
            .memory = least.memory + kMemoryPerByte * file_size};
}

Status import_in_child(MeshText &text, MeshFormat format, BlockReader &reader) {
    const char *name = format == MeshFormat::obj ? "OBJ" : format == MeshFormat::off ? "OFF" : "STL";
    const ChildTask task{.name = std::string("OpenMesh's ") + name + " reader",
                         .advice = "convert the scan to PLY",
                         .limits = limits(text.for_openmesh.size()),
                         .work = [&](const ByteSink &send) { return import(text, format, send); },
                         .receive = [&](ByteView bytes) { return reader.take(bytes); }};
    if (Status status = run_in_child(task); !status)
        return status;
    return reader.check();
}

void take_normals(BlockReader &found, MeshText &text, Surface &surface) {
    std::vector<glm::vec3> &normals = text.normals.empty() ? found.normals : text.normals;
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
    std::string note = found.copies.empty() ? "normals" : "each corner has its own";
    if (absent != 0)
        note += "; " + std::to_string(absent) + " vertices have none: taken from their faces";
    surface.report.push_back({"normals", Fate::kept, std::move(note)});
    surface.normals = std::move(normals);
}

// Gives copies of vertices their places and colours.
void take_copies(const BlockReader &found, MeshText &text, Surface &surface) {
    surface.vertex_copies = found.copies.size();
    for (const std::uint32_t vertex : found.copies) {
        surface.positions.push_back(surface.positions[vertex]);
        if (!text.colours.empty())
            text.colours.push_back(text.colours[vertex]);
    }
}

// Returns the materials that the faces use, the default one first, and replaces the numbers in `text` by theirs.
// Without any that a material file defines, faces have none.
std::vector<Material> find_materials(MeshText &text, const ReadOptions &options) {
    std::vector<Material> used{options.default_material};
    std::vector<std::uint16_t> numbers(std::size_t{kNoMaterial} + 1, 0); // those of names
    for (std::size_t i = 0; i < text.materials.size(); ++i) {
        const auto named =
            std::find_if(options.materials.begin(), options.materials.end(),
                         [&](const NamedMaterial &material) { return material.name == text.materials[i]; });
        if (named == options.materials.end())
            continue;
        const auto same = std::find(used.begin(), used.end(), named->material);
        numbers[i] = static_cast<std::uint16_t>(same - used.begin());
        if (same == used.end())
            used.push_back(named->material);
    }
    if (used.size() == 1)
        text.material_runs.clear();
    for (MaterialRun &run : text.material_runs)
        run.material = numbers[run.material];
    if (!text.material_runs.empty() && text.material_runs.front().first_face > 0)
        text.material_runs.insert(text.material_runs.begin(), MaterialRun{});
    return used;
}

// More materials than a model holds become colours of vertices.
void take_materials(const BlockReader &found, const std::vector<Material> &materials, Surface &surface) {
    if (materials.size() == 1)
        return;
    std::vector<std::uint16_t> of_vertices = found.materials;
    of_vertices.resize(surface.positions.size(), 0);
    std::vector<std::uint16_t> numbers(materials.size(), kNoMaterial); // of those that a vertex has
    for (std::uint16_t &material : of_vertices) {
        material = material == kNoMaterial ? 0 : material;
        if (numbers[material] == kNoMaterial) {
            numbers[material] = static_cast<std::uint16_t>(surface.materials.size());
            surface.materials.push_back(materials[material]);
        }
    }
    if (surface.materials.size() <= kMaxMaterials) {
        for (const std::uint16_t material : of_vertices)
            surface.material_ids.push_back(static_cast<std::uint8_t>(numbers[material]));
        return;
    }
    const std::string count =
        std::to_string(surface.materials.size()) + " of them, a model has " + std::to_string(kMaxMaterials);
    surface.materials.clear();
    if (!surface.colours.empty()) {
        surface.report.push_back({"materials", Fate::dropped, count + "; the vertices have colours of their own"});
        return;
    }
    for (const std::uint16_t material : of_vertices)
        surface.colours.push_back(materials[material].colour);
    surface.report.push_back({"materials", Fate::converted, count + ": their colours are those of the points"});
}

// Removes the lines of `mtllib` where its materials are read.
void name_materials(MeshText &text, const ReadOptions &options) {
    if (!options.materials.empty())
        std::erase_if(text.report, [](const auto &line) { return line.name.starts_with(kMaterialsLine); });
}

// OBJ and OFF: 0..1 or 0..255.
void take_colours(const MeshText &text, Surface &surface) {
    float highest = 0;
    for (const glm::vec3 &c : text.colours)
        highest = std::max(highest, std::max(c.x, std::max(c.y, c.z)));
    if (text.colours.empty())
        return;
    const bool of_faces = !text.colour_note.empty();
    const char *name = of_faces ? "face colours" : "vertex colours";
    if (!(highest <= 255.0F)) {
        surface.report.push_back({name, Fate::dropped, "values above 255 are no colours"});
        return;
    }
    const float factor = highest <= 1.0F ? 255.0F : 1.0F;
    surface.colours.reserve(text.colours.size());
    for (const glm::vec3 &c : text.colours)
        surface.colours.push_back(colour_bytes(c, factor));
    surface.report.push_back(of_faces ? AttributeReport{name, Fate::converted, text.colour_note}
                                      : AttributeReport{name, Fate::kept, "sRGB, 8 bits"});
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
    const bool stl = format == MeshFormat::stl;
    const std::vector<Material> materials = find_materials(*text, options);
    name_materials(*text, options);
    BlockReader found(*text, stl, text->binary, options.progress);
    if (const Status status = import_in_child(*text, format, found); !status)
        return status.error();
    if (options.progress)
        options.progress(1.0);

    Surface surface;
    surface.positions = std::move(text->binary ? found.positions : text->positions);
    surface.triangles = std::move(found.triangles);
    surface.dropped_triangles =
        text->dropped_triangles + found.summary.degenerate_triangles + (stl ? text->faces - found.summary.faces : 0);
    surface.has_facets = stl;
    surface.report.push_back({"positions", Fate::kept, stl ? "equal corners welded" : ""});
    if (text->faces != 0 || text->dropped_triangles != 0)
        surface.report.push_back({"faces", Fate::kept, "polygons as triangles"});
    surface.report.insert(surface.report.end(), text->report.begin(), text->report.end());
    take_copies(found, *text, surface);
    take_normals(found, *text, surface);
    take_colours(*text, surface);
    take_materials(found, materials, surface);
    return finished(std::move(surface), options);
}

} // namespace pbm::build
