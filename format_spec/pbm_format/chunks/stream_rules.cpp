#include "pbm_format/chunks/stream_rules.h"

#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

Status check_masks(const MaskSummary &summary, std::uint32_t points, std::uint64_t offset, Wording wording) {
    if (summary.zero)
        return broken(wording, "4.2", offset, "zero child mask", "1..255", 0);
    if (summary.children != points)
        return broken(wording, "4.4", offset, "the masks have another number of points than the directory", points,
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

Status check_values(const StreamInfo &stream, ByteView values, const ChunkRules &rules, std::uint64_t offset) {
    const auto check = [&](std::size_t limit, Reason reason, const char *text) -> Status {
        const std::uint8_t largest = largest_value(values);
        if (largest < limit)
            return {};
        return broken(rules.wording, reason, offset, text, "below " + std::to_string(limit), largest);
    };
    if (stream.kind == StreamKind::radius && rules.finest)
        return check(kMaxFinestRadius + 1U, "6.2.2", "a radius is more than 5 % of the grid's edge");
    if (stream.kind == StreamKind::material)
        return check(rules.material_count, "6.4.1", "a material index names no material");
    return {};
}

Status check_packed_tail(ByteView packed, std::uint32_t points, unsigned bits, std::uint64_t offset, Wording wording) {
    const std::size_t used = points * std::size_t{bits} % 8;
    if (used != 0 && packed.back() >> used != 0)
        return broken(wording, "6.6.1", offset, "bits after the last lit fraction are not zero", 0,
                      packed.back() >> used);
    return {};
}

} // namespace pbm
