#include "pbm_build/mesh_repair/fill_holes.h"

#include "pbm_build/hole_filling/fair_patch.h"
#include "pbm_build/images/texture_pyramid.h"
#include "pbm_build/surface/face_normal.h"
#include "pbm_build/surface/material_colours.h"
#include "pbm_scan/surface/refusal.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace pbm::build {
namespace {

using Edge = std::array<std::uint32_t, 2>;
constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

// The corners of faces at the vertices of some loops.
class CornersAtLoops {
  public:
    CornersAtLoops(const WeldedMesh &mesh, std::span<const std::vector<std::uint32_t>> loops) {
        std::vector<bool> is_wanted(mesh.positions.size());
        for (const std::vector<std::uint32_t> &loop : loops)
            for (const std::uint32_t vertex : loop)
                is_wanted[vertex] = true;
        for (HalfEdge h = 0; h < mesh.mates.size(); ++h)
            if (is_wanted[mesh.from(h)])
                corners_.push_back({mesh.from(h), h});
        std::sort(corners_.begin(), corners_.end(), [](const Corner &a, const Corner &b) {
            return std::pair(a.vertex, a.side) < std::pair(b.vertex, b.side);
        });
    }

    struct Corner {
        std::uint32_t vertex;
        HalfEdge side; // begins there
    };
    std::span<const Corner> at(std::uint32_t vertex) const {
        const auto [begin, end] =
            std::equal_range(corners_.begin(), corners_.end(), Corner{vertex, 0},
                             [](const Corner &a, const Corner &b) { return a.vertex < b.vertex; });
        return {begin, end};
    }

  private:
    std::vector<Corner> corners_;
};

class HoleFiller {
  public:
    HoleFiller(Surface &surface, const WeldedMesh &mesh, const Sheets &sheets)
        : surface_(surface), mesh_(mesh), sheets_(sheets), place_of_(mesh.positions.size(), kNowhere),
          first_new_(static_cast<std::uint32_t>(surface.first_point())), has_images_(!surface.texture_ids.empty()),
          has_face_colours_(!surface.face_colours.empty() && !has_images_),
          has_colours_(!surface.colours.empty() || has_face_colours_) {}

    Result<FilledHoles> run(const Borders &borders, std::size_t max_edges) {
        FilledHoles filled{.loops = borders.loops.size()};
        std::vector<const Loop *> loops;
        std::vector<std::vector<std::uint32_t>> rims;
        for (const Loop &loop : borders.loops)
            if (loop.sides.size() > max_edges) {
                const std::uint64_t edges = loop.sides.size();
                filled.shortest_longer = filled.longer++ == 0 ? edges : std::min(filled.shortest_longer, edges);
            } else if (loop.open_sides == loop.sides.size()) {
                loops.push_back(&loop);
                rims.push_back(vertices_of(loop));
            }
        const CornersAtLoops corners(mesh_, rims);
        for (std::size_t i = 0; i < loops.size(); ++i) {
            if (!fill(loops[i]->sides, rims[i], corners))
                continue;
            ++filled.filled;
            if (surface_.positions.size() + new_vertices_.size() > kMaxVertices ||
                surface_.triangles.size() + new_triangles_.size() > kMaxMeshFaces)
                return too_large("--fill-holes " + std::to_string(max_edges) + " makes more than " +
                                 std::to_string(kMaxMeshFaces) + " faces; choose fewer edges");
        }
        filled.faces = new_triangles_.size();
        filled.vertices = made_;
        append();
        return filled;
    }

  private:
    struct NewVertex {
        glm::dvec3 position;
        std::uint32_t source; // the vertex of the surface that it takes attributes from
        bool is_copy;         // of `source`, for another colour
        Rgb8 colour;
    };
    struct Unit { // of a patch
        glm::dvec3 origin{0};
        double scale = 1;
        glm::dvec3 from_model(const glm::dvec3 &p) const { return (p - origin) / scale; }
        glm::dvec3 to_model(const glm::dvec3 &p) const { return p * scale + origin; }
    };

    bool is_turned(HalfEdge side) const { return sheets_.turned[side / 3] != 0; }

    // Where the new faces' edges begin.
    std::vector<std::uint32_t> vertices_of(const Loop &loop) const {
        std::vector<std::uint32_t> vertices;
        vertices.reserve(loop.sides.size());
        for (const HalfEdge side : loop.sides)
            vertices.push_back(is_turned(side) ? mesh_.from(side) : mesh_.to(side));
        return vertices;
    }

    Unit unit_of(std::span<const std::uint32_t> vertices) const {
        glm::dvec3 low = mesh_.positions[vertices[0]], high = low;
        for (const std::uint32_t vertex : vertices) {
            low = glm::min(low, mesh_.positions[vertex]);
            high = glm::max(high, mesh_.positions[vertex]);
        }
        const glm::dvec3 extent = high - low;
        return {low, std::max({extent.x, extent.y, extent.z})};
    }

    RimVertex rim_vertex(HalfEdge side, std::uint32_t vertex, const CornersAtLoops &corners, const Unit &unit) const {
        const auto place = [&](std::uint32_t any) { return unit.from_model(mesh_.positions[any]); };
        RimVertex result{.position = place(vertex)};
        const auto &[a, b, c] = mesh_.faces[side / 3].corners;
        const glm::dvec3 normal = face_normal(place(a), place(b), place(c));
        if (const double length = glm::length(normal); length > 0)
            result.face_normal = normal / (is_turned(side) ? -length : length);
        const std::span<const CornersAtLoops::Corner> all = corners.at(vertex);
        for (const CornersAtLoops::Corner &corner : all) {
            const glm::dvec3 p = result.position, q = place(mesh_.to(corner.side)),
                             r = place(mesh_.from(previous_side(corner.side)));
            result.edge_length += (glm::distance(p, q) + glm::distance(p, r)) / (2 * static_cast<double>(all.size()));
            const double at_q = cotangent_at(q, p, r), at_r = cotangent_at(r, p, q);
            result.outside_weight += at_q + at_r;
            result.outside_sum += at_q * r + at_r * q;
            result.outside_area += glm::length(glm::cross(q - p, r - p)) / 6;
        }
        return result;
    }

    Rim rim_of(std::span<const HalfEdge> sides, std::span<const std::uint32_t> vertices, const CornersAtLoops &corners,
               const Unit &unit) {
        Rim rim;
        const std::size_t count = vertices.size();
        for (std::size_t i = 0; i < count; ++i) {
            place_of_[vertices[i]] = static_cast<std::uint32_t>(i);
            rim.vertices.push_back(rim_vertex(sides[i], vertices[i], corners, unit));
        }
        const auto add_chord = [&](std::uint32_t i, std::uint32_t vertex) {
            const std::uint32_t k = place_of_[vertex];
            if (k != kNowhere && i + 1 < k && k - i + 1 < count)
                rim.chords.push_back({i, k});
        };
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::uint32_t vertex = vertices[i];
            for (const CornersAtLoops::Corner &corner : corners.at(vertex)) {
                add_chord(i, mesh_.to(corner.side));
                add_chord(i, mesh_.from(previous_side(corner.side)));
            }
            for (auto at = new_edges_.lower_bound({vertex, 0}); at != new_edges_.end() && (*at)[0] == vertex; ++at)
                add_chord(i, (*at)[1]);
        }
        for (const std::uint32_t vertex : vertices)
            place_of_[vertex] = kNowhere;
        std::sort(rim.chords.begin(), rim.chords.end());
        return rim;
    }

    bool fill(std::span<const HalfEdge> sides, std::span<const std::uint32_t> vertices, const CornersAtLoops &corners) {
        const bool is_one_face = sides.size() == 3 && sides[0] / 3 == sides[1] / 3 && sides[1] / 3 == sides[2] / 3;
        const Unit unit = unit_of(vertices);
        if (is_one_face || !(unit.scale > 0) || !std::isfinite(unit.scale))
            return false;
        const Rim rim = rim_of(sides, vertices, corners, unit);
        const auto triangles = triangulate_hole(rim);
        if (!triangles)
            return false;
        Patch patch = refine_patch(rim, *triangles);
        fair_patch(patch, rim);
        add(patch, sides, vertices, unit);
        return true;
    }

    // The vertex of the surface at a corner of the face beside the hole.
    std::pair<std::uint32_t, std::size_t> corner_of(HalfEdge side, std::uint32_t vertex) const {
        const glm::uvec3 &t = surface_.triangles[mesh_.faces[side / 3].triangle];
        for (std::size_t corner = 0; corner < 2; ++corner)
            if (mesh_.vertex_of[t[static_cast<int>(corner)]] == vertex)
                return {t[static_cast<int>(corner)], corner};
        return {t.z, 2};
    }

    // In linear light. Images are read a little inside the face, since beyond it they may have any colour.
    glm::dvec3 colour_of(HalfEdge side, std::uint32_t vertex, std::size_t corner) const {
        const auto linear = [](const auto &srgb) {
            const auto table = linear_table();
            return glm::dvec3(table[srgb[0]], table[srgb[1]], table[srgb[2]]);
        };
        if (!has_colours_)
            return glm::dvec3(0);
        const std::uint32_t triangle = mesh_.faces[side / 3].triangle;
        const bool has_own = !surface_.face_colours.empty() && surface_.face_colours[triangle].is_given;
        const glm::dvec3 own = linear(has_own ? surface_.face_colours[triangle].colour : surface_.colours[vertex]);
        if (!has_images_ || surface_.texture_ids[triangle] == Surface::kNoTexture)
            return own;
        const Texture &image = surface_.textures[surface_.texture_ids[triangle]];
        const TextureCorners &corners = surface_.texture_corners[triangle];
        constexpr float kInwards = 0.1F;
        const glm::vec2 centre = (corners[0] + corners[1] + corners[2]) / 3.0F,
                        at = corners[corner] + kInwards * (centre - corners[corner]);
        const auto texel = [](float place, std::uint32_t size, Wrap wrap) {
            return wrapped(static_cast<std::int64_t>(std::floor(double{place} * size)), size, wrap);
        };
        const std::size_t index = std::size_t{texel(at.y, image.height, image.use.wrap[1])} * image.width +
                                  texel(at.x, image.width, image.use.wrap[0]);
        constexpr double kWhite = 65535;
        const glm::dvec3 colour = linear(image.texels[index]);
        return image.use.is_tinted ? colour * own / kWhite : colour;
    }

    void add(const Patch &patch, std::span<const HalfEdge> sides, std::span<const std::uint32_t> vertices,
             const Unit &unit) {
        std::vector<std::uint32_t> rim;
        std::vector<glm::dvec3> colours;
        for (std::size_t i = 0; i < patch.rim; ++i) {
            const auto [vertex, corner] = corner_of(sides[i], vertices[i]);
            rim.push_back(vertex);
            colours.push_back(colour_of(sides[i], vertex, corner));
        }
        if (has_colours_)
            colours = continue_values(patch, colours);
        else
            colours.resize(patch.positions.size());
        const auto srgb = [](const glm::dvec3 &colour) {
            const auto byte = [&](int channel) {
                return linear_to_srgb(static_cast<std::uint32_t>(std::clamp(colour[channel], 0.0, 65535.0) + 0.5));
            };
            return Rgb8{byte(0), byte(1), byte(2)};
        };
        std::vector<std::uint32_t> numbers;
        const auto make = [&](const glm::dvec3 &position, std::uint32_t source, bool is_copy) {
            const Rgb8 colour = srgb(colours[numbers.size()]);
            numbers.push_back(first_new_ + static_cast<std::uint32_t>(new_vertices_.size()));
            new_vertices_.push_back({position, source, is_copy, colour});
        };
        for (std::size_t i = 0; i < patch.rim; ++i)
            if (has_images_)
                make(mesh_.positions[vertices[i]], rim[i], true);
            else
                numbers.push_back(rim[i]);
        for (std::size_t i = patch.rim; i < patch.positions.size(); ++i)
            make(unit.to_model(patch.positions[i]), rim[nearest_of_rim(patch, i)], false);
        made_ += patch.positions.size() - patch.rim;
        for (const PatchTriangle &t : patch.triangles) {
            new_triangles_.emplace_back(numbers[t[0]], numbers[t[1]], numbers[t[2]]);
            if (has_face_colours_)
                new_face_colours_.push_back({srgb((colours[t[0]] + colours[t[1]] + colours[t[2]]) / 3.0), true});
            for (std::size_t side = 0; side < 3; ++side)
                if (const std::uint32_t from = t[side], to = t[(side + 1) % 3]; std::max(from, to) < patch.rim) {
                    new_edges_.insert({vertices[from], vertices[to]});
                    new_edges_.insert({vertices[to], vertices[from]});
                }
        }
    }

    static std::size_t nearest_of_rim(const Patch &patch, std::size_t vertex) {
        std::size_t nearest = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < patch.rim; ++i) {
            const glm::dvec3 between = patch.positions[i] - patch.positions[vertex];
            if (const double distance = glm::dot(between, between); distance < least) {
                least = distance;
                nearest = i;
            }
        }
        return nearest;
    }

    // Puts the new vertices before the points without triangles.
    void append() {
        const auto insert = [&](auto &values) {
            if (!values.empty())
                values.insert(values.begin() + first_new_, new_vertices_.size(), {});
        };
        insert(surface_.positions);
        for_vertex_attributes(insert, surface_);
        for (std::size_t i = 0; i < new_vertices_.size(); ++i) {
            const NewVertex &vertex = new_vertices_[i];
            const std::size_t to = first_new_ + i;
            const auto copy = [&](auto &values) {
                if (!values.empty())
                    values[to] = values[vertex.source];
            };
            if (vertex.is_copy)
                for_vertex_attributes(copy, surface_);
            surface_.positions[to] = vertex.position;
            for_byte_attributes(copy, surface_);
            if (!surface_.colours.empty())
                surface_.colours[to] = vertex.colour;
            if (!surface_.station_ids.empty() && !vertex.is_copy)
                surface_.station_ids[to] = kNoStation;
        }
        surface_.triangles.insert(surface_.triangles.end(), new_triangles_.begin(), new_triangles_.end());
        surface_.face_colours.insert(surface_.face_colours.end(), new_face_colours_.begin(), new_face_colours_.end());
        for_triangle_attributes(
            [&](auto &values) {
                if (!values.empty())
                    resize_for_triangles(values, surface_.triangles.size());
            },
            surface_);
    }

    Surface &surface_;
    const WeldedMesh &mesh_;
    const Sheets &sheets_;
    std::vector<std::uint32_t> place_of_; // [vertices] on the rim at hand
    std::uint32_t first_new_;
    bool has_images_, has_face_colours_; // of faces; images win
    bool has_colours_;
    std::vector<NewVertex> new_vertices_;
    std::vector<glm::uvec3> new_triangles_;
    std::vector<FaceColour> new_face_colours_;
    std::set<Edge> new_edges_; // from rim to rim, both ways
    std::uint64_t made_ = 0;   // new vertices without copies
};

} // namespace

Result<FilledHoles> fill_holes(Surface &surface, const WeldedMesh &mesh, const Sheets &sheets, const Borders &borders,
                               std::size_t max_edges) {
    colour_by_materials(surface);
    return HoleFiller(surface, mesh, sheets).run(borders, max_edges);
}

} // namespace pbm::build
