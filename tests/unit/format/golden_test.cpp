// Golden files: every later version reads them with the same content. format_spec/golden/README.md
#include "pbm_format/checking/validate.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "system/files/mapped_file.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <set>
#include <string>

namespace pbm {
namespace {

using Json = nlohmann::json;

std::string hex(const Hash128 &hash) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint64_t half : hash)
        for (int byte = 0; byte < 8; ++byte)
            for (const int shift : {4, 0})
                text += kDigits[half >> (8 * byte + shift) & 15];
    return text;
}

void add_sides(const Sides &sides, StreamingHash &hash) {
    hash.add({reinterpret_cast<const std::uint8_t *>(sides.points.data()), sizeof(std::uint32_t) * sides.size()});
    const PointAttributes &values = sides.values;
    hash.add({reinterpret_cast<const std::uint8_t *>(values.normals.data()), 2 * values.normals.size()});
    for (const Bytes *stream : {&values.colours, &values.materials, &values.textures})
        hash.add(*stream);
    for (const Bytes &shadow : values.shadows)
        hash.add(shadow);
}

// Hash of all decoded values, in the order of format_spec/golden/README.md.
std::string decoded_hash(const Model &model) {
    StreamingHash hash;
    for (const Level &level : model.levels) {
        const PointAttributes &points = level.points;
        hash.add(level.masks);
        hash.add({reinterpret_cast<const std::uint8_t *>(points.normals.data()), 2 * points.normals.size()});
        for (const Bytes *stream : {&points.radii, &points.colours, &points.materials, &points.textures})
            hash.add(*stream);
        for (const Bytes &shadow : points.shadows)
            hash.add(shadow);
    }
    hash.add(model.images.ground_texture.texels);
    for (const Image &image : model.images.ground_lit)
        hash.add(image.texels);
    hash.add(model.images.panorama.texels);
    hash.add({reinterpret_cast<const std::uint8_t *>(model.metadata.data()), model.metadata.size()});
    for (const Level &level : model.levels)
        for (const Bytes &field : level.fields)
            hash.add(field);
    for (const Level &level : model.levels)
        add_sides(level.sides, hash);
    for (const Level &level : model.levels) {
        const Offsets &offsets = level.offsets;
        hash.add(
            {reinterpret_cast<const std::uint8_t *>(offsets.points.data()), sizeof(std::uint32_t) * offsets.size()});
        hash.add({reinterpret_cast<const std::uint8_t *>(offsets.values.data()), offsets.size()});
    }
    return hex(hash.finish());
}

void expect_contents(const std::filesystem::path &path, const Json &expected) {
    const MappedFile file = value_of(MappedFile::open(path.string()));
    EXPECT_TRUE(validate(file.bytes(), {.threads = 1}).valid()) << path;
    Result<Reader> reader = Reader::open(file.bytes());
    ASSERT_TRUE(reader) << path << ": " << reader.error().message;
    const Status status = verify(file.bytes(), {.threads = 1});
    EXPECT_TRUE(status) << path << ": " << status.error().message;
    EXPECT_EQ(reader->header().point_count, expected.at("points").get<std::uint64_t>()) << path;
    EXPECT_EQ(hex(reader->header().content_id), expected.at("content_id").get<std::string>()) << path;
    EXPECT_EQ(reader->header().storage() == Storage::mapped, expected.at("mapped").get<bool>()) << path;
    EXPECT_EQ(reader->parameters().materials.size(), expected.at("materials").get<std::size_t>()) << path;
    EXPECT_EQ(reader->parameters().lights.size(), expected.at("lights").get<std::size_t>()) << path;
    EXPECT_EQ(reader->parameters().closed, expected.value("closed", false)) << path;
    std::vector<std::size_t> round;
    std::vector<int> tints;
    for (std::size_t m = 0; m < reader->parameters().materials.size(); ++m) {
        tints.push_back(reader->parameters().materials[m].tint);
        if (is_round(reader->parameters().materials[m]))
            round.push_back(m);
    }
    EXPECT_EQ(round, expected.value("round", std::vector<std::size_t>())) << path;
    EXPECT_EQ(tints, expected.value("tints", std::vector<int>(tints.size()))) << path;
    EXPECT_EQ(rasters(*reader).size(), expected.at("rasters").size()) << path;
    const Json &chunks = expected.at("chunks");
    ASSERT_EQ(static_cast<std::size_t>(reader->depth()), chunks.size()) << path;
    for (int level = 1; level <= reader->depth(); ++level)
        EXPECT_EQ(value_of(reader->directory(level))->chunks.size(), chunks[static_cast<std::size_t>(level) - 1])
            << path;
    const Model model = value_of(load_model(*reader, {.threads = 1, .fields = true}));
    std::vector<std::size_t> points, sides, offsets;
    for (const Level &level : model.levels) {
        points.push_back(level.points.size());
        sides.push_back(level.sides.size());
        offsets.push_back(level.offsets.size());
    }
    EXPECT_EQ(points, expected.at("levels").get<std::vector<std::size_t>>()) << path;
    EXPECT_EQ(sides, expected.value("sides", std::vector<std::size_t>(sides.size()))) << path;
    EXPECT_EQ(offsets, expected.value("offsets", std::vector<std::size_t>(offsets.size()))) << path;
    EXPECT_EQ(decoded_hash(model), expected.at("decoded").get<std::string>()) << path;
}

TEST(Golden, EveryFileOfEveryFrozenVersionHoldsWhatItHeld) {
    int versions = 0;
    for (const auto &folder : std::filesystem::directory_iterator(PBM_SOURCE_DIR "/format_spec/golden")) {
        if (!folder.is_directory())
            continue;
        ++versions;
        std::ifstream in(folder.path() / "contents.json");
        const Json contents = Json::parse(in);
        std::set<std::string> listed;
        for (const Json &expected : contents.at("files")) {
            listed.insert(expected.at("file"));
            expect_contents(folder.path() / expected.at("file").get<std::string>(), expected);
        }
        for (const auto &file : std::filesystem::directory_iterator(folder))
            EXPECT_TRUE(file.path().extension() != ".pbvg" || listed.contains(file.path().filename().string()))
                << file.path();
    }
    EXPECT_GE(versions, 1);
}

} // namespace
} // namespace pbm
