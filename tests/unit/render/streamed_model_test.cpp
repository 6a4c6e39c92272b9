#include "pbm_render/detail/streamed_model.h"

#include "pbm_format/writing/writer.h"
#include "pbm_render/bricks/chunk_offsets.h"
#include "pbm_render/camera/unit_grid.h"
#include "unit/render/test_model.h"
#include "unit/support/file_editor.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <thread>

namespace pbm {
namespace {

using test::every_attribute;
using test::FileEditor;
using test::sphere_model;

const Model &model() {
    static const Model sphere = [] {
        Model made = sphere_model(7, every_attribute(ColourFormat::rgb565, 7));
        made.parameters.closed = true;
        return made;
    }();
    return sphere;
}

const Bytes &file(Storage storage, std::uint32_t chunk_points = 512) {
    static std::map<std::pair<Storage, std::uint32_t>, Bytes> files;
    Bytes &file = files[{storage, chunk_points}];
    if (file.empty())
        file = value_of(encode_model(model(), {.storage = storage, .chunk_points = chunk_points, .threads = 1}));
    return file;
}

Reader reader_of(ByteView bytes) { return value_of(Reader::open(bytes)); }

DetailView view_from(double distance, glm::dvec3 target = {0, -1, -2}) {
    DetailView view;
    view.camera = camera_in_front(target, distance);
    view.width = 320;
    view.height = 200;
    return view;
}

DetailView view_from_anywhere(test::Random &random) {
    DetailView view = view_from(1.3);
    view.camera.position =
        view.camera.focal_point + 1.3 * glm::normalize(glm::dvec3(random.unit(), random.unit(), random.unit()) - 0.5);
    return view;
}

std::uint64_t points_of(const Detail &detail) {
    std::uint64_t points = 0;
    for (const PointRun &run : detail.runs)
        points += run.last - run.first;
    return points;
}

template <class T> bool same(const T &a, const T &b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

void expect_same_view(const ChunkView &a, const ChunkView &b) {
    EXPECT_TRUE(same(a.masks, b.masks));
    EXPECT_TRUE(same(a.normals, b.normals));
    EXPECT_TRUE(same(a.radii, b.radii));
    EXPECT_TRUE(same(a.colours, b.colours));
    EXPECT_TRUE(same(a.materials, b.materials));
    EXPECT_TRUE(same(a.textures, b.textures));
    EXPECT_TRUE(same(a.bricks, b.bricks));
    for (std::size_t light = 0; light < a.shadows.size(); ++light)
        EXPECT_TRUE(same(a.shadows[light], b.shadows[light])) << light;
}

void expect_same_runs(const Detail &a, const Detail &b) {
    ASSERT_EQ(a.runs.size(), b.runs.size());
    for (std::size_t i = 0; i < a.runs.size(); ++i) {
        const PointRun &x = a.runs[i], &y = b.runs[i];
        EXPECT_EQ(x.level, y.level);
        EXPECT_EQ(x.first, y.first);
        EXPECT_EQ(x.last, y.last);
        EXPECT_EQ(x.entry->shape, y.entry->shape);
        expect_same_view(*x.chunk, *y.chunk);
    }
}

// Waits until `done`; false if that takes too long.
template <class Done> bool wait_for(Done &&done) {
    for (int i = 0; i < 20000 && !done(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return done();
}

TEST(StreamedModel, HasTheSameRunsAndStreamsPackedAndMapped) {
    for (const std::uint32_t chunk_points : {512U, kDefaultChunkPoints}) {
        StreamedModel packed(reader_of(file(Storage::packed, chunk_points)), {.threads = 2});
        StreamedModel mapped(reader_of(file(Storage::mapped, chunk_points)), {.threads = 2});
        for (const double distance : {8.0, 3.0, 1.2}) {
            const Detail a = value_of(packed.load(view_from(distance)));
            const Detail b = value_of(mapped.load(view_from(distance)));
            EXPECT_GT(points_of(a), 100U);
            EXPECT_TRUE(a.missing.empty());
            expect_same_runs(a, b);
        }
        EXPECT_GT(packed.statistics().points_decoded, 0U);
        EXPECT_EQ(mapped.statistics().points_decoded, 0U);
        EXPECT_GT(mapped.statistics().memory, 0U); // surface offsets and the lists of bricks that estimate them
        EXPECT_LT(mapped.statistics().memory, packed.statistics().memory / 3);
    }
}

TEST(StreamedModel, HoldsWhatTheModelHolds) {
    StreamedModel streamed(reader_of(file(Storage::packed)));
    DetailView view = view_from(8);
    view.max_error = 1e-3;
    const Detail detail = value_of(streamed.load(view));
    const PointAttributes &points = model().levels.back().points;
    for (const PointRun &run : detail.runs) {
        ASSERT_EQ(run.level, 7);
        const std::size_t first = run.entry->first_point;
        for (std::size_t i = run.first; i < run.last; ++i) {
            ASSERT_EQ(run.chunk->normals[i], points.normals[first + i]);
            ASSERT_EQ(run.chunk->radii[i], points.radii[first + i]);
            ASSERT_EQ(run.chunk->textures[i], points.textures[first + i]);
            ASSERT_EQ(run.chunk->shadows[0][i / 8] >> i % 8 & 1, points.shadows[0][first + i]);
        }
    }
}

TEST(StreamedModel, HasTheBoundsOfTheWholeModel) {
    const Sphere expected = find_extent(model()).sphere;
    for (const Storage storage : {Storage::packed, Storage::mapped})
        for (const std::uint32_t chunk_points : {512U, kDefaultChunkPoints}) {
            StreamedModel streamed(reader_of(file(storage, chunk_points)));
            const Sphere sphere = value_of(streamed.bounds()).sphere;
            EXPECT_EQ(sphere.centre, expected.centre);
            EXPECT_EQ(sphere.radius, expected.radius);
        }
}

// Bytes beyond those counted as read may have any value.
TEST(StreamedModel, ReadsNoMoreThanItCounts) {
    Bytes bytes = file(Storage::packed);
    StreamedModel streamed(reader_of(bytes));
    const std::uint64_t opened = streamed.statistics().bytes_read;
    const std::uint64_t small_end = streamed.reader().section(SectionType::level_directory, 1)->offset;
    EXPECT_LE(opened, small_end);
    EXPECT_GE(opened + 64, small_end); // sections are padded
    ASSERT_TRUE(streamed.bounds().ok());
    const SectionEntry &level_6 = *streamed.reader().section(SectionType::level_chunks, 6);
    const std::uint64_t end = level_6.offset + level_6.stored_bytes;
    EXPECT_LE(streamed.statistics().bytes_read, end);
    EXPECT_GE(streamed.statistics().bytes_read + 256, end);
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(end), bytes.end(), std::uint8_t{0xA5});

    DetailView view = view_from(8);
    view.max_error = 1e-3;
    view.finest = 6;
    const Detail detail = value_of(streamed.load(view));
    EXPECT_TRUE(detail.missing.empty());
    std::uint64_t points = 0;
    for (std::size_t level = 1; level <= 6; ++level)
        points += model().levels[level].points.size();
    EXPECT_EQ(streamed.statistics().points_decoded, points);
    EXPECT_LE(streamed.statistics().bytes_read, end);
    view.finest = 7;
    EXPECT_FALSE(streamed.load(view).ok());
}

TEST(StreamedModel, DecodesLittleForACloseUp) {
    StreamedModel streamed(reader_of(file(Storage::packed)));
    ASSERT_TRUE(streamed.load(view_from(0.2, {0, -1, -1.1})).ok());
    EXPECT_LE(streamed.statistics().points_decoded, model().point_count() / 4);
}

TEST(StreamedModel, IsTheSameForAnyNumberOfThreads) {
    StreamedModel one(reader_of(file(Storage::packed)), {.threads = 1});
    StreamedModel many(reader_of(file(Storage::packed)), {.threads = 8});
    const DetailView view = view_from(2);
    expect_same_runs(value_of(one.load(view)), value_of(many.load(view)));
    EXPECT_EQ(one.statistics().bytes_read, many.statistics().bytes_read);
    EXPECT_EQ(one.statistics().points_decoded, many.statistics().points_decoded);
    EXPECT_EQ(one.statistics().memory, many.statistics().memory);
}

// An orbit with less memory than the whole model takes.
TEST(StreamedModel, KeepsToItsMemory) {
    std::vector<DetailView> views;
    for (int i = 0; i < 12; ++i) {
        DetailView view = view_from(1.3);
        const double angle = i * 0.5236;
        view.camera.position = view.camera.focal_point + 1.3 * glm::dvec3(std::sin(angle), 0, std::cos(angle));
        view.camera.view_angle = 0.3;
        views.push_back(view);
    }
    StreamedModel unbounded(reader_of(file(Storage::packed)), {.threads = 2});
    std::uint64_t largest = 0; // bytes that a single view needs
    for (const DetailView &view : views) {
        StreamedModel alone(reader_of(file(Storage::packed)), {.threads = 2});
        ASSERT_TRUE(alone.load(view).ok());
        ASSERT_TRUE(unbounded.load(view).ok());
        largest = std::max(largest, alone.statistics().memory);
    }
    ASSERT_GT(unbounded.statistics().memory, largest * 3 / 2);

    StreamedModel bounded(reader_of(file(Storage::packed)), {.threads = 2, .max_memory = largest + largest / 4});
    for (const DetailView &view : views) {
        const Result<Detail> detail = bounded.load(view);
        ASSERT_TRUE(detail.ok()) << detail.error().message;
        expect_same_runs(*detail, value_of(unbounded.load(view)));
        EXPECT_LE(bounded.statistics().memory, largest + largest / 4);
    }
    EXPECT_GT(bounded.statistics().points_decoded, unbounded.statistics().points_decoded);

    StreamedModel too_small(reader_of(file(Storage::packed)), {.max_memory = largest / 2});
    Status refused;
    for (std::size_t i = 0; i < views.size() && refused; ++i)
        if (const Result<Detail> detail = too_small.load(views[i]); !detail)
            refused = detail.error();
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::memory);
    EXPECT_LE(too_small.statistics().memory, largest / 2);
}

TEST(StreamedModel, KeepsThePictureThatIsBeingDrawn) {
    const DetailView front = view_from(1.3);
    DetailView back = front;
    back.camera.position = 2.0 * front.camera.focal_point - front.camera.position;
    StreamedModel probe(reader_of(file(Storage::packed)));
    ASSERT_TRUE(probe.load(front).ok());
    const std::uint64_t one = probe.statistics().memory;
    ASSERT_TRUE(probe.load(back).ok());
    const std::uint64_t both = probe.statistics().memory;
    StreamedModel streamed(reader_of(file(Storage::packed)), {.max_memory = (one + both) / 2});
    const Detail drawn = value_of(streamed.load(front));
    EXPECT_FALSE(streamed.load(back).ok()); // no memory left beside the drawn chunks
    expect_same_runs(drawn, probe.choose(front));
}

TEST(StreamedModel, RefinesInTheBackground) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        std::atomic<int> arrived{0};
        StreamedModel streamed(reader_of(file(storage)), {.threads = 3, .arrived = [&] { ++arrived; }});
        const DetailView view = view_from(3);
        Detail detail = streamed.choose(view);
        EXPECT_TRUE(detail.runs.empty());
        streamed.request(std::move(detail.missing));
        int finest_before = 0;
        EXPECT_TRUE(wait_for([&] { // pictures get finer and never have holes
            Detail now = streamed.choose(view);
            const bool complete = now.missing.empty();
            streamed.request(std::move(now.missing));
            int finest = 0;
            for (const PointRun &run : now.runs)
                finest = std::max(finest, run.level);
            EXPECT_GE(finest, finest_before);
            finest_before = finest;
            return complete;
        }));
        EXPECT_TRUE(wait_for([&] { return !streamed.is_loading(); }));
        EXPECT_GT(arrived, 0);
        StreamedModel at_once(reader_of(file(storage)));
        expect_same_runs(streamed.choose(view), value_of(at_once.load(view)));
        EXPECT_EQ(streamed.statistics().points_decoded, at_once.statistics().points_decoded);
    }
}

// Bricks of a picture that face the eye, of chunks that it shows as a whole: how many there are, and how many have
// their surface offsets.
struct BricksWithOffsets {
    std::size_t facing = 0, estimated = 0;
};

BricksWithOffsets find_offsets(const Detail &detail, const DetailView &view) {
    const Projection projection(in_unit_grid(view.camera, model().parameters), view.width, view.height);
    const FrameGeometry frame(projection, view.width, view.height);
    BricksWithOffsets bricks;
    for (const PointRun &run : detail.runs) {
        if (run.first != 0 || run.last != run.entry->shape.points)
            continue;
        std::vector<VisibleBrick> seen(run.chunk->bricks.size());
        seen.resize(find_visible_bricks(RunGeometry(run, frame), frame, seen));
        for (const VisibleBrick &brick : seen) {
            bricks.facing += brick.faces_eye;
            bricks.estimated += brick.faces_eye && run.offsets->has(brick.brick);
        }
    }
    return bricks;
}

// No frame waits for the offsets of a chunk that was loaded for it.
TEST(StreamedModel, EstimatesSurfaceOffsetsWhereItLoads) {
    const DetailView view = view_from(1.3);
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        StreamedModel at_once(reader_of(file(storage)));
        const BricksWithOffsets loaded = find_offsets(value_of(at_once.load(view)), view);
        EXPECT_GT(loaded.facing, 20U);
        EXPECT_EQ(loaded.estimated, loaded.facing);

        StreamedModel streamed(reader_of(file(storage)));
        Detail detail = streamed.choose(view);
        for (int i = 0; i < 20 && !detail.missing.empty(); ++i) {
            streamed.request(detail.missing);
            EXPECT_TRUE(wait_for([&] { return !streamed.is_loading(); }));
            detail = streamed.choose(view);
        }
        const BricksWithOffsets requested = find_offsets(detail, view);
        EXPECT_EQ(requested.facing, loaded.facing);
        EXPECT_EQ(requested.estimated, requested.facing);
    }
}

// The view changes while chunks of older views are being decoded, and memory is too small for all.
TEST(StreamedModel, FollowsAViewThatMoves) {
    StreamedModel probe(reader_of(file(Storage::packed)));
    ASSERT_TRUE(probe.load(view_from(1.3)).ok());
    const std::uint64_t max_memory = probe.statistics().memory * 3 / 2;
    StreamedModel streamed(reader_of(file(Storage::packed)), {.threads = 2, .max_memory = max_memory});
    test::Random random(5);
    for (int i = 0; i < 200; ++i) {
        Detail detail = streamed.choose(view_from_anywhere(random));
        EXPECT_LE(streamed.statistics().memory, max_memory);
        streamed.request(std::move(detail.missing));
        for (const PointRun &run : detail.runs)
            EXPECT_EQ(run.chunk->normals.size(), run.entry->shape.points);
    }
    EXPECT_TRUE(wait_for([&] { return !streamed.is_loading(); }));
    EXPECT_TRUE(streamed.take_errors().empty());
}

// A chunk of an older view is being loaded while its parent chunk is no longer needed: the parent stays.
TEST(StreamedModel, KeepsTheParentOfAChunkBeingLoaded) {
    StreamedModel probe(reader_of(file(Storage::packed)));
    ASSERT_TRUE(probe.load(view_from(1.3)).ok());
    const std::uint64_t max_memory = probe.statistics().memory * 11 / 10;
    StreamedModel streamed(reader_of(file(Storage::packed)), {.threads = 1, .max_memory = max_memory});
    test::Random random(7);
    for (int i = 0; i < 40; ++i) {
        streamed.request(streamed.choose(view_from_anywhere(random)).missing);
        streamed.choose(view_from(50));
        EXPECT_TRUE(wait_for([&] { return !streamed.is_loading(); }));
        EXPECT_LE(streamed.statistics().memory, max_memory);
    }
    EXPECT_TRUE(streamed.take_errors().empty());
}

TEST(StreamedModel, NamesADamagedChunkOnceAndShowsWhatIsLeft) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        Bytes bytes = file(storage);
        StreamedModel intact(reader_of(file(storage)));
        DetailView view = view_from(3);
        view.max_error = 1e-3;
        const Detail whole = value_of(intact.load(view));
        Reader directories = reader_of(file(storage));
        const std::uint32_t above = whole.runs[whole.runs.size() / 2].entry->shape.parent_chunk;
        const ChunkEntry damaged = value_of(directories.directory(6))->chunks[above];
        bytes[damaged.offset + damaged.stored_bytes / 2] ^= 1;

        StreamedModel at_once(reader_of(bytes));
        const Result<Detail> refused = at_once.load(view);
        ASSERT_FALSE(refused.ok());
        EXPECT_EQ(refused.error().code, ErrorCode::bad_hash);
        EXPECT_EQ(refused.error().offset, damaged.offset);

        StreamedModel streamed(reader_of(bytes), {.threads = 2});
        std::vector<Error> errors;
        EXPECT_TRUE(wait_for([&] {
            Detail detail = streamed.choose(view);
            const bool complete = detail.missing.empty();
            streamed.request(std::move(detail.missing));
            for (Error &error : streamed.take_errors())
                errors.push_back(std::move(error));
            return complete;
        }));
        ASSERT_EQ(errors.size(), 1U);
        EXPECT_EQ(errors[0].offset, damaged.offset);
        const Detail left = streamed.choose(view);
        std::uint64_t coarse = 0, fine = 0;
        for (const PointRun &run : left.runs)
            (run.level == 7 ? fine : coarse) += run.last - run.first;
        EXPECT_EQ(coarse, damaged.shape.nodes); // points of the level above replace the damaged chunk
        EXPECT_LT(fine, points_of(whole));
        EXPECT_GT(fine, points_of(whole) / 2);
        EXPECT_FALSE(streamed.is_loading());
        EXPECT_TRUE(streamed.take_errors().empty());
    }
}

TEST(StreamedModel, StopsAboveADamagedDirectory) {
    Bytes bytes = file(Storage::packed);
    FileEditor editor(bytes);
    editor.flip(8 * editor.chunk(7, 3));
    StreamedModel at_once(reader_of(editor.bytes()));
    DetailView view = view_from(3);
    view.max_error = 1e-3;
    const Result<Detail> refused = at_once.load(view);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::bad_hash);

    StreamedModel streamed(reader_of(editor.bytes()));
    Detail detail = streamed.choose(view);
    EXPECT_EQ(streamed.take_errors().size(), 1U);
    streamed.request(std::move(detail.missing));
    EXPECT_TRUE(wait_for([&] { return streamed.choose(view).missing.empty(); }));
    for (const PointRun &run : streamed.choose(view).runs)
        EXPECT_EQ(run.level, 6);
    EXPECT_TRUE(streamed.take_errors().empty());
}

} // namespace
} // namespace pbm
