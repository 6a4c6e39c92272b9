// What is done to a picture after it is drawn: exposure, tone curve, a shadow on the background, a scale bar. Layers of
// .exr files stay as they are drawn.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/picture/framebuffer.h"

#include <cstdint>
#include <span>

namespace pbm {

// How light becomes the brightness of a pixel.
//   none    as it is; what is brighter than white is white
//   filmic  as on film: shadows keep their depth, and highlights approach white slowly. Light that was white before the
//           exposure stays white
enum class Tone : std::uint8_t { none, filmic };

struct Finish {
    double exposure = 0; // stops: light is multiplied by 2^exposure
    Tone tone = Tone::none;
    bool drop_shadow = false; // soft, to the lower right, as on a sheet behind the model
    bool scale_bar = false;
    int dpi = 0; // dots per inch of a printed picture, which letters are sized for; 0: not printed

    // Whether a picture is drawn without background first.
    bool is_none() const { return exposure == 0 && tone == Tone::none && !drop_shadow; }
    bool operator==(const Finish &) const = default;
};

inline constexpr double kMaxExposure = 10; // stops
inline constexpr int kMaxDpi = 4800;

// The steps of a picture with a finish:
//   drawn with before_finish(...)   without background, which keeps its colours
//   grade                           changes what is drawn, by its pixels, or by `light`: linear, times alpha,
//                                   [height][width]
//   add_background                  with the shadow of what is drawn
RenderOptions before_finish(const Finish &finish, RenderOptions options);
void grade(const Finish &finish, Framebuffer &picture);
void grade(const Finish &finish, std::span<const Float4> light, Framebuffer &picture);
void add_background(const Finish &finish, const RenderOptions &options, Framebuffer &picture);

// Draws the scale bar if it is asked for. `pixel_size`: model units.
void add_scale_bar(const Finish &finish, double pixel_size, Unit unit, Framebuffer &picture);

} // namespace pbm
