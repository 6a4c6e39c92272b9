// Rasters with mip levels in tiles: BVG.md 3.10.
#include "pbm_format/checking/validate.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/rasters/image_section.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/raster_encoder.h"
#include "pbm_format/writing/writer.h"

#include "unit/support/file_damage.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <functional>
#include <thread>

namespace pbm {
namespace {

using test::test_image;

std::vector<Image> levels_of(const Image &image) {
    std::vector<Image> levels{image};
    while (levels.back().height > 1)
        levels.push_back(halved(levels.back()));
    return levels;
}

void expect_same_texels(const TiledImage &tiled, const Image &image) {
    const std::vector<Image> levels = levels_of(image);
    ASSERT_EQ(tiled.levels(), static_cast<int>(levels.size()));
    for (int level = 0; level < tiled.levels(); ++level) {
        const Image &expected = levels[static_cast<std::size_t>(level)];
        ASSERT_EQ(tiled.width(level), expected.width);
        ASSERT_EQ(tiled.height(level), expected.height);
        std::size_t at = 0;
        for (std::uint32_t y = 0; y < expected.height; ++y)
            for (std::uint32_t x = 0; x < expected.width; ++x, at += expected.channels) {
                const std::uint8_t *texel = tiled.texel(level, x, y);
                ASSERT_NE(texel, nullptr);
                for (std::size_t c = 0; c < expected.channels; ++c)
                    ASSERT_EQ(texel[c], expected.texels[at + c]) << level << " " << x << " " << y;
            }
        EXPECT_EQ(value_of(tiled.level_image(level, 2)), expected);
    }
}

// The figure in BVG.md 3.10.14.
TEST(Image, MipLevelsAreMeansInLinearLightOrOfValues) {
    EXPECT_EQ(halved({.width = 2, .height = 2, .channels = 1, .texels = {0, 1, 2, 255}}).texels, Bytes({65}));
    EXPECT_EQ(halved({.width = 2, .height = 2, .channels = 1, .texels = {0, 0, 1, 1}}).texels, Bytes({1}));
    EXPECT_EQ(
        halved({.width = 2, .height = 2, .channels = 3, .texels = {0, 0, 9, 0, 0, 9, 255, 1, 9, 255, 0, 9}}).texels,
        Bytes({188, 0, 9}));
    EXPECT_EQ(mip_levels(1), 1);
    EXPECT_EQ(mip_levels(8192), 14);
}

TEST(TiledImage, MemoryAndFilesHoldTheSameTexels) {
    for (const auto &[width, height, channels] :
         {std::array{256U, 128U, 3U}, std::array{2U, 1U, 3U}, std::array{1U, 1U, 1U}, std::array{256U, 256U, 1U},
          std::array{64U, 64U, 1U}, std::array{32U, 16U, 3U}}) {
        const Image image = test_image(width, height, channels);
        expect_same_texels(TiledImage::of(image), image);
        for (const Storage storage : {Storage::packed, Storage::mapped}) {
            const Bytes section = encode_image(image, storage, 3, 2);
            EXPECT_EQ(section, encode_image(image, storage, 3, 1));
            const Result<TiledImage> tiled = TiledImage::open(section, 1000);
            ASSERT_TRUE(tiled) << tiled.error().message;
            expect_same_texels(*tiled, image);
            EXPECT_TRUE(tiled->take_errors().empty());
        }
    }
}

TEST(TiledImage, ReadsOnlyTheTilesThatAreAskedFor) {
    const Bytes section = encode_image(test_image(256, 256, 1), Storage::packed, 3, 1);
    const Result<TiledImage> tiled = TiledImage::open(section, 0);
    ASSERT_TRUE(tiled);
    const TiledImage::Statistics before = tiled->statistics();
    EXPECT_EQ(before.tiles, 0U);
    EXPECT_EQ(before.stored_bytes, 32 + 16 * tiled->grid().tiles());
    const std::uint8_t *texels = tiled->tile(0, 1, 2);
    EXPECT_EQ(texels, tiled->tile(0, 1, 2));
    const TiledImage::Statistics after = tiled->statistics();
    EXPECT_EQ(after.tiles, 1U);
    EXPECT_EQ(after.memory_bytes, before.memory_bytes + 4096);
    EXPECT_LT(after.stored_bytes, before.stored_bytes + 4096);
}

TEST(TiledImage, RawTilesAreUsedWhereTheyLie) {
    const Bytes section = encode_image(test_image(128, 128, 1), Storage::mapped, 3, 1);
    const Result<TiledImage> tiled = TiledImage::open(section, 0);
    ASSERT_TRUE(tiled);
    const std::uint8_t *texels = tiled->tile(0, 1, 1);
    EXPECT_TRUE(texels >= section.data() && texels < section.data() + section.size());
    EXPECT_EQ((texels - section.data()) % kMappedStreamAlignment, 0);
}

TEST(TiledImage, ADamagedTileIsAnErrorAndTheOthersStayUsable) {
    const Image image = test_image(256, 128, 3);
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        Bytes section = encode_image(image, storage, 3, 1);
        const Result<ImageDirectory> directory = decode_image_directory(section, 0);
        ASSERT_TRUE(directory);
        const std::size_t number = directory->grid.tile_number(0, 3, 1);
        section[directory->tiles[number].offset + 5] ^= 1;
        const Result<TiledImage> tiled = TiledImage::open(section, 5000);
        ASSERT_TRUE(tiled);
        EXPECT_EQ(tiled->tile(0, 3, 1), nullptr);
        EXPECT_EQ(tiled->tile(0, 3, 1), nullptr);
        EXPECT_EQ(tiled->texel(0, 255, 127), nullptr);
        const std::uint8_t *other = tiled->texel(0, 100, 100);
        ASSERT_NE(other, nullptr);
        EXPECT_EQ(other[2], image.texels[3 * (100 * 256 + 100) + 2]);
        const std::vector<Error> errors = tiled->take_errors();
        ASSERT_EQ(errors.size(), 1U);
        EXPECT_EQ(errors[0].code, ErrorCode::bad_hash);
        EXPECT_EQ(errors[0].offset, 5000 + directory->tiles[number].offset);
        EXPECT_TRUE(tiled->take_errors().empty());
        EXPECT_FALSE(tiled->level_image(0));
        EXPECT_TRUE(tiled->level_image(1));
    }
}

TEST(TiledImage, SeveralThreadsSeeTheSameTiles) {
    const Image image = test_image(512, 256, 3);
    const Bytes section = encode_image(image, Storage::packed, 3, 2);
    const Result<TiledImage> tiled = TiledImage::open(section, 0);
    ASSERT_TRUE(tiled);
    std::atomic<int> wrong{0};
    {
        std::vector<std::jthread> threads;
        for (std::uint32_t t = 0; t < 4; ++t)
            threads.emplace_back([&, t] {
                for (std::uint32_t i = 0; i < 512 * 256; i += 97) {
                    const std::uint32_t x = (i + t) % 512, y = i / 512;
                    const std::uint8_t *texel = tiled->texel(0, x, y);
                    wrong += texel == nullptr || texel[1] != image.texels[3 * (y * 512 + x) + 1] ? 1 : 0;
                }
            });
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(tiled->statistics().tiles, 8U * 4U);
}

TEST(TiledImage, EveryTruncationAndEveryFlippedBitOfTheDirectoryIsRefused) {
    Bytes section = encode_image(test_image(128, 64, 3), Storage::packed, 3, 1);
    for (std::size_t bytes = 0; bytes < section.size(); ++bytes)
        EXPECT_FALSE(TiledImage::open(ByteView(section).first(bytes), 0)) << bytes;
    const std::size_t directory_bytes = image_directory_bytes(value_of(TiledImage::open(section, 0)).grid());
    for (std::size_t bit = 0; bit < 8 * directory_bytes; ++bit) {
        section[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
        EXPECT_FALSE(TiledImage::open(section, 0)) << bit;
        section[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    }
}

TEST(TiledImage, TilesAreStoredInTheWayThatIsSmallest) {
    const Bytes section = encode_image(test_image(256, 128, 3), Storage::packed, 3, 1);
    const ImageDirectory directory = value_of(decode_image_directory(section, 0));
    const StreamEntry smooth = directory.tiles[directory.grid.tile_number(0, 0, 0)].stream;
    EXPECT_EQ(smooth.filter, Filter::texels);
    EXPECT_LT(smooth.stored_bytes, kMaxTileBytes / 2);
    const StreamEntry smallest = directory.tiles[0].stream; // 2x1 texels
    EXPECT_EQ(smallest, StreamEntry{.stored_bytes = 6});
    const Bytes flat =
        encode_image({.width = 64, .height = 64, .channels = 1, .texels = Bytes(4096, 255)}, Storage::packed, 3, 1);
    EXPECT_LT(flat.size(), 400U);
}

TEST(TiledImage, ARasterInAFileIsOfAShapeThatItsTypeMayHave) {
    const auto read = [](SectionType type, const Image &image, Storage stored_as, Storage file_storage) {
        const Bytes section = encode_image(image, stored_as, 3, 1);
        const TileGrid grid(image.width, image.height, image.channels);
        SectionEntry entry{.type = type, .stored_bytes = section.size(), .count = grid.tiles()};
        entry.raw_bytes =
            stored_as == Storage::mapped ? section.size() : image_directory_bytes(grid) + grid.texel_bytes();
        const Result<ImageDirectory> directory = read_image_directory(section, entry, file_storage);
        return directory ? std::string() : directory.error().message.substr(0, 8);
    };
    using enum SectionType;
    const Storage packed = Storage::packed, mapped = Storage::mapped;
    EXPECT_EQ(read(panorama, test_image(8, 4, 3), packed, packed), "");
    EXPECT_EQ(read(panorama, test_image(8, 4, 3), mapped, mapped), "");
    EXPECT_EQ(read(ground_lit, test_image(8, 8, 1), packed, packed), "");
    EXPECT_EQ(read(panorama, test_image(8, 8, 3), packed, packed), "3.10.15 ");
    EXPECT_EQ(read(panorama, test_image(8, 4, 1), packed, packed), "3.10.15 ");
    EXPECT_EQ(read(ground_texture, test_image(8, 8, 3), packed, packed), "3.10.15 ");
    EXPECT_EQ(read(ground_lit, test_image(8, 4, 1), packed, packed), "3.10.15 ");
    EXPECT_EQ(read(panorama, test_image(8, 4, 3), mapped, packed), "3.10.5 t");
    EXPECT_EQ(read(panorama, test_image(8, 4, 3), packed, mapped), "3.10.5 t");
}

TEST(TiledImage, ARasterOfTheGroundPlaneIsAtMost4096TexelsWide) {
    for (const std::uint32_t edge : {4096U, 8192U}) { // a directory alone: no tile is decoded
        const TileGrid grid(edge, edge, 1);
        ByteWriter out;
        out.u32(edge);
        out.u32(edge);
        out.u32(static_cast<std::uint32_t>(grid.tiles()));
        out.u16(1);
        out.u8(1);
        out.u8(0);
        out.u64(0);
        for (std::size_t tile = 0; tile < grid.tiles(); ++tile) {
            out.u64(0);
            out.u32(tile == 0 ? 1 : 1U | 1U << 31);
            out.u32(0);
        }
        ByteWriter section;
        section.u64(hash64(out.bytes()));
        section.append(out.bytes());
        section.append(Bytes(grid.tiles()));
        const SectionEntry entry{.type = SectionType::ground_lit,
                                 .stored_bytes = section.size(),
                                 .raw_bytes = image_directory_bytes(grid) + grid.texel_bytes(),
                                 .count = grid.tiles()};
        EXPECT_EQ(read_image_directory(section.bytes(), entry, Storage::packed).ok(), edge == 4096);
    }
}

Model shaded_model(int depth, std::uint32_t panorama_height, std::uint32_t ground_edge) {
    Model model = test::sphere_model(depth, test::every_attribute(ColourFormat::rgb888, depth));
    test::add_surroundings(model, panorama_height, ground_edge);
    return model;
}

TEST(Surroundings, SurviveTheRoundTripWithOneContentId) {
    const Model model = shaded_model(4, 64, 128);
    std::vector<ContentId> ids;
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes file = value_of(encode_model(model, {.storage = storage, .threads = 2}));
        Reader reader = value_of(Reader::open(file));
        EXPECT_EQ(value_of(load_model(reader, {.threads = 2})), model);
        const Status status = verify(file, {.threads = 2});
        EXPECT_TRUE(status) << status.error().message;
        EXPECT_TRUE(validate(file, {.threads = 2}).valid());
        ids.push_back(reader.header().content_id);
        const TiledImages images = value_of(read_images(reader));
        expect_same_texels(*images.panorama, model.images.panorama);
        expect_same_texels(*images.ground_texture, model.images.ground_texture);
        ASSERT_EQ(images.ground_lit.size(), 2U);
        expect_same_texels(*images.ground_lit[1], model.images.ground_lit[1]);
    }
    EXPECT_EQ(ids[0], ids[1]);
    for (const auto &change : std::vector<std::function<void(Model &)>>{
             [](Model &m) { m.images.panorama.texels[77] ^= 1; },
             [](Model &m) { m.images.ground_texture.texels[77] ^= 1; },
             [](Model &m) { m.images.ground_lit[1].texels[77] ^= 1; }, [](Model &m) { m.images.ground_lit.clear(); },
             [](Model &m) { m.parameters.ground->half_edge = 2; },
             [](Model &m) { m.parameters.ground->texture->palette[9][0] ^= 1; }}) {
        Model changed = model;
        change(changed);
        const Bytes file = value_of(encode_model(changed));
        EXPECT_NE(value_of(Reader::open(file)).header().content_id, ids[0]);
    }
}

TEST(Surroundings, StandBehindThePointsOfAFile) {
    const Model with = shaded_model(3, 32, 64);
    Model without = with;
    without.parameters.ground.reset();
    without.images = {};
    const Bytes file = value_of(encode_model(with)), plain = value_of(encode_model(without));
    const auto finest = [](const Bytes &of) {
        const Reader reader = value_of(Reader::open(of));
        const SectionEntry &chunks = *reader.section(SectionType::level_chunks, 3);
        return chunks.offset + chunks.stored_bytes;
    };
    // Six table entries and the ground plane's record precede the finest level, but no texel.
    EXPECT_LE(finest(file), finest(plain) + 6 * kSectionEntryBytes + 840);
    EXPECT_EQ(finest(plain), plain.size());
}

TEST(Surroundings, WhatDoesNotFitTogetherIsNotWritten) {
    const Model good = shaded_model(2, 4, 8);
    const auto rule_broken_by = [&](const std::function<void(Model &)> &change) {
        Model model = good;
        change(model);
        const Result<Bytes> file = encode_model(model);
        return file ? std::string("none") : file.error().message.substr(0, file.error().message.find(' '));
    };
    EXPECT_EQ(rule_broken_by([](Model &) {}), "none");
    EXPECT_EQ(rule_broken_by([](Model &m) { m.parameters.ground->material = 3; }), "3.9.4");
    EXPECT_EQ(rule_broken_by([](Model &m) { m.parameters.ground->texture.reset(); }), "3.9.5");
    EXPECT_EQ(rule_broken_by([](Model &m) { m.images.ground_texture = {}; }), "3.9.5");
    EXPECT_EQ(rule_broken_by([](Model &m) { m.images.ground_lit.pop_back(); }), "3.9.6");
    EXPECT_EQ(rule_broken_by([](Model &m) {
                  m.parameters.ground.reset();
                  m.images.ground_texture = {};
              }),
              "3.9.6");
    EXPECT_EQ(rule_broken_by([](Model &m) { m.images.panorama = test_image(12, 6, 3); }), "3.10.15");
    EXPECT_EQ(rule_broken_by([](Model &m) { m.images.ground_lit[0] = test_image(8, 4, 1); }), "3.10.15");
    EXPECT_EQ(rule_broken_by([](Model &m) { m.images.panorama.texels.pop_back(); }), "3.10.15");
    EXPECT_EQ(rule_broken_by([](Model &m) { m.parameters.ground->half_edge = 0; }), "3.11.3");
}

TEST(Surroundings, TheGroundPlaneMayHaveAMaterialOfItsOwnWithoutMaterialStream) {
    Model model = test::sphere_model(2, {});
    model.parameters.materials.resize(2);
    EXPECT_FALSE(encode_model(model));
    model.parameters.ground = {.centre = {}, .half_edge = 1, .material = 1, .texture = {}};
    const Bytes file = value_of(encode_model(model));
    EXPECT_TRUE(test::read_everything(file));
    model.parameters.materials.resize(3);
    EXPECT_FALSE(encode_model(model));
}

TEST(Damage, EveryTruncationAndFlippedBitOfRastersIsRefusedByReaderAndValidator) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        Bytes file = value_of(encode_model(shaded_model(2, 4, 8), {.storage = storage, .threads = 1}));
        const Reader reader = value_of(Reader::open(file));
        const SectionEntry &ground = *reader.section(SectionType::ground_plane);
        const std::uint64_t first_raster = reader.section(SectionType::ground_texture)->offset;
        for (std::size_t size = first_raster; size < file.size(); size += 3)
            EXPECT_FALSE(test::read_everything(ByteView(file).first(size)));
        const auto flip = [&](std::uint64_t bit) {
            file[bit / 8] = static_cast<std::uint8_t>(file[bit / 8] ^ 1U << bit % 8);
        };
        for (std::uint64_t bit = 8 * ground.offset; bit < 8 * file.size(); ++bit) {
            if (bit == 8 * (ground.offset + ground.stored_bytes))
                bit = 8 * first_raster;
            flip(bit);
            const Status status = test::read_everything(file);
            ASSERT_FALSE(status) << bit;
            ASSERT_FALSE(validate(file, {.threads = 1}).valid()) << bit;
            EXPECT_EQ(exit_code(status.error().code), 3) << bit;
            EXPECT_LE(status.error().offset, bit / 8) << bit;
            flip(bit);
        }
    }
}

TEST(Damage, OfRastersWithRepairedHashesFindsReaderAndValidatorInAgreement) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes file = value_of(encode_model(shaded_model(2, 64, 64), {.storage = storage, .threads = 1}));
        const std::size_t rasters = value_of(Reader::open(file)).section(SectionType::ground_texture)->offset;
        EXPECT_GT(test::count_refused(file, 300, [&](int round) { return round % 2 == 0 ? rasters : 128; }), 200);
    }
}

} // namespace
} // namespace pbm
