// The verdicts on a file, and all that a viewer does with it.
#pragma once

#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/reader.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/surroundings/surroundings.h"

#include <memory>
#include <vector>

namespace pbm::faults {

inline constexpr int kPictureWidth = 40, kPictureHeight = 30;

// A file as a viewer shows it: every chunk of the finest level in view is asked for.
struct Shown {
    std::unique_ptr<StreamedModel> model;
    std::shared_ptr<const Surroundings> surroundings;
    TiledImages images;
    Detail detail; // what is there; damaged chunks are not
};

// From the front; sees all of the model, some ground and panorama.
DetailView whole_view(const Sphere &bounds, UpAxis up);
// Errors of what must be there for a picture at all; a chunk that is damaged is left out.
Result<Shown> show(ByteView file, const DetailView &view, int threads = 1);
Framebuffer draw(const Shown &shown, const DetailView &view);

// Opens, loads and draws whatever can be drawn.
Status open_and_draw(ByteView file, int threads = 1);

} // namespace pbm::faults
