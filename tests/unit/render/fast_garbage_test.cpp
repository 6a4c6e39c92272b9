// Bytes of chunks change after they were verified, as those of a mapped file may: pixels may be wrong, but no access
// is out of bounds. Each stream lies in an allocation of exactly its size, so that a sanitizer sees any access beyond.
#include "pbm_render/fast/fast_renderer.h"

#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fine/fine_renderer.h"
#include "unit/render/fast_test_model.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <hwy/targets.h>
#include <limits>
#include <thread>

namespace pbm {
namespace {

using test::every_attribute;
using test::Random;

// Copies of the chunks of one level.
class CopiedLevel {
  public:
    CopiedLevel(ByteView file, int level) : level_(file, level) {
        for (const PointRun &run : level_.runs) {
            Copy &copy = copies_.emplace_back(run.chunk->normals, run.chunk->bricks);
            const auto keep = [&](ByteView from) {
                Bytes &to = copy.bytes.emplace_back(from.begin(), from.end());
                return ByteView(to);
            };
            copy.view = *run.chunk;
            copy.view.normals = copy.normals;
            copy.view.bricks = copy.bricks;
            for (ByteView *stream :
                 {&copy.view.masks, &copy.view.radii, &copy.view.colours, &copy.view.materials, &copy.view.textures})
                *stream = keep(*stream);
            for (ByteView &shadow : copy.view.shadows)
                shadow = keep(shadow);
            runs.push_back(run);
            runs.back().chunk = &copy.view;
            runs.back().offsets = &offsets_.emplace_back();
        }
    }

    // Sets each byte, with probability 1 / rarity, to next().
    template <class Next> void spoil(Random &random, std::uint64_t rarity, Next &&next) {
        const auto spoil_bytes = [&](void *data, std::size_t size) {
            auto *const bytes = static_cast<std::uint8_t *>(data);
            for (std::size_t i = 0; i < size; ++i)
                if (random.below(rarity) == 0)
                    bytes[i] = static_cast<std::uint8_t>(next());
        };
        for (Copy &copy : copies_) {
            spoil_bytes(copy.normals.data(), copy.normals.size() * sizeof(std::uint16_t));
            spoil_bytes(copy.bricks.data(), copy.bricks.size() * sizeof(BrickRecord));
            for (Bytes &bytes : copy.bytes)
                spoil_bytes(bytes.data(), bytes.size());
        }
    }
    template <class Change> void change_bricks(Change &&change) {
        for (Copy &copy : copies_)
            for (BrickRecord &brick : copy.bricks)
                change(brick);
    }

    std::vector<PointRun> runs;

  private:
    struct Copy {
        Copy(std::span<const std::uint16_t> n, std::span<const BrickRecord> b)
            : normals(n.begin(), n.end()), bricks(b.begin(), b.end()) {}
        std::vector<std::uint16_t> normals;
        std::vector<BrickRecord> bricks;
        std::deque<Bytes> bytes;
        ChunkView view;
    };

    test::WholeLevel level_;
    std::deque<Copy> copies_;
    std::deque<ChunkOffsets> offsets_; // estimated after the bytes have changed
};

// Draws splats as blocks, as ellipses and around the eye.
void draw_all(const ModelParameters &parameters, std::span<const PointRun> runs, int level) {
    FastRenderer renderer(parameters, 512, 1);
    FineRenderer fine(parameters, 512, 1);
    for (const double pixels : {0.7, 1.3, 4.0, 1000.0})
        for (const int width : {1, 33}) {
            Framebuffer target(width, 21);
            Camera camera = test::camera_at_ball(level, pixels, 21);
            if (pixels > 100) {
                camera.position = {0.3, -1.2, -1.9};
                camera.view_angle = 2;
            }
            const RenderStatistics drawn = renderer.render(runs, camera, {}, target);
            EXPECT_LE(drawn.drawn_points, 512 * 512 * runs.size());
            fine.render(runs, camera, {}, target, 1);
        }
}

// Every attribute, a point light, and fewer materials than a byte can index.
const Model &model() {
    static const Model kModel = [] {
        Model model = test::smooth_ball(5, every_attribute(ColourFormat::rgb888, 5), 5);
        model.parameters.lights[0] = {.kind = LightKind::point, .position = {2, 1, 1}};
        return model;
    }();
    return kModel;
}
const Bytes &file() {
    static const Bytes kFile =
        value_of(encode_model(model(), {.storage = Storage::mapped, .chunk_points = 512, .threads = 1}));
    return kFile;
}

TEST(FastRendererGarbage, AnyBytesStayInBounds) {
    Random random(7);
    for (const int level : {1, 2, 3, 5})
        for (const std::uint64_t rarity : {1U, 3U, 40U, 1000U})
            for (int i = 0; i < 4; ++i) {
                CopiedLevel chunks(file(), level);
                chunks.spoil(random, rarity, [&] { return random.next(); });
                draw_all(model().parameters, chunks.runs, level);
            }
}

TEST(FastRendererGarbage, ExtremeBytesStayInBounds) {
    Random random(8);
    for (const int level : {1, 3, 5})
        for (const unsigned byte : {0x00U, 0x01U, 0x7FU, 0x80U, 0xFFU})
            for (const std::uint64_t rarity : {1U, 5U}) {
                CopiedLevel chunks(file(), level);
                chunks.spoil(random, rarity, [&] { return byte; });
                draw_all(model().parameters, chunks.runs, level);
            }
}

// Bricks with extreme fields, first with the original streams, then with masks of eight children.
TEST(FastRendererGarbage, ExtremeBricksStayInBounds) {
    using Change = void (*)(BrickRecord &);
    for (const Change change :
         {Change([](BrickRecord &b) { b.node_map = ~std::uint64_t{0}; }),
          Change([](BrickRecord &b) { b.first_point = 65535; }), Change([](BrickRecord &b) { b.first_node = 65535; }),
          Change([](BrickRecord &b) { b.first_point = 511; }),
          Change([](BrickRecord &b) { b.first_node = 0, b.node_map = ~std::uint64_t{0}; }),
          Change([](BrickRecord &b) { b.first_point = 0, b.first_node = 0; }),
          Change([](BrickRecord &b) { b.x = b.y = b.z = 65535; }),
          Change([](BrickRecord &b) { b.largest_radius = 255; }), Change([](BrickRecord &b) { b.largest_radius = 0; }),
          Change([](BrickRecord &b) { b.cone_axis = 65535, b.cone_cosine = 32767; }),
          Change([](BrickRecord &b) { b.cone_axis = 65535, b.cone_cosine = -32767; })})
        for (const int level : {3, 5}) {
            CopiedLevel chunks(file(), level);
            chunks.change_bricks(change);
            draw_all(model().parameters, chunks.runs, level);
            Random random(9); // all masks have eight children
            chunks.spoil(random, 1, [] { return 255; });
            chunks.change_bricks(change);
            draw_all(model().parameters, chunks.runs, level);
        }
}

TEST(FastRendererGarbage, EverySimdTargetStaysInBounds) {
    for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
        hwy::SetSupportedTargetsForTest(targets & -targets);
        Random random(10);
        for (const std::uint64_t rarity : {1U, 30U}) {
            CopiedLevel chunks(file(), 5);
            chunks.spoil(random, rarity, [&] { return random.next(); });
            draw_all(model().parameters, chunks.runs, 5);
        }
    }
    hwy::SetSupportedTargetsForTest(0);
}

// Another thread writes to the verified bytes while both renderers draw them.
TEST(FastRendererGarbage, BytesMayChangeWhileTheyAreDrawn) {
#ifdef __SANITIZE_THREAD__
    GTEST_SKIP() << "a race on purpose";
#endif
    Bytes bytes = file();
    StreamedModel streamed(value_of(Reader::open(bytes)));
    FastRenderer renderer(streamed.reader().parameters(), 512, 2);
    DetailView view{.camera = test::camera_at_ball(5, 2, 60), .width = 80, .height = 60, .max_error = 3};
    const Detail detail = value_of(streamed.load(view));
    ASSERT_FALSE(detail.runs.empty());
    const std::size_t first_chunk = streamed.reader().section(SectionType::level_directory, 1)->offset;
    std::atomic<bool> stop{false};
    std::jthread writer([&] {
        Random random(11);
        while (!stop) {
            const std::size_t at = first_chunk + random.below(bytes.size() - first_chunk);
            std::atomic_ref<std::uint8_t>(bytes[at]).store(static_cast<std::uint8_t>(random.next()),
                                                           std::memory_order_relaxed);
        }
    });
    Framebuffer target(view.width, view.height);
    for (int frame = 0; frame < 100; ++frame)
        renderer.render(detail.runs, view.camera, {}, target);
    FineRenderer fine(streamed.reader().parameters(), 512, 2);
    for (int frame = 0; frame < 20; ++frame)
        fine.render(detail.runs, view.camera, {}, target, 2);
    stop = true;
}

} // namespace
} // namespace pbm
