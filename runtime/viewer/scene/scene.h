// Models that are ready to be drawn: what every program that shows files opens first.
#pragma once

#include "pbm_format/reading/load_model.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/reference/reference_renderer.h"
#include "system/files/mapped_file.h"

#include <memory>
#include <string>
#include <string_view>

namespace pbm {

// Of which only what pictures need is read. Stays where it is made.
struct StreamedScene {
    StreamedScene(MappedFile mapped, Reader reader, TiledImages images, StreamingOptions options)
        : file(std::move(mapped)), model(std::move(reader), std::move(options)),
          surroundings(std::make_shared<const Surroundings>(model.reader().parameters(), std::move(images))) {}
    StreamedScene(const StreamedScene &) = delete;
    StreamedScene &operator=(const StreamedScene &) = delete;

    const MappedFile file;
    StreamedModel model;
    const std::shared_ptr<const Surroundings> surroundings; // for renderers; refers to the model
};

// Reads header and small sections of a file, which takes no time to speak of.
Result<std::unique_ptr<StreamedScene>> open_scene(const std::string &path, StreamingOptions options);

// All of which is in memory. Stays where it is made: the renderer refers to the model. Unchanged from then on, so any
// thread may draw it.
struct Scene {
    Scene(Model loaded, const StreamingStatistics &what_it_took)
        : model(std::move(loaded)),
          renderer(model, std::make_shared<const Surroundings>(model.parameters, TiledImages::of(model.images))),
          cost(what_it_took) {}
    Scene(const Scene &) = delete;
    Scene &operator=(const Scene &) = delete;

    const Model model;
    const ReferenceRenderer renderer;
    const StreamingStatistics cost;
};

// Proves header and small sections of a file, which takes no time to speak of; `load_scene` would fail the same way.
Status check_scene(const std::string &path);

// Reads the levels that `options` asks for. The file is not needed any more afterwards.
Result<std::shared_ptr<const Scene>> load_scene(const std::string &path, const LoadOptions &options);

// The same error with what a user of `program` can do about it.
Error with_advice(std::string_view program, Error error);

} // namespace pbm
