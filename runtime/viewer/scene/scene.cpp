#include "viewer/scene/scene.h"

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_render/appearance/field_choice.h"
#include "pbm_render/bricks/round_points.h"

#include <algorithm>

namespace pbm {

namespace {

struct OpenedFile {
    MappedFile file;
    Reader reader; // refers to the mapping, which stays in place when this is moved
};

// Most files hold within their first bytes what every view needs: tables and the coarsest levels.
constexpr std::size_t kFirstBytes = 256 * 1024;

enum class Use { whole, chunks }; // what is going to be read

Result<OpenedFile> open_file(const std::string &path, Use use) {
    auto file = MappedFile::open(path);
    if (!file)
        return file.error();
    if (use == Use::chunks) {
        file->read_sparsely();
        MappedFile::will_need(slice(file->bytes(), 0, std::min(kFirstBytes, file->bytes().size())));
    }
    auto reader = Reader::open(ByteSource(file->bytes(), MappedFile::will_need));
    if (!reader)
        return reader.error();
    return OpenedFile{std::move(*file), std::move(*reader)};
}

// The levels follow each other in the file, behind all small sections.
StreamingStatistics cost_of(const Reader &reader, const Model &model) {
    StreamingStatistics cost;
    const bool mapped = reader.header().storage() == Storage::mapped;
    for (std::uint32_t level = 1; level < model.levels.size(); ++level) {
        const SectionEntry &chunks = *reader.section(SectionType::level_chunks, level);
        cost.bytes_read = chunks.offset + chunks.stored_bytes;
        cost.points_decoded += mapped ? 0 : chunks.count;
    }
    return cost;
}

} // namespace

Status check_scene(const std::string &path) {
    const auto opened = open_file(path, Use::chunks);
    return opened ? Status() : Status(opened.error());
}

Result<std::unique_ptr<StreamedScene>> open_scene(const std::string &path, StreamingOptions options,
                                                  const LookOptions &look, std::optional<UpAxis> up) {
    auto opened = open_file(path, Use::chunks);
    if (!opened)
        return opened.error();
    const ModelParameters &parameters = opened->reader.parameters();
    if (const DrawnClasses &classes = look.classes;
        !classes.draws_all() && !(classes.if_there && !has_classes(parameters))) {
        auto hidden = hidden_classes(parameters, classes);
        if (!hidden)
            return hidden.error();
        options.hidden = std::make_shared<const HiddenClasses>(std::move(*hidden));
    }
    std::optional<ColourBy> colour_by = look.colour_by;
    if (colour_by && colour_by->if_there && !can_colour_by(parameters, colour_by->field))
        colour_by = std::nullopt;
    if (const UnaskedLook unasked = unasked_look(opened->reader); !colour_by && !unasked.colour_by.empty())
        colour_by = ColourBy{.field = unasked.colour_by, .choice = {}};
    if (colour_by) {
        auto colours = choose_field_colours(opened->reader, colour_by->field, colour_by->choice, up);
        if (!colours)
            return colours.error();
        options.field = std::move(*colours);
    }
    auto images = read_images(opened->reader);
    if (!images)
        return images.error();
    const Result<bool> one_colour = has_one_colour(opened->reader); // the first picture tells of damage
    return std::make_unique<StreamedScene>(std::move(opened->file), std::move(opened->reader), std::move(*images),
                                           std::move(options), one_colour && *one_colour);
}

Result<std::shared_ptr<const Scene>> load_scene(const std::string &path, const LoadOptions &options,
                                                const std::optional<FieldColours> &colours,
                                                const HiddenClasses *hidden) {
    auto opened = open_file(path, Use::whole);
    if (!opened)
        return opened.error();
    LoadOptions load = options;
    load.fields = hidden != nullptr || (colours && colours->basis == ColourBasis::field);
    auto model = load_model(opened->reader, load);
    if (!model)
        return model.error();
    if (colours)
        colour_by_field(*model, *colours);
    if (hidden != nullptr)
        hide_points(*model, *hidden);
    const StreamingStatistics cost = cost_of(opened->reader, *model);
    return std::make_shared<const Scene>(std::move(*model), cost);
}

Error with_advice(std::string_view program, Error error) {
    switch (error.code) {
    case ErrorCode::memory: error.message += "; allow more with --max-memory or draw a coarser --level"; break;
    case ErrorCode::unsupported_feature: error.message += "; a newer " + std::string(program) + " is needed"; break;
    case ErrorCode::unsupported_version:
    case ErrorCode::usage:
    case ErrorCode::io:
    case ErrorCode::not_bvg: break; // the message says it
    default: error.message += "; pbm-validate names all damage, build the file anew";
    }
    return error;
}

} // namespace pbm
