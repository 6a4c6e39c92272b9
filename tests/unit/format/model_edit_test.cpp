// Edits of a file's small sections and of the shadows of its lights.
#include "pbm_format/writing/model_edit.h"

#include "pbm_format/checking/validate.h"
#include "pbm_format/container/section_encoder.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace pbm {
namespace {

AttributeSet with_two_shadows() {
    AttributeSet set{.colour = ColourFormat::rgb888, .material = true, .lights = 2};
    for (std::size_t light = 0; light < 2; ++light)
        for (std::size_t level = 0; level <= 4; ++level)
            set.shadow_bits[light][level] = level == 4 ? 1 : 4;
    return set;
}

Model lit_sphere() {
    Model model = test::sphere_model(4, with_two_shadows());
    model.parameters.lights.resize(3);
    const std::uint32_t edge = 64;
    model.parameters.ground = GroundPlane{};
    for (std::size_t light = 0; light < 2; ++light)
        model.images.ground_lit.push_back(
            {.width = edge, .height = edge, .channels = 1, .texels = Bytes(std::size_t{edge} * edge, 200)});
    return model;
}

Bytes file_of(const Model &model, Storage storage) { return value_of(encode_model(model, {.storage = storage})); }

// Sections that no edit of small sections may change.
bool is_content(const SectionEntry &entry) { return entry.type >= SectionType::level_directory; }

class ModelEdits : public testing::TestWithParam<Storage> {};

TEST_P(ModelEdits, ChangeSmallSectionsAndCopyAllOthers) {
    const Model model = lit_sphere();
    const Bytes file = file_of(model, GetParam());
    const Reader before = value_of(Reader::open(file));
    ModelEdit edit(before);
    edit.parameters.lights[0].intensity = {3, 2, 1};
    edit.parameters.materials[0].ka = 0.5F;
    edit.parameters.grid.unit = Unit::millimetre;
    edit.metadata = R"({"generator":"test","view":"somewhere"})";
    const Bytes edited = value_of(edited_model(file, edit));
    EXPECT_TRUE(verify(edited));
    const Reader after = value_of(Reader::open(edited));
    EXPECT_EQ(after.parameters(), edit.parameters);
    EXPECT_EQ(after.metadata(), edit.metadata);
    EXPECT_NE(after.header().content_id, before.header().content_id);
    ASSERT_EQ(after.sections().size(), before.sections().size());
    for (std::size_t i = 0; i < after.sections().size(); ++i) {
        const SectionEntry &from = before.sections()[i], &to = after.sections()[i];
        EXPECT_EQ(from.type, to.type);
        if (!is_content(from))
            continue;
        const ByteView a = slice(file, from.offset, from.stored_bytes), b = slice(edited, to.offset, to.stored_bytes);
        EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end())) << to_string(from.type);
    }
}

TEST_P(ModelEdits, OfNothingGiveTheSameBytes) {
    const Bytes file = file_of(lit_sphere(), GetParam());
    EXPECT_EQ(value_of(edited_model(file, ModelEdit(value_of(Reader::open(file))))), file);
}

TEST_P(ModelEdits, AreWhatAWriterMakesOfTheEditedModel) {
    Model model = lit_sphere();
    const Bytes file = file_of(model, GetParam());
    ModelEdit edit(value_of(Reader::open(file)));
    edit.parameters.lights.push_back({.kind = LightKind::spot, .position = {1, 2, 3}});
    edit.parameters.lights[1].direction = {0, 1, 0};
    const std::size_t points = model.levels.back().points.size();
    FreshShadows fresh{.light = 1, .finest = Bytes(points, 1), .ground = model.images.ground_lit[1]};
    fresh.finest[points / 2] = 0;
    fresh.ground.texels.assign(fresh.ground.texels.size(), 7);
    edit.shadows = {fresh};
    const Bytes edited = value_of(edited_model(file, edit));
    EXPECT_TRUE(verify(edited));
    model.parameters = edit.parameters;
    model.levels.back().points.shadows[1] = fresh.finest;
    model.images.ground_lit[1] = fresh.ground;
    average_levels(model, 1);
    EXPECT_EQ(edited, file_of(model, GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Storages, ModelEdits, testing::Values(Storage::packed, Storage::mapped),
                         [](const auto &one) { return std::string(to_string(one.param)); });

TEST(ModelEdit, AddsAndRemovesTheSectionOfLights) {
    const Model model = test::sphere_model(3, {});
    ASSERT_TRUE(model.parameters.lights.empty());
    const Bytes file = file_of(model, Storage::packed);
    ModelEdit edit(value_of(Reader::open(file)));
    edit.parameters.lights = {{}};
    const Bytes lit = value_of(edited_model(file, edit));
    EXPECT_TRUE(verify(lit));
    edit.parameters.lights.clear();
    EXPECT_EQ(value_of(edited_model(lit, edit)), file);
}

TEST(ModelEdit, LeavesOutWhatThisVersionDoesNotKnow) {
    Bytes file = file_of(test::sphere_model(3, {}), Storage::packed);
    const Reader reader = value_of(Reader::open(file));
    FileHeader header = reader.header();
    header.optional_features = 1ULL << 40;
    const Bytes head = encode_header(header);
    Bytes with_bit = file;
    std::copy(head.begin(), head.end(), with_bit.begin());
    EXPECT_EQ(value_of(edited_model(with_bit, ModelEdit(value_of(Reader::open(with_bit))))), file);
}

TEST(ModelEdit, KeepsWhetherTheSurfaceIsClosed) {
    Model model = test::sphere_model(3, {});
    model.parameters.closed = true;
    const Bytes file = file_of(model, Storage::packed);
    ModelEdit edit(value_of(Reader::open(file)));
    edit.metadata = "{}";
    model.metadata = "{}";
    EXPECT_EQ(value_of(edited_model(file, edit)), file_of(model, Storage::packed));
    edit.parameters.closed = false;
    EXPECT_EQ(edited_model(file, edit).error().code, ErrorCode::usage);
}

TEST(ModelEdit, KeepsTheShapesAndTintsOfMaterials) {
    Model model = test::sphere_model(3, {});
    model.parameters.materials[0].shape = PointShape::round;
    model.parameters.materials[0].tint = 7;
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes file = file_of(model, storage);
        ModelEdit edit(value_of(Reader::open(file)));
        edit.parameters.materials[0] = {.ka = 0.5F};
        Model wanted = model;
        wanted.parameters.materials[0].ka = 0.5F;
        wanted.parameters.materials[0].kd = Material().kd;
        EXPECT_EQ(value_of(edited_model(file, edit)), file_of(wanted, storage));
    }
}

TEST(ModelEdit, RefusesWhatPointsDependOn) {
    const Bytes file = file_of(lit_sphere(), Storage::packed);
    const Reader reader = value_of(Reader::open(file));
    const auto refused = [&](const auto &change, ErrorCode code) {
        ModelEdit edit(reader);
        change(edit);
        const auto edited = edited_model(file, edit);
        ASSERT_FALSE(edited);
        EXPECT_EQ(edited.error().code, code) << edited.error().message;
    };
    refused([](ModelEdit &edit) { edit.parameters.materials.emplace_back(); }, ErrorCode::usage);
    refused([](ModelEdit &edit) { edit.parameters.grid.voxel_size *= 2; }, ErrorCode::usage);
    refused([](ModelEdit &edit) { edit.parameters.grid.up = UpAxis::z; }, ErrorCode::usage);
    refused([](ModelEdit &edit) { edit.parameters.attributes.lights = 1; }, ErrorCode::usage);
    refused([](ModelEdit &edit) { edit.parameters.ground.reset(); }, ErrorCode::usage);
    refused([](ModelEdit &edit) { edit.parameters.lights.resize(1); }, ErrorCode::bad_section);
    refused([](ModelEdit &edit) { edit.parameters.lights[0].intensity[0] = -1; }, ErrorCode::bad_section);
    refused([](ModelEdit &edit) { edit.metadata = "no object"; }, ErrorCode::bad_section);
    refused([](ModelEdit &edit) { edit.shadows = {{.light = 2, .finest = {}, .ground = {}}}; }, ErrorCode::usage);
    refused([](ModelEdit &edit) { edit.shadows = {{.light = 0, .finest = Bytes(5), .ground = {}}}; }, ErrorCode::usage);
    const auto small = edited_model(file, ModelEdit(reader), {.threads = 1, .max_memory = 100});
    ASSERT_FALSE(small);
    EXPECT_EQ(small.error().code, ErrorCode::memory);
}

// Every truncation and every flipped byte of the file is refused: an edit never blesses damage with new hashes.
TEST(ModelEdit, RefusesDamagedFiles) {
    const Bytes file = file_of(test::sphere_model(2, {.colour = ColourFormat::rgb565}), Storage::packed);
    const ModelEdit edit(value_of(Reader::open(file)));
    for (std::size_t size = 0; size < file.size(); ++size)
        EXPECT_FALSE(edited_model(ByteView(file).first(size), edit)) << size;
    for (std::size_t i = 0; i < file.size(); ++i) {
        Bytes flipped = file;
        flipped[i] ^= 1;
        const auto edited = edited_model(flipped, edit);
        EXPECT_TRUE(!edited || *edited == file) << i; // bytes between sections are written anew
    }
}

class EditedFile : public testing::Test {
  protected:
    void SetUp() override { ASSERT_TRUE(replace_file(path, file)); }
    void TearDown() override {
        std::filesystem::permissions(path, std::filesystem::perms::owner_all);
        std::filesystem::remove(path);
    }
    Bytes now() const {
        const auto mapped = value_of(MappedFile::open(path));
        return {mapped.bytes().begin(), mapped.bytes().end()};
    }

    const std::string path = testing::TempDir() + "model_edit_test.pbvg";
    const Bytes file = file_of(test::sphere_model(3, {}), Storage::packed);
    const ByteView header = ByteView(file).first(kHeaderBytes);
    ModelEdit edit{value_of(Reader::open(file))};
};

TEST_F(EditedFile, IsReplacedAndGivesItsNewHeader) {
    edit.parameters.lights = {{}};
    const auto saved = edit_model(path, header, edit);
    ASSERT_TRUE(saved) << saved.error().message;
    EXPECT_EQ(now(), value_of(edited_model(file, edit)));
    const Bytes replaced = now();
    EXPECT_EQ(*saved, Bytes(replaced.begin(), replaced.begin() + kHeaderBytes));
    edit.parameters.lights = {};
    EXPECT_TRUE(edit_model(path, *saved, edit)); // once more
    EXPECT_EQ(now(), file);
}

TEST_F(EditedFile, StaysAsItIsIfItChangedMeanwhileOrIsReadOnly) {
    const Bytes other = file_of(test::sphere_model(4, {}), Storage::packed);
    ASSERT_TRUE(replace_file(path, other));
    const auto changed = edit_model(path, header, edit);
    ASSERT_FALSE(changed);
    EXPECT_EQ(changed.error().code, ErrorCode::io);
    EXPECT_EQ(now(), other);
    ASSERT_TRUE(replace_file(path, file));
    std::filesystem::permissions(path, std::filesystem::perms::owner_read);
    const auto locked = edit_model(path, header, edit);
    ASSERT_FALSE(locked);
    EXPECT_EQ(locked.error().code, ErrorCode::io);
    EXPECT_EQ(now(), file);
}

} // namespace
} // namespace pbm
