// The farthest depth of each tile of a strip, to find bricks that nearer points hide.
// Based on: Greene, Kass, Miller. Hierarchical Z-Buffer Visibility. 1993 (one level of it)
#pragma once

#include "pbm_render/splats/depth_strip.h"

#include <vector>

namespace pbm {

class FarthestDepths {
  public:
    // Forgets all tiles. `strip` must outlive the use of the tiles. Its depths may become nearer after a tile was read:
    // the tile then hides less than it could.
    void begin(const DepthStrip &strip);

    // Whether all pixels of the strip that a brick may touch show nearer points already. May return false for such a
    // brick; true if it touches no pixel.
    bool hide(const SeenBrick &brick);

  private:
    static constexpr int kColumns = 16, kRows = 8; // of a tile
    static constexpr float kUnknown = -1;          // no depth

    float read(int tile_x, int tile_y) const;

    const DepthStrip *strip_ = nullptr;
    int tiles_across_ = 0;
    std::vector<float> depths_; // [tiles down][tiles across]; kUnknown: not read yet
};

} // namespace pbm
