// Single checks of chunks, frames, planes, bricks and rasters. checks_test.cpp has header, sections and directories.
#include "pbm_format/hashes/hash.h"
#include "pbm_format/reading/load_model.h"
#include "unit/format/checks_alone.h"

#include "pbm_format/chunks/chunk.h"
#include "pbm_format/chunks/mapped_chunk.h"
#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/chunks/stream_rules.h"
#include "pbm_format/container/section_encoder.h"
#include "pbm_format/rasters/image_section.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/streams/frame.h"
#include "pbm_format/writing/frame_encoder.h"
#include "pbm_format/writing/raster_encoder.h"
#include "system/files/mapped_file.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

namespace pbm {
namespace {

using namespace test;
using enum SectionType;

const Bytes kEven(1000, 7);

TEST(SingleCheck, FramesAreWholeAndOfOneSegment) {
    Bytes frame;
    ASSERT_TRUE(append_frame(kEven, 1, frame).zstd);
    Bytes raw(kEven.size());
    EXPECT_TRUE(decode_frame(frame, true, raw, 0));
    EXPECT_EQ(raw, kEven);
    const auto refuses = [&](const Bytes &bytes, std::size_t size = 1000) {
        Bytes to(size);
        const Status status = decode_frame(bytes, true, to, 77);
        EXPECT_TRUE(status || status.error().offset == 77);
        return !status;
    };
    for (std::size_t size = 0; size < frame.size(); ++size)
        EXPECT_TRUE(refuses(Bytes(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size)))) << size;
    Bytes longer = frame;
    longer.push_back(0);
    EXPECT_TRUE(refuses(longer));
    Bytes two = frame;
    two.insert(two.end(), frame.begin(), frame.end());
    EXPECT_TRUE(refuses(two));
    EXPECT_TRUE(refuses(frame, 999));
    EXPECT_TRUE(refuses(frame, 1001));
    for (const unsigned bit : {0U, 1U, 3U, 5U}) { // dictionary, reserved, single segment
        Bytes other = frame;
        other[4] ^= static_cast<std::uint8_t>(1U << bit);
        EXPECT_TRUE(refuses(other)) << bit;
    }
    // A skippable frame of four bytes: zstd decodes it to nothing.
    EXPECT_TRUE(refuses({0x50, 0x2A, 0x4D, 0x18, 4, 0, 0, 0, 1, 2, 3, 4}, 0));
    // A skippable frame whose size byte reads as the single-segment flag: alone, then after the valid frame.
    Bytes skipped{0x50, 0x2A, 0x4D, 0x18, 0x20, 0, 0, 0};
    skipped.resize(skipped.size() + 0x20);
    EXPECT_TRUE(refuses(skipped, 0));
    skipped.insert(skipped.begin(), frame.begin(), frame.end());
    EXPECT_TRUE(refuses(skipped));
    // A block of a type that does not exist.
    Bytes broken = frame;
    broken[7] |= 6;
    EXPECT_TRUE(refuses(broken));
}

TEST(SingleCheck, SizesOfPlanes) {
    Bytes stored;
    const std::vector<Bytes> planes{kEven, Bytes(5, 1)};
    append_planes(planes, 1, stored);
    const auto cut = [&](std::size_t at, std::uint8_t bits, std::size_t first = 1000) {
        Bytes bytes = stored;
        bytes[at] ^= bits;
        PlaneCursor cursor(bytes, 2);
        ByteView plane;
        bool zstd = false;
        return cursor.next(first, plane, zstd) && cursor.next(5, plane, zstd) && cursor.finished();
    };
    EXPECT_TRUE(cut(0, 0));
    EXPECT_FALSE(cut(3, 1));    // a reserved bit between the size and the zstd flag
    EXPECT_FALSE(cut(2, 1));    // the size is 65,536 bytes too large
    EXPECT_FALSE(cut(0, 0, 5)); // the frame is larger than its raw size
    EXPECT_FALSE(cut(4, 1));    // a raw plane, one byte short
    EXPECT_FALSE(cut(0, 1));    // the second plane moves and no longer ends with the bytes
    const Bytes short_of_one{5, 0, 0, 0, 1, 2, 3, 4};
    ByteView plane;
    bool zstd = false;
    EXPECT_FALSE(PlaneCursor(short_of_one, 1).next(5, plane, zstd));
}

// Finds the first stream with `filter` in the test vectors, applies `damage` to its stored bytes, decodes its chunk.
Status decode_damaged(Filter filter, const std::function<void(Bytes &)> &damage) {
    for (const char *name : {"filtered.pbvg", "filtered-565.pbvg", "filtered-regions.pbvg"}) {
        const MappedFile file =
            value_of(MappedFile::open(std::string(PBM_SOURCE_DIR "/format_spec/vectors/valid/") + name));
        Reader reader = value_of(Reader::open(file.bytes()));
        const Model model = value_of(load_model(reader, {.threads = 1}));
        for (int level = 1; level <= reader.depth(); ++level)
            for (ChunkEntry entry : value_of(reader.directory(level))->chunks) {
                Bytes stored;
                bool found = false;
                std::size_t at = entry.offset;
                for (StreamEntry &stream : entry.streams) {
                    const ByteView view = file.bytes().subspan(at, stream.stored_bytes);
                    Bytes bytes(view.begin(), view.end());
                    at += stream.stored_bytes;
                    if (stream.filter == filter && !found) {
                        found = true;
                        damage(bytes);
                        stream.stored_bytes = static_cast<std::uint32_t>(bytes.size());
                    }
                    stored.insert(stored.end(), bytes.begin(), bytes.end());
                }
                if (!found)
                    continue;
                entry.stored_bytes = stored.size();
                entry.hash = hash64(stored);
                const Level &above = model.levels[static_cast<std::size_t>(level) - 1];
                Chunk chunk;
                return decode_chunk(entry, stored, reader.chunk_rules(level),
                                    chunk_nodes(entry, above.masks, 0, above.points, 0, model.parameters.attributes),
                                    chunk);
            }
    }
    ADD_FAILURE() << "no stream with filter " << static_cast<int>(filter);
    return {};
}

TEST(SingleCheck, PlanesOfEveryFilter) {
    for (const Filter filter : {Filter::mask_rank, Filter::normal, Filter::radius, Filter::colour565, Filter::colour888,
                                Filter::material, Filter::texture, Filter::shadow}) {
        EXPECT_TRUE(decode_damaged(filter, [](Bytes &) {})) << static_cast<int>(filter);
        // A byte after the last plane; each plane's size off by one; a reserved bit of the size field.
        EXPECT_FALSE(decode_damaged(filter, [](Bytes &bytes) { bytes.push_back(0); })) << static_cast<int>(filter);
        for (std::size_t plane = 0; plane < plane_count(filter); ++plane) {
            EXPECT_FALSE(decode_damaged(filter, [&](Bytes &bytes) { bytes[4 * plane] ^= 1; })) << plane;
            EXPECT_FALSE(decode_damaged(filter, [&](Bytes &bytes) { bytes[4 * plane + 3] ^= 1; })) << plane;
        }
        // Every plane has size 0 and no byte follows.
        const Status none = decode_damaged(filter, [&](Bytes &bytes) { bytes.assign(4 * plane_count(filter), 0); });
        ASSERT_FALSE(none) << static_cast<int>(filter);
        EXPECT_EQ(none.error().rule, "5.8.1") << none.error().message;
    }
}

TEST(SingleCheck, AConeHoldsNoTwoSidedPoint) {
    Directories packed(chunks_file());
    const Model model = value_of(load_model(packed.reader));
    for (const int level : {4, 5})
        for (const ChunkEntry &entry : packed.level(level).chunks) {
            const std::span<const std::uint16_t> stored =
                std::span(model.levels[static_cast<std::size_t>(level)].points.normals)
                    .subspan(entry.first_point, entry.shape.points);
            std::vector<std::uint16_t> normals(stored.begin(), stored.end());
            OutsideCone memory;
            ASSERT_TRUE(check_normals(normals, 0));
            ASSERT_TRUE(check_cone(normals, entry.cone, memory, 0));
            if (entry.cone.cosine == kNoCone)
                continue;
            normals.back() |= kTwoSidedBit;
            EXPECT_FALSE(check_cone(normals, entry.cone, memory, 0));
            normals.resize(kManyNormals, normals.front()); // many normals take another code path
            EXPECT_FALSE(check_cone(normals, entry.cone, memory, 0));
        }
}

std::int64_t product_of(std::uint16_t a, std::uint16_t b) {
    const std::span<const IntegerNormal> table = integer_normal_table();
    std::int64_t sum = 0;
    for (std::size_t c = 0; c < 3; ++c)
        sum += std::int64_t{table[a][c]} * table[b][c];
    return sum;
}

// Cones of some axes, and one on whose border a normal lies exactly.
std::vector<NormalCone> some_cones() {
    std::vector<NormalCone> cones;
    for (const std::uint16_t axis : {quantise_normal(0, 0, 1), quantise_normal(1, -2, 3)})
        for (const int cosine : {-32767, -20000, 0, 31000, 32767})
            cones.push_back({.axis = axis, .cosine = static_cast<std::int16_t>(cosine)});
    for (std::uint16_t axis = 0; axis < kNormalCount; ++axis)
        for (std::uint16_t normal = 0; normal < kNormalCount; ++normal)
            if (const std::int64_t product = product_of(axis, normal); product > 0 && product % 32767 == 0) {
                cones.push_back({.axis = axis, .cosine = static_cast<std::int16_t>(product / 32767)});
                return cones;
            }
    return cones;
}

// Few normals are compared one by one, many through a table of all.
TEST(SingleCheck, AConeHoldsTheSameNormalsWhetherTheyAreFewOrMany) {
    std::size_t held = 0, at_the_limit = 0;
    for (const NormalCone &cone : some_cones())
        for (std::uint16_t normal = 0; normal < kNormalCount; ++normal) {
            OutsideCone memory;
            const std::int64_t product = product_of(cone.axis, normal), limit = std::int64_t{cone.cosine} * 32767;
            const std::array one{normal}, two_sided{static_cast<std::uint16_t>(normal | kTwoSidedBit)};
            ASSERT_EQ(cone_holds(cone, one, memory), product >= limit)
                << cone.axis << " " << cone.cosine << " " << normal;
            ASSERT_FALSE(cone_holds(cone, two_sided, memory));
            held += product >= limit ? 1 : 0;
            at_the_limit += product == limit ? 1 : 0;
            if (normal % 61 == 0 || product == limit) {
                const std::vector<std::uint16_t> many(kManyNormals, normal);
                ASSERT_EQ(cone_holds(cone, many, memory), product >= limit) << cone.axis << " " << cone.cosine;
            }
        }
    EXPECT_GT(held, 20000U);
    EXPECT_GT(at_the_limit, 0U);
}

TEST(SingleCheck, StreamsOfMappedChunks) {
    const FileEditor file(mapped_file());
    const AttributeSet set = every_attribute(ColourFormat::rgb888, 3);
    const StreamList streams = streams_of(set);
    std::uint64_t at = file.section(level_chunks, 3);
    const ChunkEntry chunk = Directories(mapped_file()).level(3).chunks[0];
    ASSERT_NE(chunk.shape.points % 8, 0U);
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const std::uint64_t place = at;
        at += align_stream(chunk.streams[s].stored_bytes);
        const auto value = [&](std::uint8_t byte) { return set_byte(place, byte); };
        switch (streams[s].kind) {
        case StreamKind::masks: // the check counts the children
            expect_refusal(mapped_file(), value(0), ErrorCode::bad_octree, chunk.offset);
            break;
        case StreamKind::normal:
            expect_refusal(mapped_file(), set_byte(place + 1, 0xC0), ErrorCode::bad_attribute, place);
            // A cone so narrow that most normals lie outside.
            expect_refusal(mapped_file(), test::set<std::int16_t>(file.chunk(3) + 38, 32767), ErrorCode::bad_attribute,
                           place);
            break;
        case StreamKind::radius: expect_refusal(mapped_file(), value(204), ErrorCode::bad_attribute, place); break;
        case StreamKind::material: expect_refusal(mapped_file(), value(3), ErrorCode::bad_attribute, place); break;
        case StreamKind::shadow:
            if (streams[s].light == 0) // one bit per point; the last byte has unused bits
                expect_refusal(mapped_file(), set_byte(place + chunk.streams[s].stored_bytes - 1, 0xFF),
                               ErrorCode::bad_attribute, place);
            break;
        case StreamKind::colour:
        case StreamKind::texture: break;
        }
    }
}

TEST(SingleCheck, EveryFieldOfABrick) {
    const FileEditor file(chunks_file(Storage::mapped));
    const std::size_t at = file.section(level_bricks, 5) + kBrickRecordBytes;
    const std::array<std::pair<std::size_t, std::size_t>, 12> fields{
        {{0, 0}, {2, 0}, {4, 0}, {6, 6}, {8, 6}, {10, 10}, {12, 10}, {14, 14}, {15, 14}, {16, 16}, {20, 16}, {23, 16}}};
    for (const auto &[field, named] : fields)
        expect_refusal(
            chunks_file(Storage::mapped), [&, flipped = at + field](FileEditor &editor) { editor.flip(8 * flipped); },
            ErrorCode::bad_content, at + named);
}

// Edits the directory of a raster of 4 x 4 texels, repairs its hash and decodes it.
Result<ImageDirectory> raster(std::uint32_t channels, Storage storage, const std::function<void(Bytes &)> &edit) {
    static Bytes section;
    section = encode_image(test::test_image(4, 4, channels), storage, 1, 1);
    edit(section);
    const std::uint64_t hash = hash64(ByteView(section).subspan(8, 24 + 16 * 3));
    std::memcpy(section.data(), &hash, sizeof hash);
    return decode_image_directory(section, 0);
}

template <class T> auto put(std::size_t at, T value) {
    return [=](Bytes &bytes) { std::memcpy(bytes.data() + at, &value, sizeof value); };
}

TEST(SingleCheck, TilesOfARaster) {
    constexpr std::uint32_t kZstd = 1U << 31, kFilter = static_cast<std::uint32_t>(Filter::texels) << 24;
    const std::size_t last = 32 + 2 * 16 + 8; // stored size, filter and zstd of the 4 x 4 texels
    EXPECT_TRUE(raster(3, Storage::packed, [](Bytes &) {}).ok());
    const auto refused = [&](std::uint32_t entry, std::uint32_t channels = 3, Storage storage = Storage::packed) {
        const Result<ImageDirectory> directory = raster(channels, storage, put(last, entry));
        EXPECT_EQ(directory ? 0 : directory.error().offset, last);
        return !directory && directory.error().code == ErrorCode::bad_image;
    };
    EXPECT_TRUE(refused(47));                   // raw, but the size is wrong
    EXPECT_TRUE(refused(kZstd));                // an empty frame
    EXPECT_TRUE(refused(kZstd | 48));           // a frame no smaller than its raw size
    EXPECT_TRUE(refused(kFilter | 11));         // too short for the planes' size fields
    EXPECT_TRUE(refused(kFilter | 48));         // no smaller than unfiltered
    EXPECT_TRUE(refused(kFilter | kZstd | 20)); // the zstd flag belongs to each plane, not to a filtered tile
    EXPECT_TRUE(refused(kFilter | 5, 1, Storage::mapped));
    EXPECT_TRUE(refused(kZstd | 5, 1, Storage::mapped));
}

TEST(SingleCheck, ShapesOfRasters) {
    EXPECT_TRUE(is_storable(4, 2, 3));
    EXPECT_TRUE(is_storable(kMaxPanoramaWidth, kMaxPanoramaWidth / 2, 3));
    EXPECT_FALSE(is_storable(4, 3, 3));
    EXPECT_FALSE(is_storable(2 * kMaxPanoramaWidth, kMaxPanoramaWidth, 3));
    EXPECT_FALSE(is_storable(8, 2, 3));
    EXPECT_FALSE(is_storable(2, 4, 1));
    EXPECT_FALSE(is_storable(4, 2, 2));
    EXPECT_FALSE(is_storable(0, 0, 1));
    // As a section: its shape must fit its type, its storage the file's, its raw size the table's.
    const auto read = [](std::uint32_t width, std::uint32_t height, std::uint32_t channels, SectionType type,
                         std::uint64_t more_raw = 0, Storage file = Storage::packed) {
        const Bytes section = encode_image(test::test_image(width, height, channels), Storage::packed, 1, 1);
        const TileGrid tiles(width, height, channels);
        const SectionEntry entry{.type = type,
                                 .offset = 0,
                                 .stored_bytes = section.size(),
                                 .raw_bytes = image_directory_bytes(tiles) + tiles.texel_bytes() + more_raw,
                                 .count = tiles.tiles()};
        return read_image_directory(section, entry, file).ok();
    };
    EXPECT_TRUE(read(4, 2, 3, panorama));
    EXPECT_FALSE(read(4, 2, 1, panorama));
    EXPECT_FALSE(read(4, 4, 3, panorama));
    EXPECT_TRUE(read(4, 4, 1, ground_texture));
    EXPECT_FALSE(read(4, 4, 3, ground_texture));
    EXPECT_FALSE(read(4, 2, 1, ground_lit));
    EXPECT_FALSE(read(4, 2, 3, panorama, 1));
    EXPECT_FALSE(read(4, 2, 3, panorama, 0, Storage::mapped));
}

// A brick's nodes and points must lie within the chunk, even if the memory after it holds more.
TEST(SingleCheck, BricksEndWithTheirChunk) {
    const std::vector<std::uint16_t> normals(64, 0);
    const Bytes radii(64, 9), masks(8, 0x81);
    const ChunkShape shape{.points = 4, .nodes = 2, .parents = 1, .bricks = 1};
    const std::array<BrickRecord, 1> above{BrickRecord{.node_map = 1}};
    const Bytes masks_above(8, 0x03); // two nodes below the only one
    std::array<BrickRecord, 1> bricks;
    const auto index = [&](std::size_t mask_count, std::size_t points, std::size_t masks_there = 1,
                           ChunkShape changed = {}) {
        if (changed.bricks == 0)
            changed = shape;
        return index_bricks({.bricks = above, .masks = ByteView(masks_above).first(masks_there), .first = 0}, changed,
                            2, ByteView(masks).first(mask_count), std::span(normals).first(points),
                            ByteView(radii).first(points), bricks);
    };
    EXPECT_TRUE(index(2, 4));
    EXPECT_FALSE(index(1, 2));
    EXPECT_FALSE(index(2, 3));
    EXPECT_FALSE(index(3, 4)); // one mask belongs to no brick
    EXPECT_FALSE(index(2, 5));
    EXPECT_FALSE(index(2, 4, 0));
}

// Later checks would refuse these files too: here each rule is tested by itself.
TEST(SingleCheck, PlacesInTheGridAndKindsInOrder) {
    Grid grid{.depth = 3, .origin = {std::numeric_limits<double>::quiet_NaN(), 0, 0}};
    EXPECT_EQ(decode_grid(encode_grid(grid), 3).error().offset, 0U);
    // Texture values twice.
    Bytes records = encode_attributes({.texture = true}, 3);
    const Bytes last(records.end() - 24, records.end());
    records.insert(records.end(), last.begin(), last.end());
    EXPECT_EQ(decode_attributes(records, 3).error().offset, 72U);
}

TEST(SingleCheck, ARasterOfTheGroundIsAtMost4096TexelsWide) {
    const std::uint32_t edge = 2 * kMaxGroundRaster;
    const TileGrid tiles(edge, edge, 1);
    ByteWriter directory; // every tile is one empty frame
    for (const std::uint32_t field : {edge, edge, static_cast<std::uint32_t>(tiles.tiles())})
        directory.u32(field);
    directory.u16(1);
    directory.u8(1);
    directory.zeros(9);
    std::uint64_t end = 0;
    for (std::size_t tile = 0; tile < tiles.tiles(); ++tile) {
        const std::size_t raw = tiles.tile_bytes(tiles.level_of(tile));
        const std::uint32_t stored = raw == 1 ? 1 : 1U << 31 | 1U;
        directory.u64(0);
        directory.u32(stored);
        directory.u32(0);
        ++end;
    }
    ByteWriter section;
    section.u64(hash64(directory.bytes()));
    section.append(directory.bytes());
    section.zeros(end);
    SectionEntry entry{.type = ground_lit,
                       .offset = 0,
                       .stored_bytes = section.size(),
                       .raw_bytes = image_directory_bytes(tiles) + tiles.texel_bytes(),
                       .count = tiles.tiles()};
    ASSERT_TRUE(decode_image_directory(section.bytes(), 0).ok());
    EXPECT_FALSE(read_image_directory(section.bytes(), entry, Storage::packed));
}

// Offsets of the first byte of each frame in `stored`.
std::vector<std::size_t> frames_of(const StreamEntry &stream, std::size_t planes, ByteView stored) {
    std::vector<std::size_t> frames;
    if (stream.filter == Filter::none) {
        if (stream.zstd)
            frames.push_back(0);
        return frames;
    }
    std::size_t at = kPlaneEntryBytes * planes;
    for (std::size_t plane = 0; plane < planes; ++plane) {
        std::uint32_t entry = 0;
        std::memcpy(&entry, stored.data() + kPlaneEntryBytes * plane, kPlaneEntryBytes);
        if (entry >> 31 != 0)
            frames.push_back(at);
        at += entry & 0xFFFFFF;
    }
    return frames;
}

// Damages the magic number of each frame of each stream in turn.
void refuse_broken_frames(const Bytes &file) {
    Reader reader = value_of(Reader::open(file));
    const Model model = value_of(load_model(reader, {.threads = 1}));
    std::size_t frames = 0;
    for (int level = 1; level <= reader.depth(); ++level)
        for (ChunkEntry entry : value_of(reader.directory(level))->chunks) {
            const ByteView view = slice(file, entry.offset, entry.stored_bytes);
            Bytes stored(view.begin(), view.end());
            std::size_t start = 0;
            for (const StreamEntry &stream : entry.streams) {
                for (const std::size_t frame :
                     frames_of(stream, plane_count(stream.filter), ByteView(stored).subspan(start))) {
                    stored[start + frame] ^= 0xFF;
                    entry.hash = hash64(stored);
                    const Level &above = model.levels[static_cast<std::size_t>(level) - 1];
                    Chunk chunk;
                    const Status status = decode_chunk(
                        entry, stored, reader.chunk_rules(level),
                        chunk_nodes(entry, above.masks, 0, above.points, 0, model.parameters.attributes), chunk);
                    EXPECT_FALSE(status) << "level " << level;
                    EXPECT_TRUE(status || status.error().offset == entry.offset + start) << "level " << level;
                    EXPECT_TRUE(status || status.error().rule == "5.6.1") << status.error().message;
                    stored[start + frame] ^= 0xFF;
                    ++frames;
                }
                start += stream.stored_bytes;
            }
        }
    EXPECT_GT(frames, 0U);
}

TEST(SingleCheck, EveryFrameIsVerified) {
    const Model model = sphere_model(5, every_attribute(ColourFormat::rgb888, 5));
    for (const bool filters : {false, true})
        refuse_broken_frames(value_of(encode_model(model, {.compression_level = 3, .filters = filters, .threads = 1})));
    for (const char *name : {"filtered-565.pbvg", "filtered-regions.pbvg"}) {
        const MappedFile file =
            value_of(MappedFile::open(std::string(PBM_SOURCE_DIR "/format_spec/vectors/valid/") + name));
        refuse_broken_frames({file.bytes().begin(), file.bytes().end()});
    }
}

TEST(SingleCheck, EveryPlaneOfATileIsVerified) {
    for (const std::uint32_t channels : {1U, 3U}) {
        Image image{.width = 64, .height = 64, .channels = channels, .texels = {}};
        for (std::size_t i = 0; i < std::size_t{64} * 64 * channels; ++i)
            image.texels.push_back(static_cast<std::uint8_t>(i / 64));
        const Bytes section = encode_image(image, Storage::packed, 3, 1);
        ImageDirectory directory = value_of(decode_image_directory(section, 0));
        const std::size_t last = directory.tiles.size() - 1;
        TileEntry &tile = directory.tiles[last];
        ASSERT_EQ(tile.stream.filter, Filter::texels);
        Bytes texels(directory.grid.tile_bytes(0));
        const auto decode = [&](std::size_t at, std::uint8_t bits) {
            Bytes damaged = section;
            damaged[tile.offset + at] ^= bits;
            tile.hash = hash64(ByteView(damaged).subspan(tile.offset, tile.stream.stored_bytes));
            return decode_tile(slice(damaged, tile.offset, tile.stream.stored_bytes), 0, directory, last, texels).ok();
        };
        EXPECT_TRUE(decode(0, 0));
        for (std::size_t plane = 0; plane < channels; ++plane) {
            EXPECT_FALSE(decode(4 * plane, 1));     // its size field
            EXPECT_FALSE(decode(4 * plane + 3, 1)); // a reserved bit of the size field
        }
        for (const std::size_t frame : frames_of(tile.stream, channels, ByteView(section).subspan(tile.offset)))
            EXPECT_FALSE(decode(frame, 0xFF));
        const auto decode_stored = [&](const Bytes &stored) {
            Bytes changed(section.begin(), section.begin() + static_cast<std::ptrdiff_t>(tile.offset));
            changed.insert(changed.end(), stored.begin(), stored.end());
            TileEntry &entry = directory.tiles[last];
            const StreamEntry before = entry.stream;
            entry.stream.stored_bytes = static_cast<std::uint32_t>(stored.size());
            entry.hash = hash64(stored);
            const bool decoded =
                decode_tile(slice(changed, entry.offset, stored.size()), 0, directory, last, texels).ok();
            entry.stream = before;
            return decoded;
        };
        Bytes stored(section.begin() + static_cast<std::ptrdiff_t>(tile.offset), section.end());
        EXPECT_TRUE(decode_stored(stored));
        stored.push_back(0); // a byte after the last plane
        EXPECT_FALSE(decode_stored(stored));
        EXPECT_FALSE(decode_stored(Bytes(4 * channels))); // every plane has size 0 and no byte follows
        tile.stream.stored_bytes -= 1;                    // the last plane ends one byte after the tile
        EXPECT_FALSE(decode(0, 0));
    }
}

} // namespace
} // namespace pbm
