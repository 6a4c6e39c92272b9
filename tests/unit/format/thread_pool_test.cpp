#include "system/threads/parallel.h"
#include "system/threads/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace pbm {
namespace {

// A barrier: waits until `count` threads have arrived.
class Meeting {
  public:
    explicit Meeting(int count) : missing_(count) {}
    void arrive() {
        std::unique_lock lock(mutex_);
        if (--missing_ == 0)
            all_here_.notify_all();
        all_here_.wait(lock, [&] { return missing_ <= 0; });
    }

  private:
    std::mutex mutex_;
    std::condition_variable all_here_;
    int missing_;
};

// The last item of a loop may be taken between a worker's waking and its next look.
TEST(ThreadPool, SurvivesLoopsThatEndWhileWorkersWake) {
    ThreadPool pool(4);
    std::atomic<std::size_t> done{0};
    constexpr std::size_t kLoops = 100000;
    for (std::size_t i = 0; i < kLoops; ++i)
        pool.run(2, [&](std::size_t, std::size_t) { ++done; });
    EXPECT_EQ(done, 2 * kLoops);
}

TEST(ThreadPool, RunsEachItemOnceInEveryRound) {
    for (const int threads : {1, 2, 5}) {
        ThreadPool pool(threads);
        EXPECT_EQ(pool.threads(), threads);
        for (const std::size_t count : {0U, 1U, 2U, 3U, 100U, 1000U}) {
            std::vector<int> times(count);
            std::vector<std::atomic<int>> inside(static_cast<std::size_t>(threads));
            std::atomic<bool> shared = false;
            pool.run(count, [&](std::size_t i, std::size_t thread) {
                shared = shared || inside[thread].exchange(1) != 0;
                ++times[i];
                inside[thread] = 0;
            });
            EXPECT_EQ(times, std::vector<int>(count, 1)) << threads;
            EXPECT_FALSE(shared) << "two threads with one number";
        }
    }
}

TEST(ThreadPool, RunsItemsOnAllItsThreads) {
    ThreadPool pool(3);
    for (int round = 0; round < 20; ++round) {
        Meeting meeting(3);
        std::vector<std::size_t> thread_of(3);
        pool.run(3, [&](std::size_t i, std::size_t thread) {
            meeting.arrive();
            thread_of[i] = thread;
        });
        EXPECT_EQ(std::set(thread_of.begin(), thread_of.end()), (std::set<std::size_t>{0, 1, 2}));
    }
}

TEST(ThreadPool, RethrowsTheFirstExceptionLeavesItemsOutAndGoesOn) {
    ThreadPool pool(2);
    Meeting meeting(2);
    std::atomic<int> items = 0;
    std::string told;
    try {
        pool.run(1000, [&](std::size_t i, std::size_t) {
            ++items;
            meeting.arrive(); // items 0 and 1
            throw std::runtime_error("item " + std::to_string(i));
        });
    } catch (const std::runtime_error &error) {
        told = error.what();
    }
    EXPECT_EQ(items, 2);
    EXPECT_TRUE(told == "item 0" || told == "item 1") << told;
    pool.run(2, [&](std::size_t, std::size_t) { ++items; });
    EXPECT_EQ(items, 4);
}

TEST(ThreadPool, RunsLoopsBesidePostedWork) {
    ThreadPool pool(2);
    std::promise<void> begun, gate;
    auto posted = pool.post([&] {
        begun.set_value();
        gate.get_future().wait();
        return 7;
    });
    begun.get_future().wait();
    int items = 0;
    pool.run(10, [&](std::size_t, std::size_t) { ++items; }); // its only worker is blocked
    EXPECT_EQ(items, 10);
    gate.set_value();
    EXPECT_EQ(posted.get(), 7);
}

TEST(ThreadPool, DoesPostedWorkAtOnceWithoutWorkers) {
    ThreadPool pool(1);
    int woken = 0;
    pool.set_wake([&] { ++woken; });
    auto result = pool.post([] { return 7; });
    EXPECT_EQ(woken, 1);
    EXPECT_TRUE(is_ready(result));
    EXPECT_EQ(result.get(), 7);
}

TEST(ThreadPool, DoesPostedWorkInItsOrderWithOneWorker) {
    ThreadPool pool(2);
    std::vector<int> order; // only the one worker writes to it
    std::vector<std::future<int>> results;
    results.reserve(100);
    for (int i = 0; i < 100; ++i)
        results.push_back(pool.post([i, &order] {
            order.push_back(i);
            return i * i;
        }));
    for (int i = 0; i < 100; ++i)
        EXPECT_EQ(results[static_cast<std::size_t>(i)].get(), i * i);
    std::vector<int> ascending(100);
    std::iota(ascending.begin(), ascending.end(), 0);
    EXPECT_EQ(order, ascending);
}

TEST(ThreadPool, DoesPostedWorkOnAllItsWorkers) {
    ThreadPool pool(4);
    Meeting meeting(3);
    std::vector<std::future<void>> results;
    results.reserve(3);
    for (int i = 0; i < 3; ++i)
        results.push_back(pool.post([&] { meeting.arrive(); }));
    for (std::future<void> &result : results)
        result.get();
}

TEST(ThreadPool, IsBusyUntilPostedWorkIsDoneAndThenWakes) {
    ThreadPool pool(2);
    EXPECT_FALSE(pool.busy());
    std::promise<void> gate, woken;
    pool.set_wake([&] { woken.set_value(); });
    auto result = pool.post([&] {
        gate.get_future().wait();
        return std::string("done");
    });
    EXPECT_TRUE(pool.busy());
    EXPECT_FALSE(is_ready(result));
    gate.set_value();
    woken.get_future().wait();
    EXPECT_TRUE(is_ready(result));
    EXPECT_EQ(result.get(), "done");
    EXPECT_FALSE(is_ready(result)); // taken
    pool.set_wake({});
    EXPECT_FALSE(pool.busy());
}

TEST(ThreadPool, WakesForOthersAsLongAsSomebodyListens) {
    ThreadPool pool(2);
    pool.wake();
    std::atomic<int> woken = 0;
    pool.set_wake([&] { ++woken; });
    std::thread([&] { pool.wake(); }).join();
    EXPECT_EQ(woken, 1);
    pool.set_wake({});
    pool.wake();
    EXPECT_EQ(woken, 1);
}

TEST(ThreadPool, HandsExceptionsOfPostedWorkOverAndGoesOn) {
    ThreadPool pool(2);
    auto failing = pool.post([]() -> int { throw std::runtime_error("no memory, say"); });
    auto working = pool.post([] { return 1; });
    EXPECT_THROW(failing.get(), std::runtime_error);
    EXPECT_EQ(working.get(), 1);
}

TEST(ThreadPool, DropsWorkNotBegunWhenItEnds) {
    std::promise<void> begun, gate;
    std::atomic<bool> second_ran = false;
    std::future<int> first, second;
    std::optional<ThreadPool> pool(2);
    first = pool->post([&] {
        begun.set_value();
        gate.get_future().wait();
        return 1;
    });
    second = pool->post([&] {
        second_ran = true;
        return 2;
    });
    begun.get_future().wait();
    std::thread opener([&] { gate.set_value(); }); // before or after reset() begins
    pool.reset();
    opener.join();
    EXPECT_EQ(first.get(), 1);
    if (!second_ran) {
        EXPECT_THROW(second.get(), std::future_error);
    }
}

TEST(ThreadPool, FreesWhatPostedWorkHeld) {
    ThreadPool pool(2);
    auto held = std::make_shared<int>(7);
    const std::weak_ptr<int> watched = held;
    pool.post([held = std::move(held)] { return *held; }).get();
    pool.post([] { return 0; }).get(); // the first task has been destroyed by now
    EXPECT_TRUE(watched.expired());
}

TEST(ParallelFor, CallsEachItemOnceWhateverTheBlocks) {
    for (const int threads : {0, 1, 3, 1000})
        for (const std::size_t count : {0U, 1U, 2U, 7U, 1000U}) {
            std::vector<int> times(count);
            parallel_for(count, threads, [&](std::size_t i) { ++times[i]; });
            EXPECT_EQ(times, std::vector<int>(count, 1));
            for (const std::size_t block : {1U, 3U, 1000U, 5000U}) {
                parallel_for(count, block, threads, [&](std::size_t i) { ++times[i]; });
                EXPECT_EQ(times, std::vector<int>(count, 2));
                std::atomic<std::size_t> blocks = 0;
                parallel_blocks(count, block, threads, [&](std::size_t begin, std::size_t end) {
                    ++blocks;
                    for (std::size_t i = begin; i < end; ++i)
                        --times[i];
                });
                EXPECT_EQ(times, std::vector<int>(count, 1));
                EXPECT_EQ(blocks, (count + block - 1) / block);
            }
        }
}

TEST(ParallelFor, RethrowsAnExceptionAfterAllThreadsEnded) {
    for (const int threads : {1, 4}) {
        std::atomic<int> inside = 0;
        EXPECT_THROW(parallel_for(100, threads,
                                  [&](std::size_t i) {
                                      ++inside;
                                      if (i == 50) {
                                          --inside;
                                          throw std::runtime_error("stop");
                                      }
                                      --inside;
                                  }),
                     std::runtime_error);
        EXPECT_EQ(inside, 0);
    }
}

} // namespace
} // namespace pbm
