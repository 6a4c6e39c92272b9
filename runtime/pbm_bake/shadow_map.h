// One shadow map: the depth of what a light sees first, and whether something else lies before a place.
// Based on: Williams. Casting Curved Shadows on Curved Surfaces. 1978; Botsch, Wiratanaya, Kobbelt 2002 (splats)
#pragma once

#include "pbm_bake/light_view.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace pbm {

// A view and everything of it that its points share.
class ShadowView {
  public:
    ShadowView(const LightView &view, const ShadowCasters &casters);

    int width() const { return width_; }   // texels
    int height() const { return height_; } // texels

    // Draws all splats into rows first..first + rows - 1 of the map, of which `map` holds nothing but those.
    void draw(int first, int rows, std::span<float> map) const;

    // Adds 1 to the votes of every point that faces the light, falls into these rows and is not behind something.
    void vote(int first, int rows, std::span<float> map, std::span<std::uint8_t> votes) const;

    // A place of a plane that casts no shadow itself: the texel it falls into, and the plane's depth there.
    struct Seen {
        bool inside = false; // the view holds it; what no view holds is lit
        int row = 0, column = 0;
        float depth = 0;
    };
    // `place` in voxels from the grid's minimum corner.
    Seen see(const Vector3 &place, const Vector3 &normal) const;

    // A row of `count` squares side by side. The first one has its corner at `corner`.
    struct SquareRow {
        Vector3 corner;
        Vector3 along, across; // edges of a square; `along` leads to the next one
        std::uint32_t count;
    };
    // The squares first..second - 1, in which places may fall into the map's rows first_row..first_row + rows - 1. No
    // place of another square does.
    std::pair<std::uint32_t, std::uint32_t> squares_seen(const SquareRow &squares, int first_row, int rows) const;

  private:
    struct ViewNormal {
        float x, y, z;          // along the view's axes
        float wide, high, deep; // half extents of a unit disc across it
    };
    struct ViewBrick {
        std::array<float, 3> corner; // along the view's axes
        int first_row, last_row;     // what its splats can reach; empty if the view does not hold it
    };
    struct Splat {
        float x, y, z; // along the view's axes
        const ViewNormal *normal;
    };
    class SplatsOfView;
    struct Rows;
    void find_window();
    template <bool kPerspective> void draw_bricks(const Rows &rows) const;
    template <bool kPerspective> void vote_bricks(const Rows &rows, std::span<std::uint8_t> votes) const;

    const ShadowCasters &casters_;
    LightView view_;
    float inverse_distance_;
    int width_ = 0, height_ = 0;
    float to_column_ = 0, to_row_ = 0; // added to u and v
    std::vector<ViewNormal> normals_;  // [kNormalCount]
    std::vector<ViewBrick> bricks_;
    std::array<std::array<float, 4>, 512> places_; // voxel centres of a brick along the view's axes
    std::array<float, 256> radii_;                 // in voxels, by radius index
};

} // namespace pbm
