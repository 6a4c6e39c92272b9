// The test vectors of the filters (BVG.md 15): planes decode to the values. Values that a writer encoded give
// the planes.
#include "pbm_format/chunks/field_chunk.h"
#include "pbm_format/streams/mask_ranks.h"
#include "pbm_format/streams/predictions.h"
#include "pbm_format/streams/texel_filter.h"
#include "pbm_format/streams/unfilter.h"
#include "pbm_format/writing/raster_encoder.h"
#include "pbm_format/writing/stream_filter.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cstring>
#include <fstream>
#include <set>
#include <string>

namespace pbm {
namespace {

using Json = nlohmann::json;

Bytes from_hex(const std::string &text) {
    Bytes bytes;
    for (std::size_t i = 0; i + 1 < text.size(); i += 2)
        bytes.push_back(static_cast<std::uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16)));
    return bytes;
}
std::vector<std::uint16_t> as_normals(const Bytes &bytes) {
    std::vector<std::uint16_t> normals(bytes.size() / 2);
    if (!normals.empty())
        std::memcpy(normals.data(), bytes.data(), 2 * normals.size());
    return normals;
}

struct Case {
    explicit Case(const Json &json)
        : name(json.at("name")), filter(Filter{json.at("filter").get<std::uint8_t>()}), level(json.value("level", 1)),
          depth(json.value("depth", kMinDepth)), bits(json.value("bits", 0U)), bits_above(json.value("bits_above", 0U)),
          width(json.value("width", std::size_t{0})), channels(json.value("channels", std::size_t{0})),
          written(json.value("written", false)), masks(from_hex(json.value("masks", ""))),
          parents(from_hex(json.value("parents", ""))), normals(as_normals(from_hex(json.value("normals", "")))),
          above(from_hex(json.value("above", ""))), values(from_hex(json.at("values"))) {
        for (const Json &plane : json.at("planes"))
            planes.push_back(from_hex(plane));
    }

    std::string name;
    Filter filter;
    int level, depth;
    unsigned bits, bits_above;
    std::size_t width, channels;
    bool written;
    Bytes masks, parents;
    std::vector<std::uint16_t> normals;
    Bytes above, values;
    std::vector<Bytes> planes;
};

std::vector<Case> read_cases() {
    std::ifstream file(PBM_SOURCE_DIR "/format_spec/vectors/filters.json");
    std::vector<Case> cases;
    const Json vectors = Json::parse(file);
    for (const Json &json : vectors.at("cases"))
        cases.emplace_back(json);
    return cases;
}

// A plane, followed by the kSlack bytes that un-filtering may read.
struct Padded {
    explicit Padded(const Bytes &plane) : bytes(plane), size(plane.size()) { bytes.resize(size + kSlack); }
    ByteView view() const { return ByteView(bytes).first(size); }
    Bytes bytes;
    std::size_t size;
};

// Values of a case of filters 2 to 8 and 10.
Bytes unfilter_points(const Case &c) {
    UnfilterScratch scratch;
    scratch.layout.build(c.masks, summarise_masks(c.masks));
    std::vector<Padded> planes(c.planes.begin(), c.planes.end());
    const ByteView first = planes[0].view();
    Bytes values(c.values.size());
    switch (c.filter) {
    case Filter::normal: {
        std::vector<std::uint16_t> points(values.size() / 2);
        EXPECT_TRUE(unfilter_normals(scratch, as_normals(c.parents), first, planes[1].view(), points).valid);
        std::memcpy(values.data(), points.data(), values.size());
        break;
    }
    case Filter::radius:
        unfilter_radii(scratch, c.parents, radius_predictions(c.level, c.level == c.depth), first, values);
        break;
    case Filter::colour565:
        unfilter_colours_565(scratch, c.parents, first, planes[1].view(), planes[2].view(), values);
        break;
    case Filter::colour888:
        unfilter_colours_888(scratch, c.parents, first, planes[1].view(), planes[2].view(), values);
        break;
    case Filter::material: unfilter_materials(scratch, c.parents, first, values); break;
    case Filter::texture: unfilter_textures(scratch, c.parents, first, values); break;
    case Filter::shadow: {
        Bytes codes(values.size() + kSlack);
        unpack_bits(first, c.bits, std::span(codes).first(values.size()));
        unfilter_shadows(scratch, c.parents, shadow_predictions(c.bits_above, c.bits), c.bits,
                         ByteView(codes).first(values.size()), values);
        break;
    }
    case Filter::field16: {
        const std::array<ByteView, 2> both{first, planes[1].view()};
        unfilter_field(both, 2, c.masks, c.parents, values);
        break;
    }
    default: ADD_FAILURE() << c.name;
    }
    return values;
}

// Planes of the values of a case of filters 2 to 8 and 10.
std::vector<Bytes> filter_points(const Case &c) {
    if (c.filter == Filter::field16)
        return filter_field({.name = c.name, .unit = "", .bytes = 2}, c.masks, c.values, c.parents)
            .value_or(std::vector<Bytes>{});
    AttributeSet set;
    StreamInfo stream;
    PointView points, nodes;
    const std::vector<std::uint16_t> normals = as_normals(c.values), node_normals = as_normals(c.parents);
    const auto use = [&](StreamKind kind, ByteView PointView::*member) {
        stream.kind = kind;
        points.*member = c.values;
        nodes.*member = c.parents;
    };
    switch (c.filter) {
    case Filter::normal:
        stream.kind = StreamKind::normal;
        points.normals = normals;
        nodes.normals = node_normals;
        break;
    case Filter::radius: use(StreamKind::radius, &PointView::radii); break;
    case Filter::colour565:
    case Filter::colour888:
        set.colour = c.filter == Filter::colour565 ? ColourFormat::rgb565 : ColourFormat::rgb888;
        use(StreamKind::colour, &PointView::colours);
        break;
    case Filter::material:
        set.material = true;
        use(StreamKind::material, &PointView::materials);
        break;
    case Filter::texture:
        set.texture = true;
        use(StreamKind::texture, &PointView::textures);
        break;
    default:
        set.lights = 1;
        set.shadow_bits[0][static_cast<std::size_t>(c.level)] = static_cast<std::uint8_t>(c.bits);
        set.shadow_bits[0][static_cast<std::size_t>(c.level) - 1] = static_cast<std::uint8_t>(c.bits_above);
        stream.kind = StreamKind::shadow;
        points.shadows[0] = c.values;
        nodes.shadows[0] = c.parents;
    }
    const StreamContext context{.set = set, .stream = stream, .level = c.level, .finest = c.level == c.depth};
    return filter_stream(context, c.masks, points, {.parent_masks = {}, .attributes = nodes})
        .value_or(std::vector<Bytes>{});
}

TEST(FilterVectors, AreThereForEachFilter) {
    std::set<Filter> filters;
    for (const Case &c : read_cases())
        filters.insert(c.filter);
    EXPECT_EQ(filters.size(), 10U);
}

TEST(FilterVectors, PlanesGiveTheValues) {
    for (const Case &c : read_cases()) {
        Bytes values(c.values.size());
        if (c.filter == Filter::mask_rank)
            unrank_masks(c.planes[0], {.parent_masks = c.above, .node_normals = c.normals}, values);
        else if (c.filter == Filter::texels) {
            TexelPlanes planes;
            std::ranges::copy(c.planes, planes.begin());
            unfilter_texels(planes, c.width, c.channels, values);
        } else
            values = unfilter_points(c);
        EXPECT_EQ(values, c.values) << c.name;
    }
}

TEST(FilterVectors, ValuesGiveThePlanesThatWereWritten) {
    for (const Case &c : read_cases()) {
        if (!c.written)
            continue;
        if (c.filter == Filter::mask_rank) {
            Bytes codes(c.values.size());
            rank_masks(c.values, {.parent_masks = c.above, .node_normals = c.normals}, codes);
            EXPECT_EQ(codes, c.planes[0]) << c.name;
        } else
            EXPECT_EQ(c.filter == Filter::texels ? filter_texels(c.values, c.width, c.channels) : filter_points(c),
                      c.planes)
                << c.name;
    }
}

} // namespace
} // namespace pbm
