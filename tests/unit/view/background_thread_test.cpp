#include "system/threads/background_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace pbm {
namespace {

TEST(BackgroundThread, DoesOnePieceOfWorkAfterTheOther) {
    BackgroundThread thread;
    std::vector<int> order; // only that thread writes to it
    std::vector<std::future<int>> results;
    results.reserve(100);
    for (int i = 0; i < 100; ++i)
        results.push_back(thread.post([i, &order] {
            order.push_back(i);
            return i * i;
        }));
    for (int i = 0; i < 100; ++i)
        EXPECT_EQ(results[static_cast<std::size_t>(i)].get(), i * i);
    for (int i = 0; i < 100; ++i)
        EXPECT_EQ(order[static_cast<std::size_t>(i)], i);
}

TEST(BackgroundThread, IsBusyUntilItsWorkIsDoneAndThenWakes) {
    BackgroundThread thread;
    EXPECT_FALSE(thread.busy());
    std::promise<void> gate, woken;
    thread.set_wake([&] { woken.set_value(); });
    auto result = thread.post([&] {
        gate.get_future().wait();
        return std::string("done");
    });
    EXPECT_TRUE(thread.busy());
    EXPECT_FALSE(is_ready(result));
    gate.set_value();
    woken.get_future().wait();
    EXPECT_TRUE(is_ready(result));
    EXPECT_EQ(result.get(), "done");
    EXPECT_FALSE(is_ready(result)); // taken
    thread.set_wake({});
    EXPECT_FALSE(thread.busy());
}

TEST(BackgroundThread, WakesForOthersAsLongAsSomebodyListens) {
    BackgroundThread thread;
    thread.wake();
    std::atomic<int> woken = 0;
    thread.set_wake([&] { ++woken; });
    std::jthread([&] { thread.wake(); }).join();
    EXPECT_EQ(woken, 1);
    thread.set_wake({});
    thread.wake();
    EXPECT_EQ(woken, 1);
}

TEST(BackgroundThread, HandsExceptionsOverAndGoesOn) {
    BackgroundThread thread;
    auto failing = thread.post([]() -> int { throw std::runtime_error("no memory, say"); });
    auto working = thread.post([] { return 1; });
    EXPECT_THROW(failing.get(), std::runtime_error);
    EXPECT_EQ(working.get(), 1);
}

TEST(BackgroundThread, DropsWorkNotBegunWhenItEnds) {
    std::promise<void> begun;
    std::promise<void> gate;
    std::atomic<bool> second_ran = false;
    std::future<int> first, second;
    std::optional<BackgroundThread> thread(std::in_place);
    first = thread->post([&] {
        begun.set_value();
        gate.get_future().wait();
        return 1;
    });
    second = thread->post([&] {
        second_ran = true;
        return 2;
    });
    begun.get_future().wait();
    std::jthread opener([&] { gate.set_value(); }); // before or after the end was asked for
    thread.reset();
    EXPECT_EQ(first.get(), 1);
    if (!second_ran) {
        EXPECT_THROW(second.get(), std::future_error);
    }
}

TEST(BackgroundThread, FreesWhatWorkHeld) {
    BackgroundThread thread;
    auto held = std::make_shared<int>(7);
    const std::weak_ptr<int> watched = held;
    thread.post([held = std::move(held)] { return *held; }).get();
    thread.post([] { return 0; }).get(); // the first one is gone by now
    EXPECT_TRUE(watched.expired());
}

} // namespace
} // namespace pbm
