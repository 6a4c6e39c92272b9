#include "pbm_bake/shadow_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

// Receivers are raised by so much along their normals, in voxels: the surface is known to 0.1.
constexpr float kBias = 0.35F;
// A disc reaches over its voxel; what of it stands over edges shadows what it should not.
constexpr float kDenseRadius = 1, kDenseScale = 0.75F; // voxels
// Surfaces nearer to edge-on than this cosine are taken to have it.
constexpr float kLeastCosine = 0.02F;
// Nothing nearer to the light than this casts a shadow, and it is lit: the light is in its voxel. Voxels.
constexpr float kNearest = 1;
// A brick's corner to corner, and the reach of its splats.
constexpr double kBrickReach = 8 * 0.8660254 + 1;

double dot(const Vector3 &a, const Vector3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

float away_from_zero(float cosine) {
    return cosine < 0 ? std::min(cosine, -kLeastCosine) : std::max(cosine, kLeastCosine);
}

} // namespace

ShadowView::ShadowView(const LightView &view, const ShadowCasters &casters)
    : casters_(casters), view_(view), inverse_distance_(static_cast<float>(view.inverse_distance)) {
    normals_.reserve(kNormalCount);
    for (const UnitVector &n : normal_table()) {
        const double x = dot(n, view.axes[0]), y = dot(n, view.axes[1]), z = dot(n, view.axes[2]);
        const auto extent = [](double along) {
            return static_cast<float>(std::sqrt(std::max(0.0, 1 - along * along)));
        };
        normals_.push_back(
            {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z), extent(x), extent(y), extent(z)});
    }
    for (MortonCode place = 0; place < 512; ++place) {
        const auto local = morton_decode(place);
        const Vector3 centre{local[0] + 0.5, local[1] + 0.5, local[2] + 0.5};
        for (std::size_t axis = 0; axis < 3; ++axis)
            places_[place][axis] = static_cast<float>(dot(centre, view.axes[axis]));
        places_[place][3] = 0;
    }
    for (std::size_t i = 0; i < 256; ++i) {
        const auto radius = static_cast<float>(radius_fraction(static_cast<std::uint8_t>(i)) *
                                               static_cast<double>(1 << casters.level()));
        radii_[i] = radius <= kDenseRadius ? radius * kDenseScale : radius;
    }
    find_window();
}

void ShadowView::find_window() {
    const auto bricks = casters_.bricks();
    const double e = view_.inverse_distance;
    const bool one_of_six = view_.face >= 0;
    std::uint8_t largest = 0;
    for (const std::uint8_t radius : casters_.radii())
        largest = std::max(largest, radius);
    const double reach = kBrickReach + static_cast<double>(radii_[largest]);
    double low_u = 0, high_u = 0, low_v = 0, high_v = 0;
    std::vector<std::array<double, 2>> rows(bricks.size() - 1);
    bricks_.resize(bricks.size() - 1);
    constexpr double kEverywhere = 1e30;
    for (std::size_t b = 0; b < bricks_.size(); ++b) {
        Vector3 corner{}, middle{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            corner[axis] = 8.0 * bricks[b].corner[axis] - view_.origin[axis];
            middle[axis] = corner[axis] + 4;
        }
        for (std::size_t axis = 0; axis < 3; ++axis)
            bricks_[b].corner[axis] = static_cast<float>(dot(corner, view_.axes[axis]));
        const double x = dot(middle, view_.axes[0]), y = dot(middle, view_.axes[1]), z = dot(middle, view_.axes[2]);
        // How far from the light along the view, in units of the distance to the origin.
        const double nearest = 1 + e * (z - reach), farthest = 1 + e * (z + reach);
        if (farthest <= 0) {
            rows[b] = {kEverywhere, -kEverywhere};
        } else if (nearest < 0.01) {
            rows[b] = {-kEverywhere, kEverywhere};
        } else {
            const double q = 1 / (1 + e * z), u = x * q, v = y * q;
            const double over_u = reach * (1 + std::abs(u) * e) / nearest,
                         over_v = reach * (1 + std::abs(v) * e) / nearest;
            rows[b] = {v - over_v, v + over_v};
            low_u = std::min(low_u, u - over_u);
            high_u = std::max(high_u, u + over_u);
            low_v = std::min(low_v, v - over_v);
            high_v = std::max(high_v, v + over_v);
        }
    }
    if (one_of_six) {
        high_u = high_v = 1 / e + 2;
        low_u = low_v = -high_u;
    }
    to_column_ = static_cast<float>(std::ceil(-low_u) + 1 + view_.shift_u);
    to_row_ = static_cast<float>(std::ceil(-low_v) + 1 + view_.shift_v);
    width_ = static_cast<int>(std::ceil(high_u - low_u)) + 4;
    height_ = static_cast<int>(std::ceil(high_v - low_v)) + 4;
    for (std::size_t b = 0; b < bricks_.size(); ++b) {
        const double limit = height_, shift = static_cast<double>(to_row_);
        bricks_[b].first_row = static_cast<int>(std::clamp(std::floor(rows[b][0] + shift) - 1, 0.0, limit));
        bricks_[b].last_row = static_cast<int>(std::clamp(std::ceil(rows[b][1] + shift) + 1, -1.0, limit - 1));
    }
}

ShadowView::Point ShadowView::point(const ViewBrick &brick, std::size_t i) const {
    const auto &place = places_[casters_.places()[i]];
    const ViewNormal &n = normals_[casters_.normals()[i] & kNormalIndexMask];
    const float offset = static_cast<float>(casters_.offsets()[i]) * (1.0F / ShadowCasters::kOffsetSteps);
    return {brick.corner[0] + place[0] + offset * n.x, brick.corner[1] + place[1] + offset * n.y,
            brick.corner[2] + place[2] + offset * n.z, &n};
}

template <bool kPerspective>
void ShadowView::draw_point(const Point &point, float radius, int first, int rows, float *map) const {
    const ViewNormal &n = *point.normal;
    const float e = inverse_distance_;
    float q = 1, u = point.x, v = point.y, depth = point.z, cosine = n.z;
    float wide = radius * n.wide, high = radius * n.high;
    if constexpr (kPerspective) {
        const float along = 1 + e * point.z;
        if (along <= kNearest * e)
            return;
        q = 1 / along;
        u *= q;
        v *= q;
        depth *= q;
        cosine += e * (n.x * point.x + n.y * point.y + n.z * point.z);
        // The disc's extent across the ray, and longer by how much nearer its rim can be.
        const float nearer = 1 - radius * n.deep * e * q, scale = nearer > 0.1F ? q / nearer : 10 * q;
        wide = (wide + radius * n.deep * std::abs(u) * e) * scale;
        high = (high + radius * n.deep * std::abs(v) * e) * scale;
    }
    const float column = u + to_column_, row = v + to_row_ - static_cast<float>(first);
    if (column + wide < 0 || row + high < 0)
        return;
    const int left = static_cast<int>(std::max(column - wide, -1.0F) + 1),
              right = static_cast<int>(std::min(column + wide, static_cast<float>(width_ - 1)));
    const int top = static_cast<int>(std::max(row - high, -1.0F) + 1),
              bottom = static_cast<int>(std::min(row + high, static_cast<float>(rows - 1)));
    if (left > right || top > bottom)
        return;
    const float inverse = -1 / away_from_zero(cosine);
    const float step_u = n.x * inverse, step_v = n.y * inverse, limit = radius * radius;
    for (int j = top; j <= bottom; ++j)
        for (int i = left; i <= right; ++i) {
            const float du = static_cast<float>(i) - column, dv = static_cast<float>(j) - row;
            const float there = depth + step_u * du + step_v * dv;
            float x = du, y = dv, z = there - depth;
            if constexpr (kPerspective) {
                const float back = 1 - e * there;
                if (back <= 0)
                    continue;
                const float s = 1 / back;
                x = (u + du) * s - point.x;
                y = (v + dv) * s - point.y;
                z = there * s - point.z;
            }
            if (x * x + y * y + z * z > limit)
                continue;
            float &nearest =
                map[static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(i)];
            nearest = std::min(nearest, there);
        }
}

template <bool kPerspective> void ShadowView::draw_bricks(int first, int rows, float *map) const {
    const auto bricks = casters_.bricks();
    const ByteView radii = casters_.radii();
    for (std::size_t b = 0; b < bricks_.size(); ++b) {
        if (bricks_[b].first_row >= first + rows || bricks_[b].last_row < first)
            continue;
        for (std::size_t i = bricks[b].first_point; i < bricks[b + 1].first_point; ++i)
            draw_point<kPerspective>(point(bricks_[b], i), radii_[radii[i]], first, rows, map);
    }
}

void ShadowView::draw(int first, int rows, std::span<float> map) const {
    std::fill(map.begin(), map.end(), std::numeric_limits<float>::infinity());
    if (inverse_distance_ != 0)
        draw_bricks<true>(first, rows, map.data());
    else
        draw_bricks<false>(first, rows, map.data());
}

template <bool kPerspective>
void ShadowView::vote_bricks(int first, int rows, const float *map, std::span<std::uint8_t> votes) const {
    const auto bricks = casters_.bricks();
    const auto normals = casters_.normals();
    const float e = inverse_distance_;
    const int face = view_.face;
    for (std::size_t b = 0; b < bricks_.size(); ++b) {
        if (bricks_[b].first_row >= first + rows || bricks_[b].last_row < first)
            continue;
        for (std::size_t i = bricks[b].first_point; i < bricks[b + 1].first_point; ++i) {
            const Point p = point(bricks_[b], i);
            const ViewNormal &n = *p.normal;
            float q = 1, cosine = n.z;
            if constexpr (kPerspective) {
                const float along = 1 + e * p.z;
                if (along <= 0)
                    continue;
                q = 1 / along;
                cosine += e * (n.x * p.x + n.y * p.y + n.z * p.z);
            }
            const bool two_sided = (normals[i] & kTwoSidedBit) != 0;
            if (cosine >= 0 && !two_sided)
                continue;
            const float u = p.x * q, v = p.y * q;
            if constexpr (kPerspective)
                if (face >= 0 && (u * e < -1 || u * e >= 1 || v * e < -1 || v * e >= 1))
                    continue;
            const float column = u + to_column_, row = v + to_row_;
            const int at_column = static_cast<int>(column + 0.5F), at_row = static_cast<int>(row + 0.5F);
            if (at_row < first || at_row >= first + rows)
                continue;
            // Raised towards the light.
            const float raised =
                cosine < 0 ? std::min(cosine + kBias * e, -kLeastCosine) : std::max(cosine - kBias * e, kLeastCosine);
            const float inverse = -1 / raised;
            const float there = p.z * q - kBias * q * std::abs(inverse) +
                                n.x * inverse * (static_cast<float>(at_column) - column) +
                                n.y * inverse * (static_cast<float>(at_row) - row);
            const float nearest = map[static_cast<std::size_t>(at_row - first) * static_cast<std::size_t>(width_) +
                                      static_cast<std::size_t>(at_column)];
            votes[i] = static_cast<std::uint8_t>(votes[i] + (nearest >= there ? 1 : 0));
        }
    }
}

void ShadowView::vote(int first, int rows, std::span<const float> map, std::span<std::uint8_t> votes) const {
    if (inverse_distance_ != 0)
        vote_bricks<true>(first, rows, map.data(), votes);
    else
        vote_bricks<false>(first, rows, map.data(), votes);
}

ShadowView::Seen ShadowView::see(const Vector3 &place, const Vector3 &normal) const {
    const Vector3 from{place[0] - view_.origin[0], place[1] - view_.origin[1], place[2] - view_.origin[2]};
    const double x = dot(from, view_.axes[0]), y = dot(from, view_.axes[1]), z = dot(from, view_.axes[2]);
    const double e = view_.inverse_distance, along = 1 + e * z;
    if (along <= 0)
        return {};
    const double u = x / along, v = y / along;
    if (view_.face >= 0 && (u * e < -1 || u * e >= 1 || v * e < -1 || v * e >= 1))
        return {};
    const double column = u + static_cast<double>(to_column_), row = v + static_cast<double>(to_row_);
    if (!(column >= 0 && column < width_ - 1 && row >= 0 && row < height_ - 1))
        return {};
    const Vector3 n{dot(normal, view_.axes[0]), dot(normal, view_.axes[1]), dot(normal, view_.axes[2])};
    const double cosine = std::min(n[2] + e * (n[0] * x + n[1] * y + n[2] * z), -static_cast<double>(kLeastCosine));
    const double texel_column = std::floor(column + 0.5), texel_row = std::floor(row + 0.5);
    const double depth = z / along - (n[0] * (texel_column - column) + n[1] * (texel_row - row)) / cosine;
    return {true, static_cast<int>(texel_row), static_cast<int>(texel_column), static_cast<float>(depth)};
}

} // namespace pbm
