// Laws for any masks, parents, codes and escapes: un-filtering stays in bounds and gives the same points with every
// instruction set. Filtering these points and un-filtering them again reproduces them.
// Input: the first byte selects the filter, the next three its parameters and the number of nodes.
#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/streams/predictions.h"
#include "pbm_format/streams/unfilter.h"
#include "pbm_format/writing/stream_filter.h"

#include "fuzz/byte_source.h"

#include <cstdlib>

#include <hwy/targets.h>

namespace {

using namespace pbm;

struct Case {
    AttributeSet set;
    StreamInfo stream;
    int level = 1;
    bool finest = false;
    Bytes masks;
    std::vector<std::uint16_t> normals; // normals of the parents, or else:
    Bytes values;

    Filter filter() const { return filter_of(stream, set); }
    unsigned shadow_bits(int at) const { return set.shadow_bits[0][static_cast<std::size_t>(at)]; }
    std::size_t value_bytes() const {
        return stream.kind == StreamKind::colour ? static_cast<std::size_t>(set.colour_bytes()) : 1;
    }
    PointView view(std::span<const std::uint16_t> some_normals, ByteView some_values) const {
        PointView view{
            .normals = some_normals, .radii = {}, .colours = {}, .materials = {}, .textures = {}, .shadows = {}};
        switch (stream.kind) {
        case StreamKind::radius: view.radii = some_values; break;
        case StreamKind::colour: view.colours = some_values; break;
        case StreamKind::material: view.materials = some_values; break;
        case StreamKind::texture: view.textures = some_values; break;
        case StreamKind::shadow: view.shadows[0] = some_values; break;
        case StreamKind::masks:
        case StreamKind::normal: break;
        }
        return view;
    }
};

Case read_case(test::ByteSource &input) {
    constexpr std::array<StreamKind, 7> kKinds{StreamKind::normal,   StreamKind::colour,  StreamKind::colour,
                                               StreamKind::material, StreamKind::texture, StreamKind::radius,
                                               StreamKind::shadow};
    Case c;
    const std::size_t choice = input.below(kKinds.size()), parameters = input.next();
    c.stream.kind = kKinds[choice];
    c.set.colour = choice == 1 ? ColourFormat::rgb565 : ColourFormat::rgb888;
    c.set.lights = 1;
    c.level = 1 + static_cast<int>(parameters & 15);
    c.finest = (parameters & 16) != 0;
    c.set.shadow_bits[0].fill(static_cast<std::uint8_t>(1U << (parameters >> 5 & 3)));
    c.set.shadow_bits[0][static_cast<std::size_t>(c.level)] = static_cast<std::uint8_t>(1U << (parameters & 3));
    // Mostly few nodes, which is fast; seldom more than 256.
    const std::size_t nodes = input.next();
    c.masks = input.bytes(nodes < 248 ? 1 + nodes % 40 : 40 * (nodes - 247));
    for (std::uint8_t &mask : c.masks)
        mask = mask == 0 ? 16 : mask;
    if (c.stream.kind == StreamKind::normal) {
        c.normals = std::vector<std::uint16_t>(c.masks.size());
        for (std::uint16_t &normal : c.normals)
            normal = static_cast<std::uint16_t>(input.below(2 * kNormalCount));
    } else {
        c.values = input.bytes(c.value_bytes() * c.masks.size());
    }
    return c;
}

struct Points {
    std::vector<std::uint16_t> normals;
    Bytes values;
    bool operator==(const Points &) const = default;
};

// A plane, followed by kSlack bytes and the end of the allocation.
class Padded {
  public:
    explicit Padded(const Bytes &plane) : memory_(plane.size() + kSlack), size_(plane.size()) {
        std::copy(plane.begin(), plane.end(), memory_.begin());
    }
    ByteView view() const { return ByteView(memory_).first(size_); }

  private:
    Bytes memory_;
    std::size_t size_;
};

// Un-filtering with a cone check gives the same normals, and the same verdict as a separate check.
void check_comparison(const Case &c, const std::vector<Bytes> &planes, UnfilterScratch &scratch,
                      const std::vector<std::uint16_t> &normals) {
    const std::uint16_t first = normals.front();
    const NormalCone cone{.axis = static_cast<std::uint16_t>(first & kNormalIndexMask),
                          .cosine = static_cast<std::int16_t>(first)};
    mark_outside(cone, scratch.outside);
    std::vector<std::uint16_t> again(normals.size());
    const Padded codes(planes[0]);
    const bool outside = unfilter_normals(scratch, c.normals, codes.view(), planes[1], again, &scratch.outside).outside;
    OutsideCone memory;
    if (again != normals || outside == cone_holds(cone, normals, memory))
        std::abort();
}

// Un-filters into fresh memory. Unpacks the codes of shadows.
Points unfilter(const Case &c, const std::vector<Bytes> &planes) {
    UnfilterScratch scratch;
    const MaskSummary summary = summarise_masks(c.masks);
    scratch.layout.build(c.masks, summary);
    const std::size_t count = scratch.layout.points();
    Points points{std::vector<std::uint16_t>(c.normals.empty() ? 0 : count),
                  Bytes(c.normals.empty() ? c.value_bytes() * count : 0)};
    const Padded codes(planes[0]), pairs(planes.size() == 3 ? planes[1] : Bytes{});
    switch (c.filter()) {
    case Filter::normal:
        unfilter_normals(scratch, c.normals, codes.view(), planes[1], points.normals);
        check_comparison(c, planes, scratch, points.normals);
        break;
    case Filter::colour565:
        unfilter_colours_565(scratch, c.values, codes.view(), pairs.view(), planes[2], points.values);
        break;
    case Filter::colour888:
        unfilter_colours_888(scratch, c.values, codes.view(), pairs.view(), planes[2], points.values);
        break;
    case Filter::material: unfilter_materials(scratch, c.values, codes.view(), points.values); break;
    case Filter::texture: unfilter_textures(scratch, c.values, codes.view(), points.values); break;
    case Filter::radius:
        unfilter_radii(scratch, c.values, radius_predictions(c.level, c.finest), codes.view(), points.values);
        break;
    case Filter::shadow:
        unfilter_shadows(scratch, c.values, shadow_predictions(c.shadow_bits(c.level - 1), c.shadow_bits(c.level)),
                         c.shadow_bits(c.level), codes.view(), points.values);
        break;
    case Filter::texels:
    case Filter::none:
    case Filter::mask_rank:
    case Filter::field16: std::abort();
    }
    return points;
}

std::vector<Bytes> read_planes(const Case &c, const MaskSummary &summary, test::ByteSource &input) {
    const bool all = c.filter() == Filter::radius || c.filter() == Filter::shadow;
    const std::size_t codes = summary.children - (all ? 0 : summary.only_children);
    std::vector<Bytes> planes(plane_count(c.filter()));
    for (std::size_t p = 0; p < std::max<std::size_t>(1, planes.size() - 1); ++p)
        planes[p] = input.bytes(codes);
    if (planes.size() > 1)
        planes.back() = input.bytes(2 * count_escapes(planes[planes.size() - 2]).count);
    return planes;
}

// Best first. Queried once, because CPUID is slow in virtual machines.
const std::vector<std::int64_t> &instruction_sets() {
    static const std::vector<std::int64_t> sets = hwy::SupportedAndGeneratedTargets();
    return sets;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size < 4)
        return 0;
    test::ByteSource input({data, size});
    const Case c = read_case(input);
    const MaskSummary summary = summarise_masks(c.masks);
    const std::vector<Bytes> planes = read_planes(c, summary, input);
    const Points points = unfilter(c, planes);

    const ChunkNodes nodes{.parent_masks = {}, .attributes = c.view(c.normals, c.values)};
    auto again = filter_stream({.set = c.set, .stream = c.stream, .level = c.level, .finest = c.finest}, c.masks,
                               c.view(points.normals, points.values), nodes);
    if (!again)
        std::abort();
    if (c.filter() == Filter::shadow) {
        const Bytes packed = again->front();
        again->front().resize(summary.children);
        unpack_bits(packed, c.shadow_bits(c.level), again->front());
    }
    if (unfilter(c, *again) != points)
        std::abort();
    const std::vector<std::int64_t> &sets = instruction_sets();
    hwy::GetChosenTarget().Update(sets[input.below(sets.size())]);
    const bool same = unfilter(c, planes) == points;
    hwy::GetChosenTarget().Update(sets.front()); // the best
    if (!same)
        std::abort();
    return 0;
}
