// A model in memory, ready to be drawn: what every program that shows files loads first.
#pragma once

#include "pbm_format/reader.h"
#include "pbm_render/reference_renderer.h"

#include <memory>
#include <string>
#include <string_view>

namespace pbm {

// Stays where it is made: the renderer refers to the model. Unchanged from then on, so any thread may draw it.
struct Scene {
    explicit Scene(Model loaded) : model(std::move(loaded)), renderer(model) {}
    Scene(const Scene &) = delete;
    Scene &operator=(const Scene &) = delete;

    const Model model;
    const ReferenceRenderer renderer;
};

// Proves header and small sections of a file, which takes no time to speak of; `load_scene` would fail the same way.
Status check_scene(const std::string &path);

// Reads the levels that `options` asks for. The file is not needed any more afterwards.
Result<std::shared_ptr<const Scene>> load_scene(const std::string &path, const LoadOptions &options);

// The same error with what a user of `program` can do about it.
Error with_advice(std::string_view program, Error error);

} // namespace pbm
