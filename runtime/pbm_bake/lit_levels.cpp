#include "pbm_bake/shadow_baker.h"

#include <cassert>

namespace pbm {
namespace {

// Sum of the lit fractions x 255 of the finest points below a node, and their number.
struct LitSum {
    std::uint64_t sum = 0, count = 0;
};

// The mean of 0..255 that `bits` bits can store.
std::uint8_t mean(const LitSum &of, unsigned bits) {
    const std::uint64_t step = 255 / ((1U << bits) - 1), whole = of.count * step;
    return static_cast<std::uint8_t>((2 * of.sum + whole) / (2 * whole) * step);
}

} // namespace

std::vector<Bytes> lit_levels(const LevelMasks &masks, std::span<const std::uint8_t> bits, ByteView finest) {
    assert(!masks.empty() && bits.size() >= masks.size());
    std::vector<Bytes> levels(masks.size());
    const std::size_t depth = masks.size() - 1;
    const unsigned step = 255 / ((1U << bits[depth]) - 1);
    levels[depth].resize(finest.size());
    for (std::size_t i = 0; i < finest.size(); ++i)
        levels[depth][i] = static_cast<std::uint8_t>(finest[i] * step);
    std::vector<LitSum> below; // of the level below; the finest level has none
    for (std::size_t level = depth; level-- > 0;) {
        const Bytes &children = masks[level + 1];
        std::vector<LitSum> here(children.size());
        std::size_t child = 0;
        for (std::size_t i = 0; i < children.size(); ++i)
            for (int left = kChildren[children[i]]; left > 0; --left, ++child) {
                here[i].sum += below.empty() ? levels[depth][child] : below[child].sum;
                here[i].count += below.empty() ? 1 : below[child].count;
            }
        levels[level].resize(here.size());
        for (std::size_t i = 0; i < here.size(); ++i)
            levels[level][i] = mean(here[i], bits[level]);
        below = std::move(here);
    }
    return levels;
}

} // namespace pbm
