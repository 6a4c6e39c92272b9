// One shadow map: the depth of what a light sees first, and the test whether a position is occluded.
// Based on: Williams. Casting Curved Shadows on Curved Surfaces. 1978; Botsch, Wiratanaya, Kobbelt. Efficient High
// Quality Rendering of Point Sampled Geometry. 2002 (splats)
#pragma once

#include "pbm_bake/light_view.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace pbm {

// One view of a light, and the tables that all points share in it.
class ShadowView {
  public:
    ShadowView(const LightView &view, const ShadowCasters &casters);

    int width() const { return width_; }   // texels
    int height() const { return height_; } // texels

    // Draws all splats into rows first..first + rows - 1 of the map; `map` holds only these rows.
    void draw(int first, int rows, std::span<float> map) const;

    // Adds 1 to the vote of every point that faces the light or has two sides, projects into these rows and is not
    // occluded.
    void vote(int first, int rows, std::span<float> map, std::span<std::uint8_t> votes) const;

    // Texel and depth of a position of a plane that casts no shadow itself.
    struct Seen {
        bool inside = false; // false: outside of the view, where everything is lit
        int row = 0, column = 0;
        float depth = 0;
    };
    // `place` in voxels from the grid's minimum corner.
    Seen see(const Vector3 &place, const Vector3 &normal) const;

    // `count` squares side by side; the first one has its corner at `corner`.
    struct SquareRow {
        Vector3 corner;
        Vector3 along, across; // edges of a square; `along` leads to the next one
        std::uint32_t count;
    };
    // Returns first and end of a range of squares. Positions of other squares do not project into the map's rows
    // first_row..first_row + rows - 1.
    std::pair<std::uint32_t, std::uint32_t> visible_squares(const SquareRow &squares, int first_row, int rows) const;

  private:
    struct ViewNormal {
        float x, y, z;          // along the view's axes
        float wide, high, deep; // half extents of a unit disc with this normal
    };
    struct ViewBrick {
        std::array<float, 3> corner; // along the view's axes
        int first_row, last_row;     // that its splats can reach; empty if it is outside of the view
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
