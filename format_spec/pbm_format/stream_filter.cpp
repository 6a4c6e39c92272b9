#include "pbm_format/stream_filter.h"

#include "pbm_format/mask_ranks.h"
#include "pbm_format/octree.h"

#include <algorithm>
#include <cassert>

namespace pbm {

Filter filter_of(const StreamInfo &stream, const AttributeSet &set) {
    switch (stream.kind) {
    case StreamKind::masks: return Filter::mask_rank;
    case StreamKind::normal: return Filter::normal;
    case StreamKind::radius: return Filter::radius;
    case StreamKind::colour: return set.colour == ColourFormat::rgb565 ? Filter::colour565 : Filter::colour888;
    case StreamKind::material: return Filter::material;
    case StreamKind::texture: return Filter::texture;
    case StreamKind::shadow: return Filter::shadow;
    }
    return Filter::none;
}

std::size_t plane_count(Filter filter) {
    switch (filter) {
    case Filter::none:
    case Filter::texels: return 0;
    case Filter::normal: return 2;
    case Filter::colour565:
    case Filter::colour888: return 3;
    case Filter::mask_rank:
    case Filter::radius:
    case Filter::material:
    case Filter::texture:
    case Filter::shadow: return 1;
    }
    return 0;
}

PointView view_points(const PointAttributes &points, std::size_t first, std::size_t count, const AttributeSet &set) {
    const auto colour_bytes = static_cast<std::size_t>(set.colour_bytes());
    PointView view;
    view.normals = std::span(points.normals).subspan(first, count);
    view.radii = ByteView(points.radii).subspan(first, count);
    view.colours = ByteView(points.colours).subspan(colour_bytes * first, colour_bytes * count);
    if (set.material)
        view.materials = ByteView(points.materials).subspan(first, count);
    if (set.texture)
        view.textures = ByteView(points.textures).subspan(first, count);
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
        view.shadows[light] = ByteView(points.shadows[light]).subspan(first, count);
    return view;
}

namespace {

// Small differences of either sign become small numbers: 0, -1, 1, -2 .. are 0, 1, 2, 3 ..
// `bits` is the width of the wheel on which differences wrap.
unsigned zigzag(int difference, int bits) {
    const int half = 1 << (bits - 1);
    const int wrapped = ((difference + half) & (2 * half - 1)) - half;
    return static_cast<unsigned>(wrapped < 0 ? -2 * wrapped - 1 : 2 * wrapped);
}

// Two small numbers in one byte. Low half 15 says that they follow as an escape.
constexpr unsigned kEscape = 15;
bool fits_pair(unsigned low, unsigned high) { return low < kEscape && high < 16; }
std::uint8_t pair_code(unsigned low, unsigned high) { return static_cast<std::uint8_t>(low | high << 4); }

// Bytes of a plane that has its final size, one after the other.
class PlaneWriter {
  public:
    PlaneWriter(Bytes &plane, std::size_t size) {
        plane.resize(size);
        next_ = plane.data();
    }
    void push(unsigned value) { *next_++ = static_cast<std::uint8_t>(value); }

  private:
    std::uint8_t *next_;
};

void push_escape(Bytes &plane, unsigned first, unsigned second) {
    plane.push_back(static_cast<std::uint8_t>(first));
    plane.push_back(static_cast<std::uint8_t>(second));
}

std::size_t count_siblings(ByteView masks) {
    std::size_t count = 0;
    for (const std::uint8_t mask : masks)
        count += (mask & (mask - 1)) == 0 ? 0U : kChildren[mask];
    return count;
}

// Calls visit(parent, point) for every point that has siblings. False if an only child is not `same` as its parent.
template <class Same, class Visit> bool for_siblings(ByteView masks, Same &&same, Visit &&visit) {
    std::size_t point = 0;
    for (std::size_t node = 0; node < masks.size(); ++node) {
        const unsigned children = kChildren[masks[node]];
        if (children == 1) {
            if (!same(node, point++))
                return false;
            continue;
        }
        for (const std::size_t end = point + children; point < end; ++point)
            visit(node, point);
    }
    return true;
}

bool filter_normals(ByteView masks, std::span<const std::uint16_t> points, std::span<const std::uint16_t> parents,
                    std::vector<Bytes> &planes) {
    const std::span<const std::uint16_t> cells = normal_cells();
    constexpr unsigned kOctant = 0x1C00;
    PlaneWriter codes(planes[0], count_siblings(masks));
    return for_siblings(
        masks, [&](std::size_t node, std::size_t point) { return points[point] == parents[node]; },
        [&](std::size_t node, std::size_t point) {
            const unsigned octant = parents[node] & kOctant;
            const int from = cells[(parents[node] ^ octant) & kNormalIndexMask];
            const int to = cells[(points[point] ^ octant) & kNormalIndexMask];
            const unsigned du = zigzag((to & 127) - (from & 127), 7), dv = zigzag((to >> 7) - (from >> 7), 6);
            const bool turned = ((points[point] ^ parents[node]) & kTwoSidedBit) != 0;
            if (!turned && fits_pair(du, dv)) {
                codes.push(pair_code(du, dv));
            } else {
                codes.push(kEscape);
                push_escape(planes[1], du | (turned ? 128U : 0U), dv);
            }
        });
}

void push_red_blue(PlaneWriter &codes, Bytes &escapes, unsigned red, unsigned blue) {
    if (fits_pair(red, blue)) {
        codes.push(pair_code(red, blue));
    } else {
        codes.push(kEscape);
        push_escape(escapes, red, blue);
    }
}

bool filter_colours_888(ByteView masks, ByteView points, ByteView parents, std::vector<Bytes> &planes) {
    const std::size_t siblings = count_siblings(masks);
    PlaneWriter greens(planes[0], siblings), pairs(planes[1], siblings);
    return for_siblings(
        masks,
        [&](std::size_t node, std::size_t point) {
            return std::equal(&points[3 * point], &points[3 * point] + 3, &parents[3 * node]);
        },
        [&](std::size_t node, std::size_t point) {
            const std::uint8_t *to = &points[3 * point], *from = &parents[3 * node];
            const int green = to[1] - from[1];
            greens.push(zigzag(green, 8));
            push_red_blue(pairs, planes[2], zigzag(to[0] - from[0] - green, 8), zigzag(to[2] - from[2] - green, 8));
        });
}

bool filter_colours_565(ByteView masks, ByteView points, ByteView parents, std::vector<Bytes> &planes) {
    const std::size_t siblings = count_siblings(masks);
    PlaneWriter greens(planes[0], siblings), pairs(planes[1], siblings);
    const auto packed = [](ByteView colours, std::size_t i) { return colours[2 * i] | colours[2 * i + 1] << 8; };
    return for_siblings(
        masks, [&](std::size_t node, std::size_t point) { return packed(points, point) == packed(parents, node); },
        [&](std::size_t node, std::size_t point) {
            const int to = packed(points, point), from = packed(parents, node);
            const unsigned green = zigzag((to >> 5 & 63) - (from >> 5 & 63), 6);
            // Red and blue have half as many steps as green: half its difference, towards zero.
            const auto half_size = static_cast<int>((green + 1) >> 2);
            const int half = (green & 1) != 0 ? -half_size : half_size;
            greens.push(green);
            push_red_blue(pairs, planes[2], zigzag((to >> 11) - (from >> 11) - half, 5),
                          zigzag((to & 31) - (from & 31) - half, 5));
        });
}

bool filter_materials(ByteView masks, ByteView points, ByteView parents, Bytes &codes) {
    return for_siblings(
        masks, [&](std::size_t node, std::size_t point) { return points[point] == parents[node]; },
        [&](std::size_t node, std::size_t point) {
            codes.push_back(static_cast<std::uint8_t>(points[point] ^ parents[node]));
        });
}

bool filter_textures(ByteView masks, ByteView points, ByteView parents, Bytes &codes) {
    return for_siblings(
        masks, [&](std::size_t node, std::size_t point) { return points[point] == parents[node]; },
        [&](std::size_t node, std::size_t point) {
            codes.push_back(static_cast<std::uint8_t>(zigzag(points[point] - parents[node], 8)));
        });
}

// Radii and lit fractions of only children are no copies of their parents': every point has a code.
template <class Visit> void for_children(ByteView masks, Visit &&visit) {
    std::size_t point = 0;
    for (std::size_t node = 0; node < masks.size(); ++node)
        for (const std::size_t end = point + kChildren[masks[node]]; point < end; ++point)
            visit(node, point);
}

} // namespace

const std::array<std::uint8_t, 256> &radius_predictions(int level, bool finest) {
    assert(level >= 1 && level <= kMaxDepth);
    thread_local std::array<std::array<std::optional<std::array<std::uint8_t, 256>>, 2>, kMaxDepth + 1> known;
    auto &predictions = known[static_cast<std::size_t>(level)][finest ? 1 : 0];
    if (predictions)
        return *predictions;
    predictions.emplace();
    const unsigned most = finest ? kMaxFinestRadius : 255U;
    unsigned child = 0;
    for (unsigned parent = 0; parent < 256; ++parent) {
        while (child < most && covering_radius(static_cast<std::uint8_t>(child + 1), level - 1) <= parent)
            ++child;
        (*predictions)[parent] = static_cast<std::uint8_t>(child);
    }
    return *predictions;
}

std::array<std::uint8_t, 256> shadow_predictions(unsigned parent_bits, unsigned bits) {
    const unsigned parent_scale = (1U << parent_bits) - 1, scale = (1U << bits) - 1;
    std::array<std::uint8_t, 256> predictions{};
    for (unsigned parent = 0; parent < 256; ++parent)
        predictions[parent] =
            static_cast<std::uint8_t>((2 * std::min(parent, parent_scale) * scale + parent_scale) / (2 * parent_scale));
    return predictions;
}

std::optional<std::vector<Bytes>> filter_stream(const StreamContext &context, ByteView masks, const PointView &points,
                                                const ParentNodes &parents) {
    const Filter filter = filter_of(context.stream, context.set);
    std::vector<Bytes> planes(plane_count(filter));
    bool possible = true;
    switch (filter) {
    case Filter::none:
    case Filter::texels: return std::nullopt;
    case Filter::mask_rank:
        planes[0].resize(masks.size());
        rank_masks(masks, {.parent_masks = parents.masks, .node_normals = parents.nodes.normals}, planes[0]);
        break;
    case Filter::normal: possible = filter_normals(masks, points.normals, parents.nodes.normals, planes); break;
    case Filter::colour565: possible = filter_colours_565(masks, points.colours, parents.nodes.colours, planes); break;
    case Filter::colour888: possible = filter_colours_888(masks, points.colours, parents.nodes.colours, planes); break;
    case Filter::material:
        possible = filter_materials(masks, points.materials, parents.nodes.materials, planes[0]);
        break;
    case Filter::texture: possible = filter_textures(masks, points.textures, parents.nodes.textures, planes[0]); break;
    case Filter::radius: {
        const auto &predictions = radius_predictions(context.level, context.finest);
        planes[0].resize(points.radii.size());
        for_children(masks,
                     [from = parents.nodes.radii.data(), radii = points.radii.data(), prediction = predictions.data(),
                      to = planes[0].data()](std::size_t node, std::size_t point) {
                         to[point] = static_cast<std::uint8_t>(prediction[from[node]] - radii[point]);
                     });
        break;
    }
    case Filter::shadow: {
        const std::size_t light = context.stream.light;
        const auto &bits = context.set.shadow_bits[light];
        const unsigned here = bits[static_cast<std::size_t>(context.level)];
        const auto predictions = shadow_predictions(bits[static_cast<std::size_t>(context.level - 1)], here);
        Bytes codes;
        for_children(masks, [&](std::size_t node, std::size_t point) {
            codes.push_back(static_cast<std::uint8_t>(
                (points.shadows[light][point] - predictions[parents.nodes.shadows[light][node]]) & ((1 << here) - 1)));
        });
        planes[0] = pack_bits(codes, here);
        break;
    }
    }
    if (!possible)
        return std::nullopt;
    return planes;
}

} // namespace pbm
