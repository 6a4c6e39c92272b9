#include "random_models/random_model.h"

#include <algorithm>
#include <array>
#include <functional>

namespace pbm::test {

namespace {

using Place = std::array<std::uint32_t, 3>;

// Collects voxels inside the grid.
class Voxels {
  public:
    Voxels(Random &random, int depth, std::size_t most) : random_(random), edge_(1U << depth), most_(most) {}

    void add_shape();
    std::vector<MortonCode> take();

  private:
    std::uint32_t anywhere() { return static_cast<std::uint32_t>(random_.below(edge_)); }
    Place place() { return {anywhere(), anywhere(), anywhere()}; }
    // A length of 1 .. `most`, at most the edge of the grid.
    std::uint32_t length(std::uint32_t most) {
        return 1 + static_cast<std::uint32_t>(random_.below(std::min(most, edge_)));
    }
    std::uint32_t wrap(double coordinate) const {
        return std::min(edge_ - 1, static_cast<std::uint32_t>(std::max(0.0, coordinate * edge_)));
    }
    void add(const Place &p) {
        if (codes_.size() < 2 * most_ && std::max({p[0], p[1], p[2]}) < edge_)
            codes_.push_back(morton_encode(p[0], p[1], p[2]));
    }
    void add_box(const Place &least, const Place &size);
    void add_clusters();
    void add_shell();
    void add_relief();
    void add_full_subtree();

    Random &random_;
    std::uint32_t edge_;
    std::size_t most_;
    std::vector<MortonCode> codes_;
};

void Voxels::add_box(const Place &least, const Place &size) {
    for (std::uint32_t z = 0; z < size[2]; ++z)
        for (std::uint32_t y = 0; y < size[1]; ++y)
            for (std::uint32_t x = 0; x < size[0]; ++x)
                add({least[0] + x, least[1] + y, least[2] + z});
}

void Voxels::add_clusters() {
    for (std::uint64_t cluster = 1 + random_.below(6); cluster > 0; --cluster) {
        const Place middle = place();
        const std::uint64_t width = std::uint64_t{1} << random_.below(8);
        for (std::uint64_t points = random_.below(most_ / 2 + 1); points > 0; --points) {
            Place p = middle;
            for (std::uint32_t &coordinate : p) // negative values wrap to outside the grid and are not added
                coordinate += static_cast<std::uint32_t>(random_.below(width) - random_.below(width));
            add(p);
        }
    }
}

void Voxels::add_shell() {
    const double radius = 0.02 + 0.45 * random_.unit();
    for (std::size_t points = 1 + random_.below(most_); points > 0; --points) {
        std::array<double, 3> v{};
        double length = 0;
        for (double &component : v) {
            component = 2 * random_.unit() - 1;
            length += component * component;
        }
        const double scale = radius / std::sqrt(length + 1e-9);
        add({wrap(0.5 + v[0] * scale), wrap(0.5 + v[1] * scale), wrap(0.5 + v[2] * scale)});
    }
}

// Like a scan: a height field over a random pair of axes.
void Voxels::add_relief() {
    const std::uint32_t edge = length(most_ > 4096 ? 128 : 64), height = length(16);
    const Place least = place();
    const std::size_t up = random_.below(3);
    const std::uint64_t slope_u = random_.below(16), slope_v = random_.below(16);
    for (std::uint32_t v = 0; v < edge; ++v)
        for (std::uint32_t u = 0; u < edge; ++u) {
            Place p = least;
            p[(up + 1) % 3] += u;
            p[(up + 2) % 3] += v;
            p[up] += static_cast<std::uint32_t>((u * slope_u + v * slope_v) / 16 % height);
            add(p);
        }
}

// A full cube of 8^3 (one chunk of limit 512), 16^3 or 32^3 voxels (chunks nest); sometimes one voxel more.
void Voxels::add_full_subtree() {
    const std::uint64_t larger = random_.below(4) * random_.below(2); // 0, 0, 0, 0, 0, 1, 2, 3
    const std::uint32_t edge = std::min(edge_, larger == 3 && most_ > 4096 ? 32U : larger >= 2 ? 16U : 8U);
    Place least = place();
    for (std::uint32_t &coordinate : least)
        coordinate -= coordinate % edge;
    add_box(least, {edge, edge, edge});
    if (once_in(random_, 2))
        add(place());
}

void Voxels::add_shape() {
    switch (random_.below(10)) {
    case 0: return add(place());
    case 1:
        for (std::uint64_t points = 1 + random_.below(20); points > 0; --points)
            add(place());
        return;
    case 2: { // a line or a plane
        Place size{1, 1, 1};
        size[random_.below(3)] = length(64);
        size[random_.below(3)] = length(64);
        return add_box(place(), size);
    }
    case 3: return add_box(place(), {length(12), length(12), length(12)});
    case 4: return add_clusters();
    case 5: return add_shell();
    case 6: return add_relief();
    case 7: return add_full_subtree();
    case 8: // scattered
        for (std::size_t points = 1 + random_.below(most_); points > 0; --points)
            add(place());
        return;
    default: // corners of the grid
        for (const std::uint32_t x : {0U, edge_ - 1})
            for (const std::uint32_t y : {0U, edge_ - 1})
                for (const std::uint32_t z : {0U, edge_ - 1})
                    if (once_in(random_, 2))
                        add({x, y, z});
    }
}

std::vector<MortonCode> Voxels::take() {
    if (codes_.empty())
        add(place());
    std::sort(codes_.begin(), codes_.end());
    codes_.erase(std::unique(codes_.begin(), codes_.end()), codes_.end());
    return std::move(codes_);
}

// Values 0 .. limit - 1 for each voxel, by one of five patterns.
class Values {
  public:
    Values(Random &random, int depth) : random_(random), depth_(depth), kind_(random.below(5)) {
        for (std::uint64_t &factor : factors_)
            factor = random.below(8);
    }

    std::uint64_t at(MortonCode code, std::uint64_t limit) {
        const auto [x, y, z] = morton_decode(code);
        const std::uint64_t sum = x * factors_[0] + y * factors_[1] + z * factors_[2] + factors_[3];
        switch (kind_) {
        case 0: return factors_[3] * (limit - 1) / 7; // constant
        case 1: return sum % limit;
        case 2: return (sum >> std::max(0, depth_ - 5)) * (limit - 1) / 1024 % limit; // varies slowly
        case 3: return Random(code >> 6).below(limit);                                // constant in cubes of 4 x 4 x 4
        default: return random_.below(limit);
        }
    }

  private:
    Random &random_;
    int depth_;
    std::uint64_t kind_;
    std::array<std::uint64_t, 4> factors_{};
};

std::uint16_t random_normal(Random &random, MortonCode code, int depth, std::uint64_t kind) {
    if (kind == 0)
        return static_cast<std::uint16_t>(random.below(kNormalCount));
    const auto [x, y, z] = morton_decode(code);
    const double middle = static_cast<double>(1U << depth) / 2;
    const double noise = kind == 1 ? 0 : 0.3;
    const auto component = [&](std::uint32_t c) { return (c + 0.5 - middle) / middle + noise * (random.unit() - 0.5); };
    return kind == 3 ? quantise_normal(0, 0, 1) : quantise_normal(component(x), component(y), component(z));
}

} // namespace

std::vector<MortonCode> random_voxels(Random &random, int depth, std::size_t most) {
    Voxels voxels(random, depth, most);
    for (std::uint64_t shapes = 1 + random.below(2) * random.below(3); shapes > 0; --shapes)
        voxels.add_shape();
    return voxels.take();
}

PointAttributes random_points(Random &random, std::span<const MortonCode> codes, int depth, const AttributeSet &set,
                              std::size_t materials) {
    PointAttributes points;
    points.resize(codes.size(), set);
    const std::uint64_t normals = random.below(4), two_sided = random.below(4);
    for (std::size_t i = 0; i < codes.size(); ++i) {
        points.normals[i] = random_normal(random, codes[i], depth, normals);
        if (two_sided == 1 || (two_sided == 2 && once_in(random, 10)))
            points.normals[i] |= kTwoSidedBit;
    }
    const auto fill = [&](Bytes &stream, std::uint64_t limit) {
        Values values(random, depth);
        for (std::size_t i = 0; i < stream.size(); ++i)
            stream[i] = static_cast<std::uint8_t>(values.at(codes[i], limit));
    };
    fill(points.radii, kMaxFinestRadius + 1U);
    if (set.colour != ColourFormat::none) {
        std::array<Values, 3> channels{Values(random, depth), Values(random, depth), Values(random, depth)};
        for (std::size_t i = 0; i < codes.size(); ++i) {
            Rgb8 colour{};
            for (std::size_t c = 0; c < 3; ++c)
                colour[c] = static_cast<std::uint8_t>(channels[c].at(codes[i], 256));
            set_point_colour(points, i, set.colour, colour);
        }
    }
    fill(points.materials, materials);
    fill(points.textures, 256);
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
        fill(points.shadows[light], std::uint64_t{1} << set.shadow_bits[light][static_cast<std::size_t>(depth)]);
    return points;
}

} // namespace pbm::test
