#include "system/processes/child_process.h"
#include "system/processes/this_process.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PBM_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define PBM_SANITIZED 1
#endif
#endif

namespace {

using pbm::ByteSink;
using pbm::ByteView;
using pbm::ChildTask;
using pbm::Error;
using pbm::ErrorCode;
using pbm::Status;

ByteView view(std::string_view text) { return {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()}; }

ChildTask task(std::function<Status(const ByteSink &)> work, std::string *received = nullptr) {
    return {.name = "the test",
            .advice = "read on",
            .limits = {.cpu_seconds = 20, .wall_seconds = 60, .memory = std::uint64_t{64} << 20},
            .work = std::move(work),
            .receive = [received](ByteView bytes) -> Status {
                if (received != nullptr)
                    received->append(reinterpret_cast<const char *>(bytes.data()), bytes.size());
                return {};
            }};
}

// The error of a task that must fail: one line that names the task and says what to do.
Error failure(const ChildTask &t) {
    const Status status = pbm::run_in_child(t);
    EXPECT_FALSE(status.ok());
    if (status.ok())
        return Error{};
    const std::string &message = status.error().message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_EQ(message.rfind("the test ", 0), 0U) << message;
    EXPECT_NE(message.find("; read on"), std::string::npos) << message;
    return status.error();
}

bool has(const std::string &text, std::string_view part) { return text.find(part) != std::string::npos; }

std::size_t open_descriptors() {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto &entry : std::filesystem::directory_iterator("/proc/self/fd"))
        ++count;
    return count;
}

TEST(ChildProcess, WhatItSendsArrivesWholeAndInOrder) {
    std::string expected;
    for (std::uint32_t i = 0; i < 3'000'000; ++i)
        expected.append(reinterpret_cast<const char *>(&i), sizeof i);
    std::string received;
    const Status status = pbm::run_in_child(task(
        [&](const ByteSink &send) -> Status {
            const std::string_view all = expected;
            for (std::size_t at = 0, size = 1; at < all.size(); at += size, size = size * 3 % 100'003 + 1)
                send(view(all.substr(at, size)));
            return {};
        },
        &received));
    EXPECT_TRUE(status.ok());
    EXPECT_TRUE(received == expected);
}

TEST(ChildProcess, ItSeesTheCallersMemoryAndChangesOnlyItsOwn) {
    std::string text = "before", received;
    EXPECT_TRUE(pbm::run_in_child(task(
                                      [&](const ByteSink &send) -> Status {
                                          send(view(text));
                                          text = "after";
                                          return {};
                                      },
                                      &received))
                    .ok());
    EXPECT_EQ(received, "before");
    EXPECT_EQ(text, "before");
}

TEST(ChildProcess, AnErrorOfTheWorkComesBackAsItIs) {
    const Status status = pbm::run_in_child(task([](const ByteSink &) -> Status {
        return Error{ErrorCode::too_large, 12345, "line 7: too much"};
    }));
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().code, ErrorCode::too_large);
    EXPECT_EQ(status.error().offset, 12345U);
    EXPECT_EQ(status.error().message, "line 7: too much");
}

TEST(ChildProcess, ACrashBecomesOneLine) {
    const Error aborted = failure(task([](const ByteSink &) -> Status { std::abort(); }));
    EXPECT_EQ(aborted.code, ErrorCode::bad_input);
    EXPECT_TRUE(has(aborted.message, "crashed (signal 6)")) << aborted.message;
#ifndef PBM_SANITIZED
    const Error fault = failure(task([](const ByteSink &) -> Status {
        std::raise(SIGSEGV);
        return {};
    }));
    EXPECT_EQ(fault.code, ErrorCode::bad_input);
    EXPECT_TRUE(has(fault.message, "crashed (signal 11)")) << fault.message;
#endif
}

TEST(ChildProcess, AHandlerOfTheCallersDoesNotHideACrash) {
    pbm::end_when_mapped_file_shrinks("test");
    const Error e = failure(task([](const ByteSink &) -> Status {
        std::raise(SIGBUS);
        return {};
    }));
    std::signal(SIGBUS, SIG_DFL);
    EXPECT_TRUE(has(e.message, "crashed (signal 7)")) << e.message;
}

TEST(ChildProcess, AnExceptionBecomesOneLine) {
    const Error e = failure(task([](const ByteSink &) -> Status { throw std::runtime_error("no\nway"); }));
    EXPECT_EQ(e.code, ErrorCode::bad_input);
    EXPECT_EQ(e.message, "the test failed: no; read on");
    EXPECT_TRUE(has(failure(task([](const ByteSink &) -> Status { throw 7; })).message, "unknown exception"));
}

TEST(ChildProcess, ALoopEndsAtTheLimitOfComputing) {
    ChildTask endless = task([](const ByteSink &) -> Status {
        volatile bool go_on = true;
        while (go_on) {
        }
        return {};
    });
    endless.limits.cpu_seconds = 1;
    const Error e = failure(endless);
    EXPECT_EQ(e.code, ErrorCode::memory);
    EXPECT_TRUE(has(e.message, "not done after 1 s of computing")) << e.message;
}

TEST(ChildProcess, AWaitEndsAtTheDeadline) {
    ChildTask waiting = task([](const ByteSink &) -> Status {
        while (true)
            ::pause();
    });
    waiting.limits.wall_seconds = 1;
    const Error e = failure(waiting);
    EXPECT_EQ(e.code, ErrorCode::memory);
    EXPECT_TRUE(has(e.message, "not done after 1 s;")) << e.message;
}

TEST(ChildProcess, SendingWithoutEndEndsAtTheDeadline) {
    ChildTask talking = task([](const ByteSink &send) -> Status {
        const std::vector<std::uint8_t> bytes(1 << 16);
        while (true)
            send(bytes);
    });
    talking.limits.wall_seconds = 1;
    EXPECT_EQ(failure(talking).code, ErrorCode::memory);
}

TEST(ChildProcess, AllocatingWithoutBoundEndsAtTheLimit) {
#ifdef PBM_SANITIZED
    GTEST_SKIP() << "a sanitizer's own memory cannot be limited";
#else
    const Error e = failure(task([](const ByteSink &) -> Status {
        std::vector<std::vector<char>> all;
        while (true)
            all.emplace_back(std::size_t{1} << 20, 'x');
    }));
    EXPECT_EQ(e.code, ErrorCode::memory);
    EXPECT_TRUE(has(e.message, "exceeded its memory limit of 64 MB")) << e.message;
    // The memory limit does not count the caller's allocations.
    const std::vector<char> ballast(std::size_t{200} << 20, 'x');
    EXPECT_TRUE(pbm::run_in_child(task([&](const ByteSink &) -> Status {
                    const std::vector<char> some(std::size_t{32} << 20, ballast[1]);
                    return some.back() == 'x' ? Status() : Status(Error{ErrorCode::bad_input, 0, "other bytes"});
                })).ok());
#endif
}

TEST(ChildProcess, WhatItPrintsDoesNotReachTheTerminal) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const Error e = failure(task([](const ByteSink &) -> Status {
        std::cout << "out" << std::endl;
        std::puts("out");
        std::cerr << "\n bad \x1b[31mvertex\nmore\n";
        for (int i = 0; i < 100'000; ++i)
            std::cerr << "more and more and more\n";
        ::_exit(7);
    }));
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    EXPECT_EQ(e.message, "the test ended early (exit code 7) (bad ?[31mvertex); read on");
}

TEST(ChildProcess, ItsEndRunsNoHandlerAndFlushesNothingOfTheCallers) {
    static const char *touched = nullptr;
    const std::string path = testing::TempDir() + "pbm_child_process_test_" + std::to_string(::getpid());
    touched = path.c_str();
    std::atexit([] {
        if (touched != nullptr)
            std::ofstream(touched, std::ios::app) << "handler ran\n";
    });
    std::FILE *file = std::fopen(path.c_str(), "w");
    ASSERT_NE(file, nullptr);
    std::fputs("once\n", file); // stays in the buffer
    EXPECT_TRUE(pbm::run_in_child(task([](const ByteSink &) -> Status { return {}; })).ok());
    const Error e = failure(task([](const ByteSink &) -> Status { std::exit(0); }));
    EXPECT_TRUE(has(e.message, "ended early (exit code 1)")) << e.message;
    std::fclose(file);
    std::ifstream in(path);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "once\n");
    touched = nullptr;
    std::filesystem::remove(path);
}

TEST(ChildProcess, AReceiverThatRefusesEndsIt) {
    ChildTask t = task([](const ByteSink &send) -> Status {
        while (true)
            send(view("more"));
    });
    t.receive = [](ByteView) -> Status { return Error{ErrorCode::too_large, 4, "enough"}; };
    const Status status = pbm::run_in_child(t);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().message, "enough");
    t.receive = [](ByteView) -> Status { throw std::runtime_error("caller's own"); };
    EXPECT_THROW(static_cast<void>(pbm::run_in_child(t)), std::runtime_error);
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1); // no child process remains
}

TEST(ChildProcess, NothingOfItIsLeft) {
    const std::size_t before = open_descriptors();
    for (int i = 0; i < 20; ++i) {
        EXPECT_TRUE(pbm::run_in_child(task([](const ByteSink &) -> Status { return {}; })).ok());
        failure(task([](const ByteSink &) -> Status { std::abort(); }));
    }
    EXPECT_EQ(open_descriptors(), before);
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
}

TEST(ChildProcess, ItHasNoDescriptorOfTheCallers) {
    std::string received;
    EXPECT_TRUE(pbm::run_in_child(task(
                                      [](const ByteSink &send) -> Status {
                                          send(view(std::to_string(open_descriptors())));
                                          return {};
                                      },
                                      &received))
                    .ok());
    EXPECT_EQ(received, "6"); // five of its own, and the open directory
}

TEST(ChildProcess, ACallerWithoutStandardDescriptorsOrChildSignalsIsServed) {
    std::string received;
    const Status status = pbm::run_in_child(task(
        [](const ByteSink &send) -> Status {
            std::signal(SIGCHLD, SIG_IGN);
            for (const int standard : {0, 1, 2})
                ::close(standard);
            std::string inner;
            Status nested = pbm::run_in_child(task(
                [](const ByteSink &up) -> Status {
                    std::cerr << "said on standard error\n";
                    up(view("from the grandchild"));
                    return {};
                },
                &inner));
            send(view(inner));
            return nested;
        },
        &received));
    EXPECT_TRUE(status.ok()) << (status.ok() ? "" : status.error().message);
    EXPECT_EQ(received, "from the grandchild");
}

TEST(ChildProcess, OtherThreadsOfTheCallerMayRunAndStartChildrenToo) {
#ifdef PBM_SANITIZED
    GTEST_SKIP() << "a sanitizer's malloc, unlike the system's, may be locked for ever in a child";
#endif
    std::array<int, 4> good{};
    std::vector<std::thread> threads;
    threads.reserve(good.size());
    for (int &count : good)
        threads.emplace_back([&count] {
            for (int i = 0; i < 10; ++i) {
                std::string received;
                const Status status = pbm::run_in_child(task(
                    [](const ByteSink &send) -> Status {
                        send(view(std::string(100'000, 'x')));
                        return {};
                    },
                    &received));
                count += status.ok() && received.size() == 100'000 ? 1 : 0;
            }
        });
    for (std::thread &thread : threads)
        thread.join();
    EXPECT_EQ(good, (std::array<int, 4>{10, 10, 10, 10}));
}

// Whether a process runs: it exists and is not a zombie.
bool runs(pid_t id) {
    std::ifstream stat("/proc/" + std::to_string(id) + "/stat");
    std::string text;
    std::getline(stat, text);
    const std::size_t name_end = text.rfind(") ");
    return name_end != std::string::npos && text[name_end + 2] != 'Z';
}

TEST(ChildProcess, ItEndsWithItsCaller) {
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    const pid_t caller = ::fork();
    ASSERT_GE(caller, 0);
    if (caller == 0) {
        ChildTask t = task([](const ByteSink &send) -> Status {
            const pid_t own = ::getpid();
            send({reinterpret_cast<const std::uint8_t *>(&own), sizeof own});
            while (true)
                ::pause();
        });
        t.receive = [&](ByteView bytes) -> Status {
            if (::write(ends[1], bytes.data(), bytes.size()) < 0)
                ::_exit(1);
            return {};
        };
        static_cast<void>(pbm::run_in_child(t));
        ::_exit(0);
    }
    pid_t child = 0;
    ASSERT_EQ(::read(ends[0], &child, sizeof child), static_cast<ssize_t>(sizeof child));
    EXPECT_TRUE(runs(child));
    ::kill(caller, SIGKILL);
    ::waitpid(caller, nullptr, 0);
    for (int i = 0; i < 2000 && runs(child); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_FALSE(runs(child));
    ::close(ends[0]);
    ::close(ends[1]);
}

} // namespace
