// The farthest depth of each tile of a strip, to find bricks and splats that nearer points hide.
// Based on: Greene, Kass, Miller. Hierarchical Z-Buffer Visibility. 1993 (two levels of it)
#pragma once

#include "pbm_render/splats/depth_strip.h"

#include <vector>

namespace pbm {

class FarthestDepths {
  public:
    // Pixels of the picture: columns left .. right - 1, rows top .. bottom - 1.
    struct Box {
        int left, right, top, bottom;
    };

    // Clears all tiles. `strip` must outlive the use of the tiles. If its depths become nearer after a tile was read,
    // the tile hides less than it could, but never too much.
    void begin(const DepthStrip &strip);

    // Whether nearer points already cover all pixels of the strip that a brick may touch. Conservative: may return
    // false for a hidden brick. True if the brick touches no pixel.
    bool hide(const VisibleBrick &brick);
    // The same for a small box; `nearest` is a lower bound of its depths, grid edges.
    bool hide(const Box &box, float nearest);

  private:
    // Edge of a small tile, pixels; a large tile has kSmallAcross x kSmallDown small ones.
    static constexpr int kSmall = 4;
    static constexpr int kSmallAcross = 4, kSmallDown = 2;
    static constexpr int kColumns = kSmallAcross * kSmall, kRows = kSmallDown * kSmall; // of a large tile
    static constexpr float kUnknown = -1;                                               // no depth

    Box in_strip(const Box &box) const;
    void read(int tile_x, int tile_y);

    const DepthStrip *strip_ = nullptr;
    int tiles_across_ = 0;     // large ones
    std::vector<float> large_; // [tiles down][tiles across]; kUnknown: not read yet
    std::vector<float> small_; // likewise; known if the large tile around it is
};

} // namespace pbm
