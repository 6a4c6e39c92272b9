// Filters: un-filtering inverts filtering with every SIMD target; only children have no codes.
#include "unit/support/test_models.h"

#include "pbm_format/chunks/chunk.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/streams/predictions.h"
#include "pbm_format/streams/unfilter.h"
#include "pbm_format/writing/stream_filter.h"
#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <bit>
#include <functional>

#include <hwy/targets.h>

namespace {

using namespace pbm;
using test::Random;

// Masks of `nodes` nodes; on average one node in `singles` has an only child.
Bytes random_masks(Random &random, std::size_t nodes, std::uint64_t singles) {
    Bytes masks;
    while (masks.size() < nodes)
        masks.push_back(random.below(singles) == 0 ? static_cast<std::uint8_t>(1U << random.below(8))
                                                   : static_cast<std::uint8_t>(1 + random.below(255)));
    return masks;
}

// Random attributes. If `spread` != 0, points differ from their parents by little; only children equal them.
struct Family {
    AttributeSet set;
    int level = 3;
    Bytes masks;
    PointAttributes parents, points;
};

PointAttributes random_points(Random &random, std::size_t count, const AttributeSet &set, int level) {
    PointAttributes points;
    points.resize(count, set);
    const auto fill = [&](Bytes &bytes, std::uint64_t limit) {
        for (std::uint8_t &byte : bytes)
            byte = static_cast<std::uint8_t>(random.below(limit));
    };
    for (std::uint16_t &normal : points.normals)
        normal = static_cast<std::uint16_t>(random.below(2 * kNormalCount));
    fill(points.radii, 204);
    fill(points.colours, 256);
    fill(points.materials, 8);
    fill(points.textures, 256);
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
        fill(points.shadows[light], std::uint64_t{1} << set.shadow_bits[light][static_cast<std::size_t>(level)]);
    return points;
}

Family random_family(std::uint64_t seed, std::size_t nodes, ColourFormat colour, std::uint64_t singles, int spread) {
    Random random(seed);
    Family family;
    family.set = {.colour = colour, .material = true, .texture = true, .lights = 3, .shadow_bits = {}};
    for (std::size_t level = 0; level <= kMaxDepth; ++level) {
        family.set.shadow_bits[0][level] = level == 3 ? 1 : 4;
        family.set.shadow_bits[1][level] = 8;
        family.set.shadow_bits[2][level] = level == 3 ? 2 : 1;
    }
    family.masks = random_masks(random, nodes, singles);
    const std::size_t count = count_children(family.masks);
    family.parents = random_points(random, nodes, family.set, family.level - 1);
    family.points = random_points(random, count, family.set, family.level);
    std::size_t point = 0;
    for (std::size_t node = 0; node < nodes; ++node)
        for (unsigned left = family.masks[node]; left != 0; left &= left - 1, ++point) {
            const bool only = std::has_single_bit(family.masks[node]);
            const auto near = [&](std::uint8_t value) {
                const std::uint64_t size = 2 * static_cast<std::uint64_t>(spread) + 1;
                return static_cast<std::uint8_t>(value + (only ? 0 : static_cast<int>(random.below(size)) - spread));
            };
            if (only || spread != 0) {
                const IntegerNormal n = integer_normal_table()[family.parents.normals[node] & kNormalIndexMask];
                const double size = only ? 0 : 1000.0 * spread;
                const auto two_sided = static_cast<std::uint16_t>(family.parents.normals[node] & kTwoSidedBit);
                family.points.normals[point] = static_cast<std::uint16_t>(
                    quantise_normal(n[0] + size * (random.unit() - 0.5), n[1] + size * (random.unit() - 0.5),
                                    n[2] + size * (random.unit() - 0.5)) |
                    two_sided);
                const auto bytes = static_cast<std::size_t>(family.set.colour_bytes());
                for (std::size_t c = 0; c < bytes; ++c)
                    family.points.colours[bytes * point + c] = near(family.parents.colours[bytes * node + c]);
                family.points.materials[point] = family.parents.materials[node];
                family.points.textures[point] = near(family.parents.textures[node]);
            }
        }
    return family;
}

// Un-filters all streams of a family as a chunk decoder does; each stream has planes of its own.
PointAttributes unfilter(const Family &family, const std::function<std::vector<Bytes>(StreamInfo)> &planes_of) {
    UnfilterScratch scratch;
    scratch.layout.build(family.masks, summarise_masks(family.masks));
    PointAttributes points;
    points.resize(scratch.layout.points(), family.set);
    const auto padded = [](Bytes &plane) {
        const std::size_t size = plane.size();
        plane.resize(size + kSlack);
        return ByteView(plane).first(size);
    };
    for (const StreamInfo &stream : streams_of(family.set)) {
        std::vector<Bytes> planes = planes_of(stream);
        const PointAttributes &from = family.parents;
        switch (filter_of(stream, family.set)) {
        case Filter::normal: {
            const ByteView codes = padded(planes[0]);
            EXPECT_EQ(count_escapes(codes).count * 2, planes[1].size());
            EXPECT_TRUE(unfilter_normals(scratch, from.normals, codes, planes[1], points.normals).valid);
            break;
        }
        case Filter::colour565:
            unfilter_colours_565(scratch, from.colours, padded(planes[0]), padded(planes[1]), planes[2],
                                 points.colours);
            break;
        case Filter::colour888:
            unfilter_colours_888(scratch, from.colours, padded(planes[0]), padded(planes[1]), planes[2],
                                 points.colours);
            break;
        case Filter::material: unfilter_materials(scratch, from.materials, padded(planes[0]), points.materials); break;
        case Filter::texture: unfilter_textures(scratch, from.textures, padded(planes[0]), points.textures); break;
        case Filter::radius:
            unfilter_radii(scratch, from.radii, radius_predictions(family.level, false), padded(planes[0]),
                           points.radii);
            break;
        case Filter::shadow: {
            const auto &bits = family.set.shadow_bits[stream.light];
            Bytes codes(scratch.layout.points());
            unpack_bits(planes[0], bits[3], codes);
            unfilter_shadows(scratch, from.shadows[stream.light], shadow_predictions(bits[2], bits[3]), bits[3],
                             padded(codes), points.shadows[stream.light]);
            break;
        }
        case Filter::mask_rank:
        case Filter::texels:
        case Filter::field16:
        case Filter::none: break;
        }
    }
    return points;
}

std::vector<Bytes> filtered(const Family &family, StreamInfo stream) {
    const PointView points = view_points(family.points, 0, family.points.size(), family.set);
    const Bytes root{1};
    const ParentNodes parents{.masks = root, .nodes = view_points(family.parents, 0, family.masks.size(), family.set)};
    return filter_stream({.set = family.set, .stream = stream, .level = family.level, .finest = false}, family.masks,
                         points, parents)
        .value();
}

TEST(Filters, EveryStreamComesBackExactly) {
    std::uint64_t seed = 1;
    for (const std::size_t nodes : {1U, 2U, 3U, 5U, 16U, 17U, 100U, 1000U, 20000U})
        for (const ColourFormat colour : {ColourFormat::rgb565, ColourFormat::rgb888})
            for (const std::uint64_t singles : {1U, 2U, 10U, 1000000U})
                for (const int spread : {0, 3, 40}) {
                    const Family family = random_family(seed++, nodes, colour, singles, spread);
                    const PointAttributes back = unfilter(family, [&](StreamInfo s) { return filtered(family, s); });
                    ASSERT_EQ(back, family.points) << nodes << " nodes, seed " << seed - 1;
                }
}

TEST(Filters, OnlyChildrenHaveNoCodes) {
    const Family family = random_family(5, 1000, ColourFormat::rgb888, 1, 0);
    ASSERT_EQ(family.points.size(), 1000U);
    for (const StreamKind kind : {StreamKind::normal, StreamKind::colour, StreamKind::material, StreamKind::texture})
        for (const Bytes &plane : filtered(family, {kind, 0}))
            EXPECT_TRUE(plane.empty()) << to_string(kind);
    EXPECT_EQ(filtered(family, {StreamKind::radius, 0}).front().size(), 1000U);
}

TEST(Filters, AnOnlyChildThatIsNotItsParentCannotBeFiltered) {
    const Family good = random_family(6, 50, ColourFormat::rgb888, 2, 2);
    std::size_t node = 0, point = 0;
    while (!std::has_single_bit(good.masks[node]))
        point += static_cast<std::size_t>(std::popcount(good.masks[node++]));
    const auto possible = [&](StreamKind kind, const std::function<void(PointAttributes &)> &edit) {
        Family family = good;
        edit(family.points);
        const ParentNodes parents{.masks = {},
                                  .nodes = view_points(family.parents, 0, family.masks.size(), family.set)};
        return filter_stream({.set = family.set, .stream = {kind, 0}, .level = 3, .finest = false}, family.masks,
                             view_points(family.points, 0, family.points.size(), family.set), parents)
            .has_value();
    };
    const auto nothing = [](PointAttributes &) {};
    EXPECT_TRUE(possible(StreamKind::normal, nothing));
    EXPECT_FALSE(possible(StreamKind::normal, [&](PointAttributes &p) { p.normals[point] ^= kTwoSidedBit; }));
    EXPECT_TRUE(possible(StreamKind::colour, nothing));
    EXPECT_FALSE(possible(StreamKind::colour, [&](PointAttributes &p) { p.colours[3 * point + 2] ^= 1; }));
    EXPECT_FALSE(possible(StreamKind::material, [&](PointAttributes &p) { p.materials[point] ^= 1; }));
    EXPECT_FALSE(possible(StreamKind::texture, [&](PointAttributes &p) { p.textures[point] ^= 1; }));
    EXPECT_TRUE(possible(StreamKind::radius, [&](PointAttributes &p) { p.radii[point] ^= 1; }));
}

TEST(Filters, EveryInstructionSetGivesTheSameBytes) {
    const auto all = [] {
        std::vector<PointAttributes> results;
        for (const ColourFormat colour : {ColourFormat::rgb565, ColourFormat::rgb888})
            for (const int spread : {0, 6}) {
                const Family family = random_family(9, 3333, colour, 4, spread);
                results.push_back(unfilter(family, [&](StreamInfo s) { return filtered(family, s); }));
            }
        return results;
    };
    const std::vector<PointAttributes> expected = all();
    int tried = 0;
    for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1, ++tried) {
        const std::int64_t one = targets & -targets;
        hwy::SetSupportedTargetsForTest(one);
        EXPECT_EQ(all(), expected) << hwy::TargetName(one);
    }
    hwy::SetSupportedTargetsForTest(0);
    EXPECT_GE(tried, HWY_ARCH_X86 ? 2 : 1);
}

// Random codes, which no writer makes: un-filtering stays in bounds and gives legal normals.
TEST(Filters, ArbitraryCodesDoNoHarm) {
    for (std::uint64_t seed = 100; seed < 200; ++seed) {
        const ColourFormat colour = seed % 2 == 0 ? ColourFormat::rgb565 : ColourFormat::rgb888;
        const Family family = random_family(seed, 1 + seed % 61, colour, 3, 0);
        Random random(seed);
        const PointAttributes points = unfilter(family, [&](StreamInfo stream) {
            std::vector<Bytes> planes = filtered(family, stream);
            const bool pairs = planes.size() > 1;
            for (std::size_t p = 0; p + (pairs ? 1 : 0) < planes.size(); ++p)
                for (std::uint8_t &code : planes[p])
                    code = static_cast<std::uint8_t>(random.below(256));
            if (pairs) {
                Bytes &codes = planes[planes.size() - 2], &escapes = planes.back();
                std::size_t count = 0;
                for (std::uint8_t &code : codes)
                    count += (code & 15) == 15 ? 1U : 0U;
                escapes.resize(2 * count);
                for (std::uint8_t &escape : escapes)
                    escape = static_cast<std::uint8_t>(random.below(64));
            }
            return planes;
        });
        for (const std::uint16_t normal : points.normals)
            ASSERT_EQ(normal & ~(kNormalIndexMask | kTwoSidedBit), 0);
    }
}

TEST(Filters, CellsOfNormalsAreNeighboursWhereNormalsAre) {
    const std::span<const std::uint16_t> cells = normal_cells(), normals = normals_of_cells();
    std::vector<int> used(kNormalCount, 0);
    for (std::size_t index = 0; index < kNormalCount; ++index) {
        ++used[cells[index]];
        EXPECT_EQ(normals[cells[index]], index);
    }
    EXPECT_EQ(*std::min_element(used.begin(), used.end()), 1);
    // Normals of cells i and i + 2 differ by at most 8 degrees, except across the edges that meet at -z.
    for (unsigned cell = 0; cell < kNormalCount; ++cell) {
        if ((cell & 127) >= 126)
            continue;
        const IntegerNormal &a = integer_normal_table()[normals[cell]], &b = integer_normal_table()[normals[cell + 2]];
        const double cosine = (1.0 * a[0] * b[0] + 1.0 * a[1] * b[1] + 1.0 * a[2] * b[2]) / 32767 / 32767;
        EXPECT_GT(cosine, 0.99) << cell;
    }
}

TEST(Filters, AnOnlyChildsAverageIsItself) {
    for (std::uint16_t index = 0; index < kNormalCount; ++index) {
        const IntegerNormal &n = integer_normal_table()[index];
        ASSERT_EQ(quantise_normal(n[0], n[1], n[2]), index);
    }
    // A chain of only children at every depth; some of them are two-sided.
    Random random(3);
    for (int round = 0; round < 200; ++round) {
        Model model;
        const int depth = 5;
        const AttributeSet set =
            test::every_attribute(round % 2 == 0 ? ColourFormat::rgb565 : ColourFormat::rgb888, depth);
        model.parameters.grid = {.depth = depth, .origin = {}, .voxel_size = 1};
        model.parameters.attributes = set;
        const std::vector<MortonCode> codes{random.below(32768)};
        const LevelMasks masks = encode_octree(codes, depth);
        model.levels.resize(masks.size());
        for (std::size_t level = 0; level < masks.size(); ++level)
            model.levels[level].masks = masks[level];
        PointAttributes &points = model.levels.back().points;
        points = random_points(random, 1, set, depth);
        set_point_colour(points, 0, set.colour, {11, 222, 33});
        average_levels(model, 1);
        for (const Level &level : model.levels) {
            EXPECT_EQ(level.points.normals, points.normals);
            EXPECT_EQ(level.points.colours, points.colours);
            EXPECT_EQ(level.points.materials, points.materials);
            EXPECT_EQ(level.points.textures, points.textures);
        }
    }
}

TEST(Filters, FiltersMakeFilesSmallerAndChangeNothing) {
    const Model model = test::sphere_model(7, test::every_attribute(ColourFormat::rgb888, 7));
    const Bytes with = value_of(encode_model(model, {.threads = 1}));
    const Bytes without = value_of(encode_model(model, {.filters = false, .threads = 1}));
    EXPECT_LT(with.size(), without.size());
    Reader filtered_reader = value_of(Reader::open(with)), plain_reader = value_of(Reader::open(without));
    EXPECT_EQ(filtered_reader.header().content_id, plain_reader.header().content_id);
    EXPECT_EQ(value_of(load_model(filtered_reader)).levels, value_of(load_model(plain_reader)).levels);
}

} // namespace
