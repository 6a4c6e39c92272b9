// Out of memory is an error of every function: the n-th allocation fails, for n = 1, 2, ... Sanitizers have an operator
// new of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#include "ball.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<long> allocations_left{-1};         // before one fails; negative: none does
std::atomic<std::size_t> smallest_allocation{}; // that counts, bytes

void *allocate(std::size_t size) {
    if (size >= smallest_allocation && allocations_left >= 0 && allocations_left-- <= 0) {
        allocations_left = -1;
        throw std::bad_alloc();
    }
    if (void *const block = std::malloc(size == 0 ? 1 : size))
        return block;
    throw std::bad_alloc();
}

} // namespace

void *operator new(std::size_t size) { return allocate(size); }
void operator delete(void *block) noexcept { std::free(block); }
void operator delete(void *block, std::size_t) noexcept { std::free(block); }

namespace pbm::test {
namespace {

// Calls `work`, whose n-th allocation fails, until one call makes fewer.
template <class Work> int fail_each(const Work &work, std::size_t smallest = 0) {
    smallest_allocation = smallest;
    for (int n = 0;; ++n) {
        allocations_left = n;
        const pbm_code code = work();
        const bool was_reached = allocations_left < 0;
        allocations_left = -1;
        if (!was_reached) {
            EXPECT_EQ(code, PBM_OK);
            return n;
        }
        EXPECT_TRUE(code == PBM_LIMIT || code == PBM_OK) << n << ": " << code; // some do with less
    }
}

TEST(CApiMemory, RunsOutWhileAModelIsRead) {
    const std::vector<std::uint8_t> bytes = ball_bytes({{"depth", "5"}});
    std::vector<double> positions(3 * 20000);
    EXPECT_GT(fail_each([&] {
                  pbm_model *model = nullptr;
                  pbm_code code = pbm_open_memory(bytes.data(), bytes.size(), &model, nullptr);
                  pbm_info info = PBM_NEW(pbm_info);
                  if (code == PBM_OK)
                      code = pbm_get_info(model, &info, nullptr);
                  pbm_points points = PBM_NEW(pbm_points);
                  points.capacity = positions.size() / 3;
                  points.positions = positions.data();
                  points.threads = 1;
                  if (code == PBM_OK)
                      code = pbm_read_points(model, 5, &points, nullptr, nullptr);
                  pbm_close(model);
                  return code;
              }),
              50);
}

TEST(CApiMemory, RunsOutWhileAPictureIsDrawn) {
    const BallModel ball(Options{{"depth", "5"}});
    const pbm_camera camera = camera_of(ball.get(), 8, 8);
    const std::vector<std::uint8_t> bytes = ball_bytes({{"depth", "5"}});
    for (const int quality : {PBM_FAST, PBM_FINE})
        EXPECT_GT(fail_each([&] {
                      pbm_model *model = nullptr;
                      pbm_code code = pbm_open_memory(bytes.data(), bytes.size(), &model, nullptr);
                      std::array<std::uint8_t, 256> pixels{};
                      pbm_picture picture = PBM_NEW(pbm_picture);
                      picture.width = picture.height = 8;
                      picture.pixels = pixels.data();
                      picture.pixel_bytes = pixels.size();
                      pbm_render_options options = PBM_NEW(pbm_render_options);
                      options.quality = quality;
                      options.samples = 1;
                      options.threads = 1;
                      if (code == PBM_OK)
                          code = pbm_render(model, &camera, &options, &picture, nullptr);
                      pbm_close(model);
                      return code;
                  }),
                  50);
}

TEST(CApiMemory, RunsOutWhileAModelIsValidated) {
    const std::vector<std::uint8_t> bytes = ball_bytes({{"depth", "5"}});
    EXPECT_GT(fail_each([&] {
                  pbm_validation validation = PBM_NEW(pbm_validation);
                  validation.threads = 1;
                  validation.level = PBM_VALIDATE_DEEP;
                  return pbm_validate_memory(bytes.data(), bytes.size(), &validation, nullptr);
              }),
              50);
}

// Not for want of a few bytes: nlohmann_json's destructors allocate, and end the process where that fails.
TEST(CApiMemory, RunsOutWhileAModelIsBuilt) {
    constexpr std::size_t kSmallest = 1024;
    const Ball ball;
    const pbm_arrays arrays = ball.arrays();
    EXPECT_GT(fail_each(
                  [&] {
                      pbm_builder *builder = nullptr;
                      pbm_model *model = nullptr;
                      pbm_code code = pbm_new_builder(&builder, nullptr);
                      for (const auto &[key, value] : {std::pair("depth", "5"), std::pair("threads", "1")})
                          if (code == PBM_OK)
                              code = pbm_set_option(builder, key, value, nullptr);
                      if (code == PBM_OK)
                          code = pbm_add_arrays(builder, &arrays, nullptr);
                      if (code == PBM_OK)
                          code = pbm_build(builder, nullptr, &model, nullptr);
                      pbm_close(model);
                      pbm_free_builder(builder);
                      return code;
                  },
                  kSmallest),
              100);
}

} // namespace
} // namespace pbm::test

#endif
