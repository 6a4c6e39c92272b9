// Fidelity of pictures: compares them with rays against the mesh that the model was made from.
#pragma once

#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/tables/table_renderer.h"
#include "ray_tracer.h"

#include <array>
#include <functional>
#include <limits>
#include <string>
#include <vector>

namespace pbm {

// Counts of pixels. "Interior" are those inside the rays' silhouette by more than 2 pixels and, where pictures show no
// backs, not within 2 pixels of a ray that sees the mesh from inside: an open mesh cannot be judged there.
struct FidelityFigures {
    std::uint64_t object = 0; // pixels whose ray hits the mesh
    std::uint64_t interior = 0;
    std::uint64_t holes = 0;         // interior, nothing drawn
    std::uint64_t see_through = 0;   // interior, more than 4 voxels behind every hit within 2 pixels
    std::uint64_t bleed = 0;         // drawn, more than 1 pixel outside the silhouette
    std::uint64_t shrunk = 0;        // nothing drawn, more than 1 pixel inside the silhouette
    std::uint64_t deep = 0;          // interior, within 1 voxel of the ray's hit
    std::uint64_t deep_near = 0;     // interior, within 1 voxel of the hits of the pixel and its neighbours
    std::uint64_t on_surface = 0;    // interior, within 1 voxel of the plane that the ray hits
    std::uint64_t squared_error = 0; // of all interior pixels, R, G and B, sRGB 0..255; 0 without a picture to compare
    std::uint64_t seen = 0;          // pixels that differ from the background in one of both pictures: contours, too
    std::uint64_t seen_error = 0;    // squared error of all of them

    FidelityFigures &operator+=(const FidelityFigures &other);
};

// A picture and, where it is covered, the voxel edge of the level drawn there, model units: [height][width].
struct DrawnPicture {
    DrawnPicture(int width, int height) : picture(width, height), voxels(picture.pixels()) {}

    Framebuffer picture;
    std::vector<float> voxels;
    RenderStatistics drawn;
};

// A pixel is see-through if it lies this many voxels behind every hit around it.
inline constexpr float kSeeThroughVoxels = 4;

// What rays say of a picture's pixels and of those around them: [height][width]. Pixels beyond the picture's border
// have no hit: +infinity.
struct PictureTruth {
    // `shows_backs`: what rays see from inside is part of the picture.
    PictureTruth(RayImage image, int width, bool shows_backs = false);

    bool is_interior(std::size_t at) const { return farthest_outside_2[at] < std::numeric_limits<float>::infinity(); }

    RayImage rays;
    std::vector<float> nearest, farthest; // hits within 1 pixel
    // Depths of those that see the mesh from outside, or at all if backs are shown; others are +infinity, so that one
    // test covers both kinds of border.
    std::vector<float> outside;
    std::vector<float> farthest_outside_1, farthest_outside_2; // of them within 1 and 2 pixels
};

// `colours`: the result of `trace` with the default background, or empty.
FidelityFigures compare(const PictureTruth &truth, std::span<const Srgb> colours, const DrawnPicture &drawing);

// Of R, G and B, sRGB 0..255.
std::uint64_t squared_difference(const Srgb &truth, std::uint32_t drawn);
// Peak signal-to-noise ratio of so many pixels.
double decibels(std::uint64_t pixels, std::uint64_t squared_error);
// That of the interior, and of all pixels that show the object.
double psnr(const FidelityFigures &figures);
double psnr_seen(const FidelityFigures &figures);

// Fills a drawing, whose size is already set.
using Draw = std::function<void(const Camera &camera, DrawnPicture &drawing)>;

// Draws one level by a ReferenceRenderer or TableRenderer. Both references must outlive the result.
template <class Renderer> Draw draw_level(const Renderer &renderer, const Grid &grid, int level) {
    return [&renderer, &grid, level](const Camera &camera, DrawnPicture &drawing) {
        drawing.drawn = renderer.render(camera, {}, drawing.picture, {level});
        drawing.voxels.assign(drawing.voxels.size(), static_cast<float>(grid.voxel_size_at(drawing.drawn.level)));
    };
}
// Draws by the fast renderer as the programs do, or by the fine renderer if it is given. Mixes levels: voxels are at
// most `max_error` pixels where a finer level exists; no level is finer than `finest`. Throws if the model cannot be
// loaded. `change` may change the runs before they are drawn.
Draw draw_detail(StreamedModel &model, FastRenderer &fast, double max_error, int finest,
                 const RenderOptions &options = {}, FineRenderer *fine = nullptr,
                 const std::function<void(std::span<PointRun>)> &change = {});

// Eight views of the whole model: four around it at the height of its centre, and four between them from 35 degrees
// above, or all round: two of them from 35 degrees below.
std::array<Camera, 8> eight_views(const Sphere &bounds, UpAxis up, int width, int height, bool all_round = false);

struct View {
    RenderStatistics drawn;
    FidelityFigures figures;
    double pixels_per_unit = 0; // pixels per model unit at the centre of the model
};

// Draws the views and compares them with what rays say of them: `truths` [cameras].
std::vector<View> measure_fidelity(std::span<const PictureTruth> truths, const Draw &draw,
                                   std::span<const Camera> cameras, int width, int height);

// Sum over all views.
FidelityFigures total(const std::vector<View> &views);
double percent(std::uint64_t part, std::uint64_t whole);

// One line per view and one for all, aligned columns.
std::string to_text(const std::vector<View> &views);

} // namespace pbm
