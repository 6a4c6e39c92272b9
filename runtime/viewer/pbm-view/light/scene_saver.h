// Writes lights, materials, palettes, up axis and view that a window shows into the model's file.
#pragma once

#include "viewer/pbm-view/light/model_notes.h"
#include "viewer/pbm-view/light/shadow_copy.h"

#include "pbm_format/reading/reader.h"
#include "pbm_render/appearance/appearance.h"

#include <array>
#include <memory>
#include <string>

namespace pbm {

struct SceneSave {
    std::string path;
    Bytes opened; // the file's header when it was opened or last saved
    Appearance appearance;
    UpAxis up = UpAxis::y;
    SavedView view;
    std::array<std::shared_ptr<const BakedShadows>, kMaxLights> baked; // of lights that were moved; else null
    int threads = 0;
    std::uint64_t max_memory = kDefaultMaxMemory;
};

// Replaces the file, see edit_model. A light that stands elsewhere than in the file gets its baked shadows; the chunks
// are then encoded anew. Returns the new header.
//
// errors  as edit_model; usage if the shadows of a light that was moved are not there
Result<Bytes> save_scene(const SceneSave &save);

} // namespace pbm
