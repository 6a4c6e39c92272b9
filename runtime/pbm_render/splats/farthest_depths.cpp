#include "pbm_render/splats/farthest_depths.h"

#include <algorithm>

namespace pbm {

void FarthestDepths::begin(const DepthStrip &strip) {
    strip_ = &strip;
    tiles_across_ = (strip.width + kColumns - 1) / kColumns;
    const int tiles_down = (strip.bottom - strip.top + kRows - 1) / kRows;
    depths_.assign(static_cast<std::size_t>(tiles_across_) * static_cast<std::size_t>(tiles_down), kUnknown);
}

bool FarthestDepths::hide(const SeenBrick &brick) {
    const int top = std::max(brick.top, strip_->top) - strip_->top,
              bottom = std::min(brick.bottom, strip_->bottom) - strip_->top;
    if (brick.left >= brick.right || top >= bottom)
        return true;
    for (int tile_y = top / kRows; tile_y * kRows < bottom; ++tile_y)
        for (int tile_x = brick.left / kColumns; tile_x * kColumns < brick.right; ++tile_x) {
            float &farthest = depths_[static_cast<std::size_t>(std::ptrdiff_t{tile_y} * tiles_across_ + tile_x)];
            if (farthest == kUnknown)
                farthest = read(tile_x, tile_y);
            if (farthest >= brick.nearest)
                return false;
        }
    return true;
}

// The numbers of pixels are ordered by depth.
float FarthestDepths::read(int tile_x, int tile_y) const {
    const int left = tile_x * kColumns, columns = std::min(kColumns, strip_->width - left);
    const int top = strip_->top + tile_y * kRows, bottom = std::min(top + kRows, strip_->bottom);
    double farthest = 0;
    for (int y = top; y < bottom; ++y) {
        const double *const row = strip_->pixels.data() + strip_->offset(left, y);
        for (int x = 0; x < columns; ++x)
            farthest = std::max(farthest, row[x]);
    }
    return DepthStrip::depth_of(farthest);
}

} // namespace pbm
