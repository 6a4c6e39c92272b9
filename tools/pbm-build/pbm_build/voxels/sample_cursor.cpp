#include "pbm_build/voxels/sample_cursor.h"

#include "pbm_build/images/surface_looks.h"
#include "pbm_build/lattice/lattice_triangle.h"
#include "pbm_build/voxels/triangle_voxels.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

namespace pbm::build {
namespace {

constexpr double kMaxSlope = 1; // of a normal map's normals: 45 degrees

// Sorts the corners by their places, then by their attributes, at last by `before_in_fields`. Branch-free where x and y
// distinguish all corners: each comparison adds to the rank of a corner.
template <class Corner, class BeforeInFields>
std::array<const Corner *, 3> in_order(const std::array<Corner, 3> &corners, BeforeInFields before_in_fields) {
    const auto key = [](const LatticePoint &p) { return std::int64_t{p.x} << 32 | std::int64_t{p.y}; };
    const std::int64_t a = key(corners[0].at), b = key(corners[1].at), c = key(corners[2].at);
    std::array<const Corner *, 3> order{&corners[0], &corners[1], &corners[2]};
    if (a != b && b != c && a != c) {
        const auto place = [](bool one, bool two) {
            return static_cast<std::size_t>(one) + static_cast<std::size_t>(two);
        };
        order[place(b < a, c < a)] = &corners[0];
        order[place(a < b, c < b)] = &corners[1];
        order[place(a < c, b < c)] = &corners[2];
        return order;
    }
    sort_three(order, [&](const Corner *one, const Corner *two) {
        if (one->at != two->at)
            return before(one->at, two->at);
        const auto rest = [](const Sample &s) { return std::tie(s.normal, s.colour, s.rest.material); };
        const auto of_one = rest(one->attributes), of_two = rest(two->attributes);
        return of_one < of_two || (of_one == of_two && before_in_fields(one->number, two->number));
    });
    return order;
}

} // namespace

void SampleCursor::load(std::uint32_t source) {
    using Corner = SurfaceSampler::Corner;
    const glm::uvec3 &vertices = sampler_.surface_.triangles[source];
    std::array<Corner, 3> corners{sampler_.corner(vertices.x), sampler_.corner(vertices.y),
                                  sampler_.corner(vertices.z)};
    corners[1].number = 1;
    corners[2].number = 2;
    const glm::dvec3 facing = lattice_normal(corners[0].at, corners[1].at, corners[2].at);
    const auto before_in_fields = [&](std::uint8_t one, std::uint8_t two) {
        for (const FieldSamples &field : sampler_.fields_)
            if (field.values[vertices[one]] != field.values[vertices[two]])
                return field.values[vertices[one]] < field.values[vertices[two]];
        return false;
    };
    const std::array<const Corner *, 3> order = in_order(corners, before_in_fields);
    triangle_.set_corners({in_voxels(order[0]->at), in_voxels(order[1]->at), in_voxels(order[2]->at)});
    const ShortNormal flat = to_short_normal(sampler_.normals_.faces_point_inward ? -facing : facing);
    triangle_.flat = {static_cast<double>(flat[0]), static_cast<double>(flat[1]), static_cast<double>(flat[2])};
    triangle_.is_flat = false;
    const FaceColour own = sampler_.colour_of_face(source);
    triangle_.has_colour = own.is_given || !sampler_.surface_.colours.empty();
    if (own.is_given)
        for (Corner &corner : corners)
            corner.attributes.colour = linear_colour(own.colour);
    rest_ = order[0]->attributes.rest;
    for (std::size_t c = 0; c < 3; ++c) {
        const Sample &attributes = order[c]->attributes;
        triangle_.is_flat |= is_zero(attributes.normal);
        rest_.add_corner(attributes.rest);
        materials_[c] = attributes.rest.material;
        for (std::size_t k = 0; k < 3; ++k) {
            triangle_.normals[k][c] = attributes.normal[k];
            triangle_.colours[k][c] = attributes.colour[k];
        }
    }
    for (std::size_t c = 0; c < 3; ++c)
        vertices_[c] = vertices[order[c]->number];
    mixed_materials_ = materials_[1] != materials_[0] || materials_[2] != materials_[0];
    const glm::ivec3 voxel = voxel_of(corners[0].at);
    triangle_.in_one_voxel = voxel == voxel_of(corners[1].at) && voxel == voxel_of(corners[2].at);
    const TexturePyramid *const image = sampler_.image_of(source);
    has_image_ = image != nullptr;
    if (has_image_) {
        const TextureCorners &places = sampler_.surface_.texture_corners[source];
        image_.set(*image, {places[order[0]->number], places[order[1]->number], places[order[2]->number]},
                   triangle_.corners);
        for (std::size_t c = 0; c < 3 && image_.is_faded(); ++c)
            opacities_[c] = 1 - sampler_.surface_.transparencies[vertices_[c]] / 255.0;
    }
    const std::array<std::size_t, 3> numbers{order[0]->number, order[1]->number, order[2]->number};
    load_relief(source, numbers);
    has_reflectance_ = load_layer(Layer::reflectance, source, numbers, reflectance_);
    has_emission_ = has_reflectance_ && load_layer(Layer::emission, source, numbers, emission_);
    has_occlusion_ = has_reflectance_ && load_layer(Layer::occlusion, source, numbers, occlusion_);
}

bool SampleCursor::load_layer(Layer layer, std::uint32_t source, const std::array<std::size_t, 3> &corners,
                              TriangleTexture &to) {
    const ImageLayer &from = sampler_.surface_.layer(layer);
    const TexturePyramid *const image = sampler_.image_of(from.ids, source);
    if (image == nullptr)
        return false;
    const TextureCorners &places = from.corners[source];
    to.set(*image, {places[corners[0]], places[corners[1]], places[corners[2]]}, triangle_.corners);
    return true;
}

void SampleCursor::load_relief(std::uint32_t source, const std::array<std::size_t, 3> &corners) {
    has_relief_ = load_layer(Layer::normals, source, corners, relief_);
    if (!has_relief_)
        return;
    const TriangleTangents &tangents = sampler_.normals_.tangents[source];
    sense_ = tangents.is_mirrored ? -1 : 1;
    for (std::size_t c = 0; c < 3; ++c) {
        const ShortNormal &along = tangents.along[corners[c]];
        has_relief_ = has_relief_ && !is_zero(along);
        tangents_[c] = glm::dvec3(along[0], along[1], along[2]) / kNormalScale;
    }
}

void SampleCursor::take_point(std::uint32_t source, std::size_t row, SampleRows &rows) const {
    const Sample sample = sampler_.corner(sampler_.vertex_of_point(source)).attributes;
    for (std::size_t k = 0; k < 3; ++k) {
        rows.mixed.normals.from[k][row] = sample.normal[k];
        rows.mixed.colours[k][row] = sample.colour[k];
    }
    rows.mixed.normals.is_rounded[row] = 1;
    rows.rest[row] = sample.rest;
    for (std::size_t f = 0; f < rows.fields.size(); ++f)
        rows.fields[f][row] = sampler_.fields_[f].values[sampler_.vertex_of_point(source)];
}

// The values of the fields: mixed from those of the corners, or of the nearest corner where values are not mixed.
void SampleCursor::take_fields(std::size_t row, SampleRows &rows) const {
    const auto &weights = rows.mixed.weights;
    for (std::size_t f = 0; f < rows.fields.size(); ++f) {
        const FieldSamples &field = sampler_.fields_[f];
        double mixed = 0, largest = -1;
        std::int32_t nearest = FieldSamples::kNone;
        bool is_whole = field.average == FieldAverage::mean;
        for (std::size_t c = 0; c < 3; ++c) {
            const std::int32_t value = field.values[vertices_[c]];
            is_whole = is_whole && value != FieldSamples::kNone;
            mixed += weights[c][row] * value;
            if (value != FieldSamples::kNone && weights[c][row] > largest) {
                largest = weights[c][row];
                nearest = value;
            }
        }
        rows.fields[f][row] = is_whole ? static_cast<std::int32_t>(std::max(0.0, std::floor(mixed + 0.5))) : nearest;
    }
}

void SampleCursor::take_place(const glm::dvec3 &block_centre, std::size_t row, SampleRows &rows, Places places) const {
    const PlaceInBlock voxel = rows.mixed.places[row];
    const glm::dvec3 centre = block_centre + glm::dvec3(voxel & 255, voxel >> 8 & 255, voxel >> 16);
    const auto &weights = rows.mixed.weights;
    glm::dvec3 from_centre(0);
    for (std::size_t c = 0; c < 3; ++c)
        from_centre += weights[c][row] * (triangle_.corners[c] - centre);
    double weight = 1;
    if (places == Places::pieces) {
        const TrianglePiece piece = piece_in_voxel(
            {triangle_.corners[0] - centre, triangle_.corners[1] - centre, triangle_.corners[2] - centre});
        weight = std::floor(piece.area * kPlaceSteps + 0.5);
        from_centre = piece.centroid;
    }
    SamplePlace &to = rows.places[row];
    for (int axis = 0; axis < 3; ++axis)
        to.from_centre[static_cast<std::size_t>(axis)] =
            static_cast<std::int32_t>(std::floor(from_centre[axis] * kPlaceSteps + 0.5));
    to.weight = static_cast<std::int32_t>(weight);
}

// The colour of the image, times that of the corners where it is tinted.
void SampleCursor::take_image_colour(std::size_t row, SampleRows &rows) const {
    const auto &weights = rows.mixed.weights;
    const std::array<double, 3> of_corners{weights[0][row], weights[1][row], weights[2][row]};
    double opacity = 1;
    if (image_.is_faded())
        opacity = of_corners[0] * opacities_[0] + of_corners[1] * opacities_[1] + of_corners[2] * opacities_[2];
    const auto colour = image_.colour(of_corners, opacity);
    rows.rest[row].is_hole = !colour;
    if (!colour)
        return;
    const bool is_tinted = image_.is_tinted() && triangle_.has_colour;
    constexpr std::int64_t kWhite = 65535;
    for (std::size_t c = 0; c < 3; ++c) {
        std::int32_t &to = rows.mixed.colours[c][row];
        to = is_tinted ? static_cast<std::int32_t>(std::int64_t{(*colour)[c]} * to / kWhite) : (*colour)[c];
    }
}

// The normal of the normal map, turned from the space of tangents. It leans by at most kMaxSlope, so that the splat
// still covers its voxel.
void SampleCursor::take_relief(std::size_t row, SampleRows &rows) const {
    const auto &weights = rows.mixed.weights;
    const std::array<double, 3> of_corners{weights[0][row], weights[1][row], weights[2][row]};
    const auto texel = relief_.colour(of_corners);
    if (!texel)
        return;
    auto &from = rows.mixed.normals.from;
    const glm::dvec3 normal = glm::dvec3(from[0][row], from[1][row], from[2][row]) / kNormalScale;
    const glm::dvec3 right = of_corners[0] * tangents_[0] + of_corners[1] * tangents_[1] + of_corners[2] * tangents_[2],
                     up = sense_ * glm::cross(normal, right);
    const auto part = [&](std::size_t c) { return static_cast<double>((*texel)[c]) * (2 / 65535.0) - 1; };
    const double scale = static_cast<double>(relief_.relief());
    const double x = scale * part(0), y = scale * part(1);
    const double slope = std::sqrt(x * x + y * y);
    const double z = std::max({part(2), slope / kMaxSlope, 1e-3});
    const glm::dvec3 turned = x * right + y * up + z * normal;
    for (int axis = 0; axis < 3; ++axis)
        from[static_cast<std::size_t>(axis)][row] = turned[axis];
    rows.mixed.normals.is_rounded[row] = 0;
}

// The material that is nearest to what the images say, and the light that the surface emits.
void SampleCursor::take_look(std::size_t row, SampleRows &rows) const {
    const auto &weights = rows.mixed.weights;
    const std::array<double, 3> of_corners{weights[0][row], weights[1][row], weights[2][row]};
    const auto texel = reflectance_.colour(of_corners);
    if (!texel)
        return;
    Look look{(*texel)[0], (*texel)[1], (*texel)[2], 0, 0};
    if (const auto light = has_emission_ ? emission_.colour(of_corners) : std::nullopt) {
        auto &colours = rows.mixed.colours;
        std::array<std::int32_t, 3> shown{};
        if (triangle_.has_colour || has_image_) // else nothing was written
            shown = {colours[0][row], colours[1][row], colours[2][row]};
        look[3] = add_emission(*light, shown);
        for (std::size_t c = 0; c < 3; ++c)
            colours[c][row] = shown[c];
    }
    if (const auto dark = has_occlusion_ ? occlusion_.colour(of_corners) : std::nullopt)
        look[4] = (*dark)[0];
    rows.rest[row].material = sampler_.surface_.material_of_cell[look_cell(look)];
}

void SampleCursor::take_triangle(const glm::dvec3 &block_centre, std::size_t first, std::size_t end, SampleRows &rows,
                                 Places places) const {
    triangle_.mix(block_centre, first, end, rows.mixed);
    for (std::size_t row = first; row < end; ++row)
        rows.rest[row] = rest_;
    for (std::size_t row = first; row < end && has_image_; ++row)
        take_image_colour(row, rows);
    for (std::size_t row = first; row < end && has_relief_; ++row)
        take_relief(row, rows);
    for (std::size_t row = first; row < end && !rows.fields.empty(); ++row)
        take_fields(row, rows);
    for (std::size_t row = first; row < end && places != Places::none; ++row)
        take_place(block_centre, row, rows, places);
    for (std::size_t row = first; row < end && mixed_materials_; ++row) {
        const auto &weights = rows.mixed.weights;
        const std::array<double, 3> of_corners{weights[0][row], weights[1][row], weights[2][row]};
        const auto nearest = std::max_element(of_corners.begin(), of_corners.end()) - of_corners.begin();
        rows.rest[row].material = materials_[static_cast<std::size_t>(nearest)];
    }
    for (std::size_t row = first; row < end && has_reflectance_; ++row)
        take_look(row, rows);
}

void SampleCursor::take(std::span<const Hit> hits, const glm::ivec3 &block, SampleRows &rows, Places places) {
    const glm::dvec3 block_centre = glm::dvec3(block) + 0.5;
    for (std::size_t first = 0, end; first < hits.size(); first = end) {
        const std::uint32_t source = source_of(hits[first]);
        end = first + 1;
        if (source >= triangle_count_) {
            take_point(source, first, rows);
            continue;
        }
        while (end < hits.size() && source_of(hits[end]) == source)
            ++end;
        if (source != source_) {
            load(source);
            source_ = source;
        }
        take_triangle(block_centre, first, end, rows, places);
    }
    rows.mixed.normals.round(hits.size());
}

} // namespace pbm::build
