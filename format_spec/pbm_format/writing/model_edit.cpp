#include "pbm_format/writing/model_edit.h"
#include "pbm_format/levels/chunk_split.h"

#include "pbm_format/checking/validate.h"
#include "pbm_format/container/content_id.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/file_layout.h"
#include "pbm_format/writing/writer.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"

#include <algorithm>
#include <filesystem>
#include <new>
#include <utility>

namespace pbm {
namespace {

// The texture with the palette of another one.
SolidTexture with_palette(SolidTexture texture, const SolidTexture &of) {
    texture.palette = of.palette;
    return texture;
}

bool same_but_for_palette(const SolidTexture &a, const SolidTexture &b) { return with_palette(a, b) == b; }

bool same_but_for_palette(const std::optional<GroundPlane> &a, const std::optional<GroundPlane> &b) {
    if (!a || !b || a->texture.has_value() != b->texture.has_value())
        return a == b;
    GroundPlane ground = *a;
    if (ground.texture)
        ground.texture = with_palette(*ground.texture, *b->texture);
    return ground == *b;
}

// Whether the edit leaves alone what points and rasters depend on.
Status check_edit(const ModelParameters &file, const ModelEdit &edit) {
    const ModelParameters &wanted = edit.parameters;
    Grid grid = wanted.grid;
    grid.unit = file.grid.unit;
    if (wanted.grid.up != file.grid.up && file.ground)
        return usage_error("the up axis of a model with a ground plane is fixed; build it anew with --up");
    grid.up = file.grid.up;
    if (grid != file.grid || wanted.attributes != file.attributes || wanted.fields != file.fields ||
        wanted.closed != file.closed)
        return usage_error("an edit keeps grid, attributes and fields of the file, and whether its surface is closed");
    if (wanted.materials.size() != file.materials.size())
        return usage_error("an edit keeps the number of materials: points name them by number");
    if (!std::equal(wanted.texture.begin(), wanted.texture.end(), file.texture.begin(), file.texture.end(),
                    [](const SolidTexture &a, const SolidTexture &b) { return same_but_for_palette(a, b); }) ||
        !same_but_for_palette(wanted.ground, file.ground))
        return usage_error("an edit keeps textures and ground plane but for their palettes");
    return check_small_sections(wanted, edit.metadata);
}

Status place_shadows(const ModelEdit &edit, Model &model) {
    const AttributeSet &set = model.parameters.attributes;
    for (const FreshShadows &fresh : edit.shadows) {
        if (fresh.light >= static_cast<std::size_t>(set.lights) || fresh.finest.size() != model.point_count())
            return usage_error("new shadows are those of a light and of points of the file");
        const unsigned most =
            (1U << set.shadow_bits[fresh.light][static_cast<std::size_t>(model.parameters.grid.depth)]) - 1;
        if (std::any_of(fresh.finest.begin(), fresh.finest.end(), [&](std::uint8_t lit) { return lit > most; }))
            return usage_error("new shadows have the bits of the file");
        model.levels.back().points.shadows[fresh.light] = fresh.finest;
        if (fresh.light >= model.images.ground_lit.size())
            continue;
        Image &ground = model.images.ground_lit[fresh.light];
        if (fresh.ground.width != ground.width || fresh.ground.texels.size() != ground.texels.size())
            return usage_error("new shadows on the ground have the size of those of the file");
        ground = fresh.ground;
    }
    return {};
}

// Gives both sides of each point the lit fraction of the point.
void light_sides(std::size_t light, Model &model) {
    for (Level &level : model.levels)
        for (std::size_t i = 0; i < level.sides.size(); ++i)
            for (std::size_t side = 0; side < 2; ++side)
                level.sides.values.shadows[light][2 * i + side] = level.points.shadows[light][level.sides.points[i]];
}

ContentId content_id_of(const Model &model, std::uint32_t chunk_points) {
    LevelMasks masks;
    for (const Level &level : model.levels)
        masks.push_back(level.masks);
    return content_id(model, split_into_chunks(masks, chunk_points), chunk_points);
}

// The file with other small sections; the rest is copied.
Bytes with_small_sections(ByteView file, const Reader &reader, const Model &model) {
    FileLayout layout;
    for (EncodedSection &section : encode_small_sections(model.parameters, model.metadata))
        layout.add(std::move(section));
    for (const SectionEntry &entry : reader.sections()) {
        const SectionTraits *const known = traits_of(entry.type);
        const bool is_unknown_stream = known != nullptr && known->is_point_stream && !is_known_stream(entry.instance);
        if (known == nullptr || is_unknown_stream || (entry.type < SectionType::level_directory && !known->is_optional))
            continue;
        const ByteView stored = slice(file, entry.offset, entry.stored_bytes);
        layout.add(entry, Bytes(stored.begin(), stored.end()));
    }
    FileHeader header = reader.header();
    header.content_id = content_id_of(model, header.chunk_points);
    return layout.assemble(header);
}

Status check_writable(const std::string &path) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    const fs::perms writable = fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write;
    if ((fs::status(path, ignored).permissions() & writable) == fs::perms::none)
        return Error{ErrorCode::io, 0, "the file is read-only; change its permissions, or save a copy of it first"};
    return check_replaceable(path);
}

Status check_unchanged(const std::string &path, ByteView opened) {
    const auto file = MappedFile::open(path);
    if (!file)
        return file.error();
    const ByteView now = file->bytes();
    if (now.size() < opened.size() || !std::equal(opened.begin(), opened.end(), now.begin()))
        return Error{ErrorCode::io, 0, "another program has changed the file since it was opened; open it again"};
    return {};
}

} // namespace

Result<Bytes> edited_model(ByteView file, const ModelEdit &edit, const EditOptions &options) try {
    auto reader = Reader::open(file);
    if (!reader)
        return reader.error();
    if (Status allowed = check_edit(reader->parameters(), edit); !allowed)
        return allowed.error();
    auto model = load_model(*reader, {.threads = options.threads, .max_memory = options.max_memory, .fields = true});
    if (!model)
        return model.error();
    const std::vector<Material> of_file = std::exchange(model->parameters, edit.parameters).materials;
    for (std::size_t i = 0; i < of_file.size(); ++i) {
        model->parameters.materials[i].shape = of_file[i].shape;
        model->parameters.materials[i].tint = of_file[i].tint;
    }
    model->metadata = edit.metadata;
    if (edit.shadows.empty())
        return with_small_sections(file, *reader, *model);
    if (Status placed = place_shadows(edit, *model); !placed)
        return placed.error();
    average_levels(*model, options.threads);
    for (const FreshShadows &fresh : edit.shadows)
        light_sides(fresh.light, *model);
    return encode_model(*model, {.storage = reader->header().storage(),
                                 .chunk_points = reader->header().chunk_points,
                                 .threads = options.threads});
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Result<Bytes> edit_model(const std::string &path, ByteView opened, const ModelEdit &edit, const EditOptions &options) {
    if (Status writable = check_writable(path); !writable)
        return writable.error();
    if (Status unchanged = check_unchanged(path, opened); !unchanged)
        return unchanged.error();
    Result<Bytes> edited = [&]() -> Result<Bytes> {
        const auto file = MappedFile::open(path);
        return file ? edited_model(file->bytes(), edit, options) : file.error();
    }();
    if (!edited)
        return edited;
    if (const Status valid = verify(*edited, {.threads = options.threads, .max_memory = ~std::uint64_t{0}}); !valid)
        return Error{valid.error().code == ErrorCode::memory ? ErrorCode::memory : ErrorCode::bad_content,
                     valid.error().offset,
                     "the edited file does not verify (nothing was replaced): " + valid.error().message};
    if (Status unchanged = check_unchanged(path, opened); !unchanged) // meanwhile
        return unchanged.error();
    if (Status replaced = replace_file(path, *edited); !replaced)
        return replaced.error();
    edited->resize(kHeaderBytes);
    return edited;
}

} // namespace pbm
