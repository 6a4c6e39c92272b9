#include "pbm_build/images/surface_looks.h"

#include "pbm_build/images/texture_pyramid.h"
#include "pbm_format/model/point_values.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

namespace pbm::build {
namespace {

// Sums of looks by the cell that they lie in.
class Cells {
  public:
    explicit Cells(std::size_t count) : number_of_(count, 0) {}

    void add(const LookTexel &texel, std::uint64_t count) {
        std::uint32_t &number = number_of_[look_cell(look_of(texel))];
        if (number == 0) {
            sums_.emplace_back();
            number = static_cast<std::uint32_t>(sums_.size());
        }
        sums_[number - 1].add(texel, count);
    }
    std::vector<LookSums> in_order() const {
        std::vector<LookSums> ordered;
        for (const std::uint32_t number : number_of_)
            if (number != 0)
                ordered.push_back(sums_[number - 1]);
        return ordered;
    }

  private:
    std::vector<std::uint32_t> number_of_; // of a cell in `sums_`, from 1; 0: none
    std::vector<LookSums> sums_;
};

// The corners of a triangle, by their places: which one is first in the file says nothing.
std::array<std::size_t, 3> corners_in_order(const Surface &surface, std::size_t triangle) {
    const glm::uvec3 &t = surface.triangles[triangle];
    std::array<std::size_t, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        const glm::dvec3 &p = surface.positions[t[static_cast<int>(a)]], &q = surface.positions[t[static_cast<int>(b)]];
        return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
    });
    return order;
}

// [triangles] areas in 2^-36 of the squared diagonal of the surface, at least 1.
std::vector<std::uint64_t> areas_of(const Surface &surface) {
    glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
    for (const glm::dvec3 &p : surface.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const glm::dvec3 diagonal = high - low;
    const double scale = std::ldexp(1 / glm::dot(diagonal, diagonal), 36);
    std::vector<std::uint64_t> areas;
    areas.reserve(surface.triangles.size());
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        const auto order = corners_in_order(surface, i);
        const auto place = [&](std::size_t k) -> const glm::dvec3 & {
            return surface.positions[surface.triangles[i][static_cast<int>(order[k])]];
        };
        const double area = scale * glm::length(glm::cross(place(1) - place(0), place(2) - place(0))) / 2;
        areas.push_back(area >= 1 && area < 0x1p40 ? static_cast<std::uint64_t>(area) : 1);
    }
    return areas;
}

// The look of a triangle without an image of reflectance: that of its material. Nothing: it has none.
std::optional<LookTexel> look_of_material(const Surface &surface, std::size_t triangle) {
    const std::size_t material = surface.material_ids.empty() ? 0 : surface.material_ids[surface.triangles[triangle].x];
    if (material >= surface.reflectances.size() || !surface.reflectances[material])
        return std::nullopt;
    return reflecting(texel_of(*surface.reflectances[material]));
}

std::uint16_t image_of(const std::vector<std::uint16_t> &ids, std::size_t triangle) {
    return triangle < ids.size() ? ids[triangle] : Surface::kNoTexture;
}

// The looks of the texels that triangles show; those of an image share the area of its triangles.
void add_texels(const Surface &surface, int threads, Cells &cells) {
    const std::vector<std::uint16_t> &ids = surface.layer(Layer::reflectance).ids;
    std::vector<std::uint64_t> area_of(surface.textures.size(), 0);
    const std::vector<std::uint64_t> areas = areas_of(surface);
    for (std::size_t i = 0; i < surface.triangles.size(); ++i)
        if (const std::uint16_t image = image_of(ids, i); image != Surface::kNoTexture)
            area_of[image] += areas[i];
        else if (const auto look = look_of_material(surface, i))
            cells.add(*look, areas[i]);
    const std::vector<TextureCoverage> coverages = covered_texels(surface, threads);
    for (std::size_t k = 0; k < area_of.size(); ++k) {
        const auto &texels = surface.textures[k].texels;
        std::uint64_t covered = 0;
        for (std::size_t i = 0; area_of[k] > 0 && i < texels.size(); ++i)
            covered += coverages[k].covers(i) ? 1U : 0U;
        const std::uint64_t weight = covered > 0 ? std::max<std::uint64_t>(area_of[k] / covered, 1) : 0;
        for (std::size_t i = 0; weight > 0 && i < texels.size(); ++i)
            if (coverages[k].covers(i))
                cells.add(reflecting({texels[i][0], texels[i][1], texels[i][2]}), weight);
    }
}

// Places of a triangle, as weights of its corners.
using Weights = std::array<double, 3>;

// Reads a triangle's images at single places, without filters.
class PlaceReader {
  public:
    PlaceReader(const Surface &surface, std::size_t triangle)
        : surface_(surface), triangle_(triangle), order_(corners_in_order(surface, triangle)) {}

    // `weights`: of the corners in the order of their places.
    std::optional<LookTexel> look(const Weights &weights) const {
        const auto reflectance = texel(Layer::reflectance, weights);
        if (!reflectance)
            return std::nullopt;
        LookTexel look = reflecting({(*reflectance)[0], (*reflectance)[1], (*reflectance)[2]});
        if (const auto light = texel(Layer::emission, weights)) {
            std::array<std::int32_t, 3> shown = colour(weights);
            look[3] = static_cast<std::uint8_t>((add_emission(linear(*light), shown) * 255 + 32767) / 65535);
        }
        if (const auto dark = texel(Layer::occlusion, weights))
            look[4] = (*dark)[0];
        return look;
    }

  private:
    using ImageTexel = std::array<std::uint8_t, 4>;

    static std::array<std::int32_t, 3> linear(const ImageTexel &texel) {
        const std::span<const std::uint16_t> table = linear_table();
        return {table[texel[0]], table[texel[1]], table[texel[2]]};
    }
    std::optional<ImageTexel> texel(const std::vector<std::uint16_t> &ids, const std::vector<TextureCorners> &corners,
                                    const Weights &weights) const {
        const std::uint16_t id = image_of(ids, triangle_);
        if (id == Surface::kNoTexture || surface_.textures[id].texels.empty())
            return std::nullopt;
        const Texture &image = surface_.textures[id];
        glm::dvec2 at(0);
        for (std::size_t k = 0; k < 3; ++k)
            at += weights[k] * glm::dvec2(corners[triangle_][order_[k]]);
        const auto index = [](double place, std::uint32_t size, Wrap wrap) {
            constexpr double kFar = 1e12;
            const double texels = std::floor(place * size);
            return wrapped(std::abs(texels) < kFar ? static_cast<std::int64_t>(texels) : 0, size, wrap);
        };
        return image.texels[std::size_t{index(at.y, image.height, image.use.wrap[1])} * image.width +
                            index(at.x, image.width, image.use.wrap[0])];
    }
    std::optional<ImageTexel> texel(Layer layer, const Weights &weights) const {
        return texel(surface_.layer(layer).ids, surface_.layer(layer).corners, weights);
    }
    // Without emission, as SampleCursor has it.
    std::array<std::int32_t, 3> colour(const Weights &weights) const {
        const FaceColour face = surface_.face_colours.empty() ? FaceColour{} : surface_.face_colours[triangle_];
        const bool has_colour = face.is_given || !surface_.colours.empty();
        std::array<double, 3> own{};
        for (std::size_t k = 0; k < 3 && has_colour; ++k) {
            const Rgb8 &srgb = face.is_given
                                   ? face.colour
                                   : surface_.colours[surface_.triangles[triangle_][static_cast<int>(order_[k])]];
            for (std::size_t c = 0; c < 3; ++c)
                own[c] += weights[k] * linear_table()[srgb[c]];
        }
        const auto image = texel(surface_.texture_ids, surface_.texture_corners, weights);
        const bool is_tinted = image && has_colour && surface_.textures[surface_.texture_ids[triangle_]].use.is_tinted;
        std::array<std::int32_t, 3> shown{};
        for (std::size_t c = 0; c < 3; ++c) {
            const double of_image = image ? linear(*image)[c] : 65535.0;
            shown[c] = static_cast<std::int32_t>(!image ? own[c] : is_tinted ? own[c] * of_image / 65535 : of_image);
        }
        return shown;
    }

    const Surface &surface_;
    std::size_t triangle_;
    std::array<std::size_t, 3> order_;
};

// Calls `visit` for the centroids of the size x size triangles into which a triangle is divided.
template <class Visit> void visit_centroids(std::uint64_t size, const Visit &visit) {
    const double third = 1 / (3 * static_cast<double>(size));
    for (std::uint64_t row = 0; row < size; ++row)
        for (std::uint64_t i = 0; i < 2 * (size - row) - 1; ++i) { // by turns upright and upside down
            const std::uint64_t column = i / 2, thirds = i % 2 == 0 ? 1 : 2;
            const double b = static_cast<double>(3 * column + thirds) * third,
                         c = static_cast<double>(3 * row + thirds) * third;
            visit(Weights{1 - b - c, b, c});
        }
}

// The looks at places all over the surface, since its images need not lie on each other: about kPlaces of them, and at
// least one of each triangle.
void add_places(const Surface &surface, Cells &cells) {
    constexpr std::uint64_t kPlaces = std::uint64_t{1} << 18, kMaxSize = 1024;
    const std::vector<std::uint64_t> areas = areas_of(surface);
    const std::uint64_t all = std::accumulate(areas.begin(), areas.end(), std::uint64_t{0});
    const std::vector<std::uint16_t> &ids = surface.layer(Layer::reflectance).ids;
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
        const std::uint64_t area = areas[i];
        if (image_of(ids, i) == Surface::kNoTexture) {
            if (const auto look = look_of_material(surface, i))
                cells.add(*look, area);
            continue;
        }
        const double places = static_cast<double>(area) / static_cast<double>(all) * kPlaces;
        const auto size = std::clamp<std::uint64_t>(static_cast<std::uint64_t>(std::sqrt(places)), 1, kMaxSize);
        const std::uint64_t weight = std::max<std::uint64_t>(area / (size * size), 1);
        const PlaceReader reader(surface, i);
        visit_centroids(size, [&](const Weights &weights) {
            if (const auto look = reader.look(weights))
                cells.add(*look, weight);
        });
    }
}

} // namespace

bool has_more_than_reflectance(const Surface &surface) {
    return !surface.layer(Layer::emission).ids.empty() || !surface.layer(Layer::occlusion).ids.empty();
}

std::vector<LookSums> sum_looks(const Surface &surface, int threads) {
    const bool has_more = has_more_than_reflectance(surface);
    Cells cells(has_more ? kLookCells : kReflectanceCells);
    if (has_more)
        add_places(surface, cells);
    else
        add_texels(surface, threads, cells);
    return cells.in_order();
}

} // namespace pbm::build
