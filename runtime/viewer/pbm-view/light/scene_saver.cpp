#include "viewer/pbm-view/light/scene_saver.h"

#include "pbm_format/writing/model_edit.h"
#include "system/files/mapped_file.h"
#include "viewer/pbm-view/light/light_motion.h"

#include <utility>

namespace pbm {
namespace {

// The edit that makes `file` look like the window.
Result<ModelEdit> edit_for(const Reader &file, const SceneSave &save) {
    ModelEdit edit(file);
    ModelParameters &parameters = edit.parameters;
    parameters.materials = save.appearance.materials;
    parameters.lights = lights_to_keep(save.appearance, parameters);
    if (!parameters.texture.empty())
        parameters.texture.front().palette = save.appearance.palette;
    if (parameters.ground && parameters.ground->texture)
        parameters.ground->texture->palette = save.appearance.ground_palette;
    parameters.grid.up = save.up;
    Result<std::string> metadata = with_start_view(file.metadata(), save.view);
    if (!metadata)
        return metadata.error();
    edit.metadata = std::move(*metadata);
    const AttributeSet &set = file.parameters().attributes;
    for (std::size_t l = 0; l < static_cast<std::size_t>(set.lights); ++l) {
        if (same_place(file.parameters().lights[l], parameters.lights[l]))
            continue;
        const auto &baked = save.baked[l];
        if (!baked || !same_place(baked->light, parameters.lights[l]))
            return usage_error(light_name(parameters.lights[l], l) +
                               " has no shadows for its place; save again when they are baked, or build the model anew "
                               "with a recipe");
        const int bits = set.shadow_bits[l][static_cast<std::size_t>(file.depth())];
        edit.shadows.push_back(
            {.light = l, .finest = stored_fractions(*baked->fractions, bits), .ground = baked->ground});
    }
    return edit;
}

} // namespace

Result<Bytes> save_scene(const SceneSave &save) {
    const auto file = MappedFile::open(save.path);
    if (!file)
        return file.error();
    const auto reader = Reader::open(file->bytes());
    if (!reader)
        return reader.error();
    const auto edit = edit_for(*reader, save);
    if (!edit)
        return edit.error();
    return edit_model(save.path, save.opened, *edit, {.threads = save.threads, .max_memory = save.max_memory});
}

} // namespace pbm
