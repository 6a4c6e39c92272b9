#include "pbm_format/chunks/stream_rules.h"

#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

namespace {

Status check_values(ByteView values, unsigned limit, std::uint64_t offset, Reason reason, const char *text,
                    Wording wording) {
    const std::uint8_t most = largest_value(values);
    if (most >= limit)
        return broken(wording, reason, offset, text, "below " + std::to_string(limit), most);
    return {};
}

} // namespace

Status check_masks(const MaskSummary &summary, std::uint32_t points, std::uint64_t offset, Wording wording) {
    if (summary.zero)
        return broken(wording, "4.2", offset, "zero child mask", "1..255", 0);
    if (summary.children != points)
        return broken(wording, "4.4", offset, "the masks announce another number of points than the directory", points,
                      summary.children);
    return {};
}

Status check_normals(std::span<const std::uint16_t> normals, std::uint64_t offset, Wording wording) {
    constexpr unsigned kUsedBits = kNormalIndexMask | kTwoSidedBit;
    unsigned bits = 0;
    for (const std::uint16_t normal : normals)
        bits |= normal;
    if ((bits & ~kUsedBits) != 0)
        return broken(wording, "6.1.4", offset, "a normal has reserved bits", "below 16384",
                      *std::find_if(normals.begin(), normals.end(), [](std::uint16_t n) { return n > kUsedBits; }));
    return {};
}

Status check_cone(std::span<const std::uint16_t> normals, const NormalCone &cone, OutsideCone &memory,
                  std::uint64_t offset, Wording wording) {
    if (cone.cosine != kNoCone && !cone_holds(cone, normals, memory))
        return broken(wording, "5.7.1", offset, "a normal lies outside the chunk's normal cone",
                      needed_cosine(cone, normals), cone.cosine);
    return {};
}

Status check_radii(ByteView radii, bool finest, std::uint64_t offset, Wording wording) {
    return finest ? check_values(radii, kMaxFinestRadius + 1U, offset, "6.2.2",
                                 "a radius is more than 5 % of the grid's edge", wording)
                  : Status{};
}

Status check_materials(ByteView materials, std::size_t material_count, std::uint64_t offset, Wording wording) {
    return check_values(materials, static_cast<unsigned>(material_count), offset, "6.4.1",
                        "a material index names no material", wording);
}

Status check_packed_tail(ByteView packed, std::uint32_t points, unsigned bits, std::uint64_t offset, Wording wording) {
    const std::size_t used = points * std::size_t{bits} % 8;
    if (used != 0 && packed.back() >> used != 0)
        return broken(wording, "6.6.1", offset, "bits after the last lit fraction are not zero", 0,
                      packed.back() >> used);
    return {};
}

} // namespace pbm
