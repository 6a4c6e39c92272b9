// Law: arbitrary codes in any context give the same number of masks, and ranking these gives the codes again, also if
// the parent masks do not add up to the nodes.
// Input: the first byte gives the share of parent masks; then three bytes per node: normal, code.
#include "pbm_format/streams/mask_ranks.h"

#include <algorithm>
#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size == 0)
        return 0;
    const std::size_t parent_count = (size - 1) * data[0] / 256, nodes = (size - 1 - parent_count) / 3;
    // Allocations of exactly their size: a sanitizer sees any access beyond.
    const pbm::Bytes parents(data + 1, data + 1 + parent_count);
    pbm::Bytes codes(nodes), masks(nodes), again(nodes);
    std::vector<std::uint16_t> normals(nodes);
    const std::uint8_t *at = data + 1 + parent_count;
    for (std::size_t i = 0; i < nodes; ++i, at += 3) {
        normals[i] = static_cast<std::uint16_t>(at[0] | at[1] << 8);
        codes[i] = at[2];
    }
    const pbm::MaskContext context{parents, normals};
    pbm::unrank_masks(codes, context, masks);
    pbm::rank_masks(masks, context, again);
    if (again != codes)
        std::abort();
    return 0;
}
