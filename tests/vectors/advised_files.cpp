// Valid files, each with one oddity that deserves advice.
#include "collection.h"
#include "unit/support/test_models.h"

#include "pbm_format/writing/writer.h"
#include "unit/support/value_of.h"

namespace pbm::test {

namespace {

Bytes encode(const Model &model, std::uint32_t chunk_points = kDefaultChunkPoints) {
    return value_of(
        encode_model(model, {.compression_level = 19, .filters = false, .chunk_points = chunk_points, .threads = 1}));
}

Model plain_model() { return sphere_model(2, {}, 0.3); }

Bytes with_metadata(const char *metadata) {
    Model model = plain_model();
    model.metadata = metadata;
    return encode(model);
}

Bytes with_edit(const Model &model, const Collection::Edit &edit) {
    FileEditor editor(encode(model));
    edit(editor);
    editor.repair();
    return editor.bytes();
}

// Turns the section of lights into an unknown optional one.
Bytes optional_section() {
    Model model = plain_model();
    const Bytes without = encode(model);
    model.parameters.lights.resize(1);
    return with_edit(model, [&](FileEditor &file) {
        const std::size_t entry = file.entry(SectionType::lights);
        file.set<std::uint32_t>(entry, 9);
        file.set<std::uint16_t>(entry + 6, 0);
        for (std::size_t i = 72; i < 88; ++i) // content_id, which does not cover it
            file.set<std::uint8_t>(i, without[i]);
    });
}

Bytes unused_material() {
    Model model = sphere_model(2, {.material = true}, 0.3);
    for (std::uint8_t &material : model.levels.back().points.materials)
        material = static_cast<std::uint8_t>(material % 2);
    average_levels(model, 1);
    return encode(model);
}

Bytes dark_light() {
    Model model = plain_model();
    model.parameters.lights.resize(1);
    model.parameters.lights[0].intensity = {0, 0, 0};
    return encode(model);
}

Bytes light_that_shines_on_nothing() {
    Model model = sphere_model(2, {.lights = 1, .shadow_bits = {{{8, 8, 8}}}}, 0.3);
    std::fill(model.levels.back().points.shadows[0].begin(), model.levels.back().points.shadows[0].end(),
              std::uint8_t{0});
    average_levels(model, 1);
    return encode(model);
}

// The sphere of depth 2 in the last octant of a grid of depth 3.
Bytes loose_grid() {
    Model model = plain_model();
    model.parameters.grid.depth = 3;
    model.levels.insert(model.levels.begin() + 1, Level{.masks = {0x80}, .points = {}});
    average_levels(model, 1);
    return encode(model);
}

Bytes far_grid() {
    Model model = plain_model();
    model.parameters.grid.origin = {1e308, 0, 0};
    return encode(model);
}

Bytes loose_cone() {
    Model model = plain_model();
    for (std::uint16_t &normal : model.levels.back().points.normals)
        normal = 0;
    average_levels(model, 1);
    return with_edit(model, set_chunk<std::int16_t>(2, 0, 38, 0));
}

} // namespace

std::vector<ValidFile> advised_files() {
    using enum SectionType;
    return {{"header.optional_feature.pbvg", with_edit(plain_model(), set<std::uint64_t>(48, 4))},
            {"header.chunk_limit.pbvg", encode(plain_model(), kMinChunkPoints)},
            {"table.not_critical.pbvg", with_edit(plain_model(), set_entry<std::uint16_t>(grid, 0, 6, 0))},
            {"table.optional_section.pbvg", optional_section()},
            {"metadata.path.pbvg", with_metadata(R"({"name":"bust","source":"/home/jo/scans/bust.ply"})")},
            {"metadata.run.pbvg", with_metadata(R"({"name":"bust","created":"2006-05-01T12:00:00Z"})")},
            {"metadata.twice.pbvg", with_metadata(R"({"name":"bust","name":"head"})")},
            {"parameter.unused_material.pbvg", unused_material()},
            {"parameter.dark_light.pbvg", dark_light()},
            {"parameter.dark_light-2.pbvg", light_that_shines_on_nothing()},
            {"parameter.loose_grid.pbvg", loose_grid()},
            {"parameter.far_grid.pbvg", far_grid()},
            {"point.loose_cone.pbvg", loose_cone()}};
}

} // namespace pbm::test
