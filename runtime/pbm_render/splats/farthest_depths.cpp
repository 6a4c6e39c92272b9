#include "pbm_render/splats/farthest_depths.h"

#include <algorithm>

namespace pbm {

void FarthestDepths::begin(const DepthStrip &strip) {
    strip_ = &strip;
    tiles_across_ = (strip.width + kColumns - 1) / kColumns;
    const int tiles_down = (strip.bottom - strip.top + kRows - 1) / kRows;
    large_.assign(static_cast<std::size_t>(tiles_across_) * static_cast<std::size_t>(tiles_down), kUnknown);
    small_.assign(large_.size() * kSmallAcross * kSmallDown, kUnknown);
}

// The part of the box that lies in the strip; rows count from the strip's first.
FarthestDepths::Box FarthestDepths::in_strip(const Box &box) const {
    return {std::max(box.left, 0), std::min(box.right, strip_->width), std::max(box.top, strip_->top) - strip_->top,
            std::min(box.bottom, strip_->bottom) - strip_->top};
}

bool FarthestDepths::hide(const VisibleBrick &brick) {
    const Box box = in_strip({brick.left, brick.right, brick.top, brick.bottom});
    if (box.left >= box.right || box.top >= box.bottom)
        return true;
    for (int tile_y = box.top / kRows; tile_y * kRows < box.bottom; ++tile_y)
        for (int tile_x = box.left / kColumns; tile_x * kColumns < box.right; ++tile_x) {
            const float &farthest = large_[static_cast<std::size_t>(std::ptrdiff_t{tile_y} * tiles_across_ + tile_x)];
            if (farthest == kUnknown)
                read(tile_x, tile_y);
            if (farthest >= brick.nearest)
                return false;
        }
    return true;
}

bool FarthestDepths::hide(const Box &of, float nearest) {
    const Box box = in_strip(of);
    if (box.left >= box.right || box.top >= box.bottom)
        return true;
    const int right = (box.right - 1) / kSmall, bottom = (box.bottom - 1) / kSmall;
    for (int tile_y = box.top / kSmall; tile_y <= bottom; ++tile_y) {
        const float *const row = small_.data() + std::ptrdiff_t{tile_y} * tiles_across_ * kSmallAcross;
        for (int tile_x = box.left / kSmall; tile_x <= right; ++tile_x) {
            if (row[tile_x] == kUnknown)
                read(tile_x / kSmallAcross, tile_y / kSmallDown);
            if (row[tile_x] >= nearest)
                return false;
        }
    }
    return true;
}

// Reads a large tile. The numbers of pixels are ordered by depth.
void FarthestDepths::read(int tile_x, int tile_y) {
    float farthest = 0;
    for (int i = 0; i < kSmallDown; ++i)
        for (int k = 0; k < kSmallAcross; ++k) {
            const int small_x = tile_x * kSmallAcross + k, small_y = tile_y * kSmallDown + i;
            const int left = small_x * kSmall, right = std::min(left + kSmall, strip_->width);
            const int top = strip_->top + small_y * kSmall, bottom = std::min(top + kSmall, strip_->bottom);
            double pixel = 0;
            for (int y = top; y < bottom; ++y) {
                const double *const row = strip_->pixels.data() + strip_->offset(0, y);
                for (int x = left; x < right; ++x)
                    pixel = std::max(pixel, row[x]);
            }
            const float depth = DepthStrip::depth_of(pixel);
            small_[static_cast<std::size_t>(std::ptrdiff_t{small_y} * tiles_across_ * kSmallAcross + small_x)] = depth;
            farthest = std::max(farthest, depth);
        }
    large_[static_cast<std::size_t>(std::ptrdiff_t{tile_y} * tiles_across_ + tile_x)] = farthest;
}

} // namespace pbm
