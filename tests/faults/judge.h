// Verdicts on a file, and the steps by which a viewer shows it.
#pragma once

#include "pbm_format/checking/validate.h"
#include "pbm_format/reading/reader.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/picture/framebuffer.h"
#include "pbm_render/surroundings/surroundings.h"

#include <memory>
#include <vector>

namespace pbm::faults {

inline constexpr int kPictureWidth = 40, kPictureHeight = 30;

// A file as a viewer shows it: requests every visible chunk of the finest level.
struct Shown {
    std::unique_ptr<StreamedModel> model;
    std::shared_ptr<const Surroundings> surroundings;
    TiledImages images;
    Detail detail; // without damaged chunks
};

// A view from the front that contains the whole model, and parts of ground and panorama.
DetailView whole_view(const Sphere &bounds, UpAxis up);
// Returns errors of parts that every picture needs; omits damaged chunks.
Result<Shown> show(ByteView file, const DetailView &view, int threads = 1);
Framebuffer draw(const Shown &shown, const DetailView &view);

// Opens the file, loads it and draws everything that is intact.
Status open_and_draw(ByteView file, int threads = 1);

} // namespace pbm::faults
