#include "pbm_format/writing/stream_filter.h"

#include "pbm_format/model/octree.h"
#include "pbm_format/streams/mask_ranks.h"
#include "pbm_format/streams/predictions.h"

#include <algorithm>
#include <cassert>

namespace pbm {

namespace {

// Maps differences modulo 2^bits to numbers, small to small: 0, -1, 1, -2 .. to 0, 1, 2, 3 ..
unsigned zigzag(int difference, int bits) {
    const int half = 1 << (bits - 1);
    const int wrapped = ((difference + half) & (2 * half - 1)) - half;
    return static_cast<unsigned>(wrapped < 0 ? -2 * wrapped - 1 : 2 * wrapped);
}

// Two small numbers in one byte. Low half 15 means that both follow as an escape.
constexpr unsigned kEscape = 15;
bool fits_pair(unsigned low, unsigned high) { return low < kEscape && high < 16; }
std::uint8_t pair_code(unsigned low, unsigned high) { return static_cast<std::uint8_t>(low | high << 4); }

// Writes the bytes of a plane in order; its size is known.
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

// Calls visit(parent, point) for points with siblings. Returns false if an only child is not the `same` as its parent.
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
            // Red and blue have half as many steps as green: half of green's difference, rounded towards zero.
            const auto half_size = static_cast<int>((green + 1) >> 2);
            const int half = (green & 1) != 0 ? -half_size : half_size;
            greens.push(green);
            push_red_blue(pairs, planes[2], zigzag((to >> 11) - (from >> 11) - half, 5),
                          zigzag((to & 31) - (from & 31) - half, 5));
        });
}

// Filters streams of one byte per point: `code(to, from)` encodes the difference of a point to its parent.
template <class Code>
bool filter_bytes(ByteView masks, ByteView points, ByteView parents, std::vector<Bytes> &planes, Code &&code) {
    PlaneWriter codes(planes[0], count_siblings(masks));
    return for_siblings(
        masks, [&](std::size_t node, std::size_t point) { return points[point] == parents[node]; },
        [&](std::size_t node, std::size_t point) { codes.push(code(points[point], parents[node])); });
}

// Visits all points: radii and lit fractions of only children differ from their parents', so every point has a code.
template <class Visit> void for_children(ByteView masks, Visit &&visit) {
    std::size_t point = 0;
    for (std::size_t node = 0; node < masks.size(); ++node)
        for (const std::size_t end = point + kChildren[masks[node]]; point < end; ++point)
            visit(node, point);
}

} // namespace

std::optional<std::vector<Bytes>> filter_stream(const StreamContext &context, ByteView masks, const PointView &points,
                                                const ChunkNodes &nodes) {
    const Filter filter = filter_of(context.stream, context.set);
    std::vector<Bytes> planes(plane_count(filter));
    bool possible = true;
    const auto values = [&](const PointView &of) { return of.values(context.stream); };
    switch (filter) {
    case Filter::none:
    case Filter::texels:
    case Filter::field16: return std::nullopt;
    case Filter::mask_rank:
        planes[0].resize(masks.size());
        rank_masks(masks, {.parent_masks = nodes.parent_masks, .node_normals = nodes.attributes.normals}, planes[0]);
        break;
    case Filter::normal: possible = filter_normals(masks, points.normals, nodes.attributes.normals, planes); break;
    case Filter::colour565:
        possible = filter_colours_565(masks, values(points), values(nodes.attributes), planes);
        break;
    case Filter::colour888:
        possible = filter_colours_888(masks, values(points), values(nodes.attributes), planes);
        break;
    case Filter::material:
        possible = filter_bytes(masks, values(points), values(nodes.attributes), planes,
                                [](unsigned to, unsigned from) { return to ^ from; });
        break;
    case Filter::texture:
        possible = filter_bytes(masks, values(points), values(nodes.attributes), planes,
                                [](int to, int from) { return zigzag(to - from, 8); });
        break;
    case Filter::radius: {
        planes[0].resize(values(points).size());
        for_children(masks, [from = values(nodes.attributes).data(), radii = values(points).data(),
                             prediction = radius_predictions(context.level, context.finest).data(),
                             to = planes[0].data()](std::size_t node, std::size_t point) {
            to[point] = static_cast<std::uint8_t>(prediction[from[node]] - radii[point]);
        });
        break;
    }
    case Filter::shadow: {
        const unsigned here = bits_per_point(context.stream, context.set, context.level);
        const auto predictions =
            shadow_predictions(bits_per_point(context.stream, context.set, context.level - 1), here);
        Bytes codes;
        for_children(
            masks, [&, to = values(points), from = values(nodes.attributes)](std::size_t node, std::size_t point) {
                codes.push_back(static_cast<std::uint8_t>((to[point] - predictions[from[node]]) & ((1 << here) - 1)));
            });
        planes[0] = pack_bits(codes, here);
        break;
    }
    }
    if (!possible)
        return std::nullopt;
    return planes;
}

std::optional<std::vector<Bytes>> filter_field(const Field &field, ByteView masks, ByteView points, ByteView parents) {
    std::vector<Bytes> planes(field.bytes);
    const std::size_t codes = count_siblings(masks);
    PlaneWriter low(planes[0], codes), high(planes.back(), codes);
    const auto change = [&](std::size_t node, std::size_t point) {
        return static_cast<int>(stored_value(points, point, field.bytes)) -
               static_cast<int>(stored_value(parents, node, field.bytes));
    };
    const bool possible = for_siblings(
        masks, [&](std::size_t node, std::size_t point) { return change(node, point) == 0; },
        [&](std::size_t node, std::size_t point) {
            const unsigned code = zigzag(change(node, point), 8 * field.bytes);
            if (field.bytes == 2)
                high.push(code >> 8);
            low.push(code);
        });
    return possible ? std::optional(std::move(planes)) : std::nullopt;
}

} // namespace pbm
