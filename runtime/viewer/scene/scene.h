// Opens models for drawing, for every program that shows files.
#pragma once

#include "pbm_format/reading/load_model.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/shading/unasked_look.h"
#include "pbm_render/surroundings/surroundings.h"
#include "pbm_render/tables/table_renderer.h"
#include "system/files/mapped_file.h"
#include "viewer/options/look_options.h"

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace pbm {

// A model that is loaded chunk by chunk. Not movable.
struct StreamedScene {
    StreamedScene(MappedFile mapped, Reader reader, TiledImages images, StreamingOptions options, bool one_colour)
        : file(std::move(mapped)), has_one_colour(one_colour), colours(options.field), hidden(options.hidden),
          model(std::move(reader), std::move(options)), unasked(unasked_look(model.reader())),
          drawn(colours ? with_field_colours(model.reader().parameters(), *colours) : model.reader().parameters()),
          surroundings(std::make_shared<const Surroundings>(model.reader().parameters(), std::move(images))) {}
    StreamedScene(const StreamedScene &) = delete;
    StreamedScene &operator=(const StreamedScene &) = delete;

    const MappedFile file;
    const bool has_one_colour;                         // as the function says
    const std::optional<FieldColours> colours;         // that the points show in place of their own
    const std::shared_ptr<const HiddenClasses> hidden; // that are left out; null: none
    StreamedModel model;
    const UnaskedLook unasked;
    const ModelParameters drawn;                            // as the renderers take them
    const std::shared_ptr<const Surroundings> surroundings; // refers to the model
};

// Reads header and small sections only, which takes a negligible time, and what choose_field_colours and has_one_colour
// read. `look`: colours and classes of the points. `up`: the axis of heights; absent: that of the grid.
//
// errors  also those of choose_field_colours and hidden_classes
Result<std::unique_ptr<StreamedScene>> open_scene(const std::string &path, StreamingOptions options,
                                                  const LookOptions &look = {}, std::optional<UpAxis> up = {});

// A model completely in memory. Not movable: the renderer refers to the model. Immutable, so any thread may draw it.
struct Scene {
    Scene(Model loaded, const StreamingStatistics &what_it_took)
        : model(std::move(loaded)),
          renderer(model, std::make_shared<const Surroundings>(model.parameters, TiledImages::of(model.images))),
          cost(what_it_took) {}
    Scene(const Scene &) = delete;
    Scene &operator=(const Scene &) = delete;

    const Model model;
    const TableRenderer renderer;
    const StreamingStatistics cost;
};

// Verifies header and small sections, which takes a negligible time; `load_scene` would return the same error.
Status check_scene(const std::string &path);

// Reads the levels that `options` ask for, in the colours of a field if there are any, without hidden points. The file
// is not needed afterwards.
Result<std::shared_ptr<const Scene>> load_scene(const std::string &path, const LoadOptions &options,
                                                const std::optional<FieldColours> &colours = {},
                                                const HiddenClasses *hidden = nullptr);

// Appends to the error what a user of `program` can do about it.
Error with_advice(std::string_view program, Error error);

} // namespace pbm
