#include "pbm_bake/shadow_casters.h"

#include "pbm_surface/carried_offsets.h"

#include <cassert>

namespace pbm {
namespace {

constexpr unsigned kPlaceBits = 9;
constexpr MortonCode kPlaceMask = (1U << kPlaceBits) - 1;
std::vector<MortonCode> finest_codes(const Model &model) {
    std::vector<MortonCode> codes{0};
    for (std::size_t level = 1; level < model.levels.size(); ++level)
        codes = expand_level(codes, model.levels[level].masks, model.levels[level].points.size()).value();
    return codes;
}

} // namespace

ShadowCasters::ShadowCasters(const Model &model, int threads)
    : ShadowCasters(model.parameters.grid,
                    {model.parameters.grid.depth, finest_codes(model), model.levels.back().points.normals,
                     model.levels.back().points.radii, model.parameters.closed},
                    threads) {}

ShadowCasters::ShadowCasters(const Grid &grid, const PointsOfLevel &points, int threads)
    : level_(points.level), voxel_size_(grid.voxel_size_at(points.level)), up_(grid.up), closed_(points.closed),
      normals_(points.normals), radii_(points.radii) {
    assert(points.codes.size() == normals_.size() && normals_.size() == radii_.size());
    find_bricks(points.codes);
    offsets_ = std::make_unique<CarriedOffsets>(carried_offsets({level_, bricks_, places_, normals_, radii_}, threads));
}

ShadowCasters::~ShadowCasters() = default;

std::span<const LevelBrick> ShadowCasters::bricks() const { return bricks_; }

void ShadowCasters::find_bricks(std::span<const MortonCode> codes) {
    places_.resize(codes.size());
    MortonCode last = ~MortonCode{0};
    for (std::size_t i = 0; i < codes.size(); ++i) {
        const MortonCode brick = codes[i] >> kPlaceBits;
        if (brick != last) {
            const auto corner = morton_decode(brick);
            bricks_.push_back({{static_cast<std::uint16_t>(corner[0]), static_cast<std::uint16_t>(corner[1]),
                                static_cast<std::uint16_t>(corner[2])},
                               i});
            last = brick;
        }
        places_[i] = static_cast<std::uint16_t>(codes[i] & kPlaceMask);
    }
    bricks_.push_back({{}, codes.size()});
}

} // namespace pbm
