// Lit fractions of coarser levels are those that a writer stores.
#include "pbm_bake/shadow_baker.h"

#include "unit/support/test_models.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

TEST(LitLevels, AreTheAveragesOfTheFormat) {
    constexpr std::array<std::uint8_t, 4> kBits{1, 2, 4, 8};
    for (const std::uint8_t finest : kBits)
        for (const std::uint8_t coarse : kBits) {
            AttributeSet set{.lights = 1};
            for (std::size_t level = 0; level <= 5; ++level)
                set.shadow_bits[0][level] = level == 5 ? finest : coarse;
            const Model model = test::sphere_model(5, set, 0.4, finest + 10U * coarse);
            LevelMasks masks;
            for (const Level &level : model.levels)
                masks.push_back(level.masks);
            const auto levels = lit_levels(masks, set.shadow_bits[0], model.levels.back().points.shadows[0]);
            ASSERT_EQ(levels.size(), model.levels.size());
            for (std::size_t level = 0; level < levels.size(); ++level) {
                const Bytes &stored = model.levels[level].points.shadows[0];
                const int step = 255 / ((1 << set.shadow_bits[0][level]) - 1);
                ASSERT_EQ(levels[level].size(), stored.size());
                for (std::size_t i = 0; i < stored.size(); ++i)
                    ASSERT_EQ(levels[level][i], stored[i] * step) << level << " " << i;
            }
        }
}

} // namespace
} // namespace pbm
