#include "pbm_bake/shadow_map.h"

#include "pbm_surface/carried_offsets.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

using Float4 = float __attribute__((vector_size(16)));

// Receivers are raised along their normals by this many voxels: the surface is known to 0.1.
constexpr float kBias = 0.35F;
// A disc reaches beyond its voxel and casts false shadows where it overhangs an edge. Dense points get smaller discs,
// which still close a sheet of voxels: that needs a radius of 0.71, half the diagonal of a square.
constexpr float kDenseRadius = 1, kDenseScale = 0.83F; // voxels
// Surfaces closer to edge-on are clamped to this cosine.
constexpr float kMinCosine = 0.02F;
// Splats nearer to the light than this many voxels cast no shadow: the light lies in their voxel.
constexpr float kNearest = 1;
// Voxels from a brick's centre to its surfaces: half the diagonal of the brick, one voxel, and the layers above.
constexpr double kBrickReach = 8 * 0.8660254 + 1 + static_cast<double>(kMaxLayer);

double dot(const Vector3 &a, const Vector3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

float away_from_zero(float cosine) { return cosine < 0 ? std::min(cosine, -kMinCosine) : std::max(cosine, kMinCosine); }

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
        const Vector3 centre = voxel_centre({}, static_cast<std::uint16_t>(place));
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
        // Distance from the light along the view, in units of the origin's distance.
        const double nearest = 1 + e * (z - reach), farthest = 1 + e * (z + reach);
        const double aside = (1 + e * z) * (1 + e) + 2 * reach * e;
        if (farthest <= 0 || (e > 0 && std::max(std::abs(x), std::abs(y)) * e > aside)) {
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

// Computes the splats of points; holds the pointers that a loop over them needs.
class ShadowView::SplatsOfView {
  public:
    explicit SplatsOfView(const ShadowView &view)
        : place_of_(view.casters_.places().data()), normal_of_(view.casters_.normals().data()),
          offset_of_(view.casters_.offsets().surface.data()), layers_of_(view.casters_.offsets().layers.data()),
          places_(view.places_.data()), normals_(view.normals_.data()) {}

    // At the point's surface, which casts a shadow.
    Splat caster(const ViewBrick &brick, std::size_t i) const { return at(brick, i, offset_of_[i]); }
    // At the outermost layer above it, which receives shadows.
    Splat receiver(const ViewBrick &brick, std::size_t i) const { return at(brick, i, offset_of_[i] + layers_of_[i]); }

  private:
    Splat at(const ViewBrick &brick, std::size_t i, int steps) const {
        const auto &place = places_[place_of_[i]];
        const ViewNormal &n = normals_[normal_of_[i] & kNormalIndexMask];
        const float offset = static_cast<float>(steps) * (1.0F / kCarriedSteps);
        return {brick.corner[0] + place[0] + offset * n.x, brick.corner[1] + place[1] + offset * n.y,
                brick.corner[2] + place[2] + offset * n.z, &n};
    }

    const std::uint16_t *place_of_, *normal_of_;
    const std::int8_t *offset_of_;
    const std::uint8_t *layers_of_;
    const std::array<float, 4> *places_;
    const ViewNormal *normals_;
};

// Some rows of a map, and the transform into them.
struct ShadowView::Rows {
    int first, count, width;
    float *map;
    float inverse_distance, to_column, to_row; // added to u and v
    bool touch(const ViewBrick &brick) const { return brick.first_row < first + count && brick.last_row >= first; }
    float *row(int at) const { return map + static_cast<std::ptrdiff_t>(at) * width; }

    // The projection of a splat in the map, and its plane there.
    struct Footprint {
        float u, v, column, row, depth; // of the centre
        float step_u, step_v;           // of the depth
        float limit;                    // radius squared
    };
    template <bool kPerspective> void draw(const Splat &splat, float radius) const;
    template <bool kPerspective>
    void draw_square(const Splat &splat, const Footprint &footprint, int left, int top) const;
    template <bool kPerspective>
    void draw_texels(const Splat &splat, const Footprint &footprint, float wide, float high) const;
};

// Draws texels left, left + 1 of rows top, top + 1 without a branch: most splats cover no others, and half cover none.
template <bool kPerspective>
void ShadowView::Rows::draw_square(const Splat &splat, const Footprint &footprint, int left, int top) const {
    const float e = inverse_distance;
    const Float4 du = Float4{0, 1, 0, 1} + (static_cast<float>(left) - footprint.column);
    const Float4 dv = Float4{0, 0, 1, 1} + (static_cast<float>(top) - footprint.row);
    const Float4 there = footprint.depth + footprint.step_u * du + footprint.step_v * dv;
    Float4 x = du, y = dv, z = there - footprint.depth, reach = Float4{} + footprint.limit;
    if constexpr (kPerspective) { // multiplied by `back`, which undoes the projection
        const Float4 back = 1 - e * there;
        x = footprint.u + du - splat.x * back;
        y = footprint.v + dv - splat.y * back;
        z = there - splat.z * back;
        reach = back > 0 ? reach * back * back : Float4{} - 1;
    }
    const Float4 depths = x * x + y * y + z * z <= reach ? there : Float4{} + std::numeric_limits<float>::infinity();
    float *const upper = row(top) + left, *const lower = upper + width;
    upper[0] = std::min(upper[0], depths[0]);
    upper[1] = std::min(upper[1], depths[1]);
    lower[0] = std::min(lower[0], depths[2]);
    lower[1] = std::min(lower[1], depths[3]);
}

template <bool kPerspective>
void ShadowView::Rows::draw_texels(const Splat &splat, const Footprint &footprint, float wide, float high) const {
    const auto after = [](float low) { return static_cast<int>(std::max(low, -1.0F) + 1); };
    const auto last = [](float far, int size) {
        return static_cast<int>(std::clamp(far, -1.0F, static_cast<float>(size - 1)));
    };
    const float e = inverse_distance;
    const int left = after(footprint.column - wide), right = last(footprint.column + wide, width);
    const int top = after(footprint.row - high), bottom = last(footprint.row + high, count);
    for (int j = top; j <= bottom; ++j)
        for (int i = left; i <= right; ++i) {
            const float du = static_cast<float>(i) - footprint.column, dv = static_cast<float>(j) - footprint.row;
            const float there = footprint.depth + footprint.step_u * du + footprint.step_v * dv;
            float x = du, y = dv, z = there - footprint.depth, reach = footprint.limit;
            if constexpr (kPerspective) {
                const float back = 1 - e * there;
                if (back <= 0)
                    continue;
                x = footprint.u + du - splat.x * back;
                y = footprint.v + dv - splat.y * back;
                z = there - splat.z * back;
                reach = reach * back * back;
            }
            if (x * x + y * y + z * z <= reach)
                row(j)[i] = std::min(row(j)[i], there);
        }
}

template <bool kPerspective> void ShadowView::Rows::draw(const Splat &splat, float radius) const {
    const ViewNormal &n = *splat.normal;
    const float e = inverse_distance;
    float u = splat.x, v = splat.y, depth = splat.z, cosine = n.z;
    float wide = radius * n.wide, high = radius * n.high;
    if constexpr (kPerspective) {
        const float along = 1 + e * splat.z;
        // Reject splats outside of a view 90 degrees wide; a texel and the disc's diameter are the margin.
        const float aside = along * (1 + e) + 2 * radius * e;
        if (along <= kNearest * e || std::abs(u) * e > aside || std::abs(v) * e > aside)
            return;
        const float q = 1 / along;
        u *= q;
        v *= q;
        depth *= q;
        cosine += e * (n.x * splat.x + n.y * splat.y + n.z * splat.z);
        // The disc's half extents across the ray, scaled for the nearest position on its rim.
        const float deep = radius * n.deep * e, nearer = along - deep;
        const float scale = nearer > 0.1F * along ? 1 / nearer : 10 * q;
        wide = (wide + deep * std::abs(u)) * scale;
        high = (high + deep * std::abs(v)) * scale;
    }
    const float inverse = -1 / away_from_zero(cosine);
    const Footprint footprint{u, v, u + to_column, v + to_row, depth, n.x * inverse, n.y * inverse, radius * radius};
    const float left = footprint.column - wide, top = footprint.row - high;
    if (wide <= 1 && high <= 1 && left >= 0 && top >= 0 && left < static_cast<float>(width - 2) &&
        top < static_cast<float>(count - 2))
        draw_square<kPerspective>(splat, footprint, static_cast<int>(left) + 1, static_cast<int>(top) + 1);
    else
        draw_texels<kPerspective>(splat, footprint, wide, high);
}

template <bool kPerspective> void ShadowView::draw_bricks(const Rows &rows) const {
    const auto bricks = casters_.bricks();
    const std::uint8_t *const radius_of = casters_.radii().data();
    const float *const radii = radii_.data();
    const SplatsOfView splats(*this);
    for (std::size_t b = 0; b < bricks_.size(); ++b)
        if (rows.touch(bricks_[b]))
            for (std::size_t i = bricks[b].first_point, end = bricks[b + 1].first_point; i < end; ++i)
                rows.draw<kPerspective>(splats.caster(bricks_[b], i), radii[radius_of[i]]);
}

void ShadowView::draw(int first, int rows, std::span<float> map) const {
    std::fill(map.begin(), map.end(), std::numeric_limits<float>::infinity());
    const Rows part{
        first, rows, width_, map.data(), inverse_distance_, to_column_, to_row_ - static_cast<float>(first)};
    if (inverse_distance_ != 0)
        draw_bricks<true>(part);
    else
        draw_bricks<false>(part);
}

template <bool kPerspective> void ShadowView::vote_bricks(const Rows &rows, std::span<std::uint8_t> votes) const {
    const auto bricks = casters_.bricks();
    const SplatsOfView splats(*this);
    const float e = inverse_distance_;
    const bool one_of_six = view_.face >= 0;
    for (std::size_t b = 0; b < bricks_.size(); ++b) {
        if (!rows.touch(bricks_[b]))
            continue;
        for (std::size_t i = bricks[b].first_point, end = bricks[b + 1].first_point; i < end; ++i) {
            Splat p = splats.receiver(bricks_[b], i);
            const ViewNormal &n = *p.normal;
            float cosine = n.z;
            if constexpr (kPerspective)
                cosine += e * (n.x * p.x + n.y * p.y + n.z * p.z);
            if (cosine >= 0) {
                if (!casters_.has_two_sides(i))
                    continue;
                p = splats.caster(bricks_[b], i); // the layers above it lie behind its back
            }
            float q = 1;
            if constexpr (kPerspective) {
                const float along = 1 + e * p.z;
                if (along <= 0)
                    continue;
                q = 1 / along;
            }
            const float u = p.x * q, v = p.y * q;
            if constexpr (kPerspective)
                if (one_of_six && (u * e < -1 || u * e >= 1 || v * e < -1 || v * e >= 1))
                    continue;
            const float column = u + rows.to_column, row = v + rows.to_row;
            const int at_column = static_cast<int>(column + 0.5F), at_row = static_cast<int>(row + 0.5F);
            if (row < -0.5F || at_row >= rows.count)
                continue;
            // Raise the receiver towards the light.
            const float raised =
                cosine < 0 ? std::min(cosine + kBias * e, -kMinCosine) : std::max(cosine - kBias * e, kMinCosine);
            const float inverse = -1 / raised;
            const float there = p.z * q - kBias * q * std::abs(inverse) +
                                n.x * inverse * (static_cast<float>(at_column) - column) +
                                n.y * inverse * (static_cast<float>(at_row) - row);
            votes[i] = static_cast<std::uint8_t>(votes[i] + (rows.row(at_row)[at_column] >= there ? 1 : 0));
        }
    }
}

void ShadowView::vote(int first, int rows, std::span<float> map, std::span<std::uint8_t> votes) const {
    const Rows part{
        first, rows, width_, map.data(), inverse_distance_, to_column_, to_row_ - static_cast<float>(first)};
    if (inverse_distance_ != 0)
        vote_bricks<true>(part, votes);
    else
        vote_bricks<false>(part, votes);
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
    const double cosine = std::min(n[2] + e * (n[0] * x + n[1] * y + n[2] * z), -static_cast<double>(kMinCosine));
    const double texel_column = std::floor(column + 0.5), texel_row = std::floor(row + 0.5);
    const double depth = z / along - (n[0] * (texel_column - column) + n[1] * (texel_row - row)) / cosine;
    return {true, static_cast<int>(texel_row), static_cast<int>(texel_column), static_cast<float>(depth)};
}

// The map's inside is where four linear functions, one per border, are positive. Test each at its maximum in a square.
std::pair<std::uint32_t, std::uint32_t> ShadowView::visible_squares(const SquareRow &squares, int first_row,
                                                                    int rows) const {
    const Vector3 &corner = squares.corner, &along = squares.along, &across = squares.across;
    const std::uint32_t count = squares.count;
    const Vector3 from{corner[0] - view_.origin[0], corner[1] - view_.origin[1], corner[2] - view_.origin[2]};
    const double e = view_.inverse_distance;
    double first = 0, last = count;
    const auto keep = [&](const Vector3 &axis, double scale, double offset) { // scale axis . place + offset depth >= 0
        const auto value = [&](const Vector3 &way, double one) {
            return scale * dot(way, axis) + offset * (one + e * dot(way, view_.axes[2]));
        };
        const double slope = value(along, 0);
        const double least = value(from, 1) + std::max(value(across, 0), 0.0) + std::max(slope, 0.0);
        const double slack = 1e-6 * (std::abs(least) + count * std::abs(slope) + 1);
        if (slope > 0)
            first = std::max(first, std::floor(-(least + slack) / slope));
        else if (slope < 0)
            last = std::min(last, std::floor((least + slack) / -slope) + 1);
        else if (least + slack < 0)
            last = 0;
    };
    keep(view_.axes[0], 1, static_cast<double>(to_column_));
    keep(view_.axes[0], -1, width_ - 1 - static_cast<double>(to_column_));
    keep(view_.axes[1], 1, static_cast<double>(to_row_) - std::max(0.0, first_row - 0.5));
    keep(view_.axes[1], -1, std::min(height_ - 1.0, first_row + rows - 0.5) - static_cast<double>(to_row_));
    if (!(first < last))
        return {0, 0};
    return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last)};
}

} // namespace pbm
