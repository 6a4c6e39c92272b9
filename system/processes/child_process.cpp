#include "system/processes/child_process.h"

#include "system/files/descriptor.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define PBM_SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PBM_SANITIZED 1
#endif

namespace pbm {

namespace {

#ifdef PBM_SANITIZED
constexpr bool kSanitized = true; // shadow memory is address space, and the sanitizer must report crashes
#else
constexpr bool kSanitized = false;
#endif

using Clock = std::chrono::steady_clock;

struct Pipe {
    Descriptor read, write;
};

// The write end has a number of at least 10, so that it does not collide with the child's descriptors.
Result<Pipe> make_pipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
        return io_error("cannot make a pipe", errno);
    Pipe pipe{Descriptor(ends[0]), Descriptor(ends[1])};
    Descriptor high(::fcntl(ends[1], F_DUPFD_CLOEXEC, 10));
    if (!high.ok() && errno == EINVAL)
        return io_error("cannot make a pipe", EMFILE); // the limit of open files is below 10
    if (!high.ok() || ::fcntl(ends[0], F_SETFL, O_NONBLOCK) != 0)
        return io_error("cannot make a pipe", errno);
    pipe.write = std::move(high);
    return pipe;
}

// The outcome of the child's work; small enough for one write into a pipe.
struct Verdict {
    enum class Kind : std::uint8_t { done, error, no_memory, exception };
    Kind kind = Kind::done;
    ErrorCode code{};
    std::uint64_t offset = 0;
    std::array<char, 1000> text{}; // zero-terminated

    void say(std::string_view message) { message.copy(text.data(), text.size() - 1); }
};

constexpr int kData = 3, kVerdict = 4; // the child's descriptors, beside the standard three

// Bytes of address space that this process has mapped; absent without /proc.
std::optional<std::uint64_t> mapped_memory() {
    const Descriptor file(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
    std::array<char, 64> text{};
    if (!file.ok() || ::read(file.number(), text.data(), text.size() - 1) <= 0)
        return std::nullopt;
    return std::strtoull(text.data(), nullptr, 10) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void lower_limit(decltype(RLIMIT_AS) resource, rlim_t soft, rlim_t hard) {
    struct rlimit limit {};
    if (::getrlimit(resource, &limit) != 0)
        return;
    limit.rlim_max = std::min(limit.rlim_max, hard);
    limit.rlim_cur = std::min({limit.rlim_cur, soft, limit.rlim_max});
    ::setrlimit(resource, &limit);
}

void enter_child(const ChildLimits &limits, pid_t caller, int data, int messages, int verdict) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != caller)
        ::_exit(1); // the caller ended before prctl
    const int nothing = ::open("/dev/null", O_RDWR);
    if (nothing < 0 || ::dup2(nothing, STDIN_FILENO) < 0 || ::dup2(nothing, STDOUT_FILENO) < 0 ||
        ::dup2(messages, STDERR_FILENO) < 0 || ::dup2(data, kData) < 0 || ::dup2(verdict, kVerdict) < 0)
        ::_exit(1);
    ::close_range(kVerdict + 1, ~0U, 0);
    for (const int signal : {SIGPIPE, SIGXCPU, SIGXFSZ, SIGBUS, SIGTERM, SIGINT, SIGHUP, SIGALRM})
        std::signal(signal, SIG_DFL);
    if (!kSanitized)
        for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGTRAP})
            std::signal(signal, SIG_DFL);
    sigset_t none;
    ::sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    lower_limit(RLIMIT_CORE, 0, 0);
    lower_limit(RLIMIT_CPU, limits.cpu_seconds, limits.cpu_seconds + 1);
    if (const std::optional<std::uint64_t> mapped = mapped_memory(); mapped && !kSanitized)
        lower_limit(RLIMIT_AS, *mapped + limits.memory, RLIM_INFINITY);
    std::atexit([] { ::_exit(1); }); // `exit` in `work`: this handler runs first, and the caller's do not run
    ::prctl(PR_SET_DUMPABLE, 0);     // crash collectors ignore a core file limit of zero
}

[[noreturn]] void be_child(const ChildTask &task) {
    Verdict verdict;
    const ByteSink send = [](ByteView bytes) {
        if (write_all(kData, bytes) != 0)
            ::_exit(1);
    };
    try {
        if (const Status status = task.work(send); !status) {
            verdict.kind = Verdict::Kind::error;
            verdict.code = status.error().code;
            verdict.offset = status.error().offset;
            verdict.say(status.error().message);
        }
    } catch (const std::bad_alloc &) {
        verdict.kind = Verdict::Kind::no_memory;
    } catch (const std::exception &e) {
        verdict.kind = Verdict::Kind::exception;
        verdict.say(e.what());
    } catch (...) {
        verdict.kind = Verdict::Kind::exception;
        verdict.say("unknown exception");
    }
    ::_exit(write_all(kVerdict, {reinterpret_cast<const std::uint8_t *>(&verdict), sizeof verdict}) == 0 ? 0 : 1);
}

// A child process; it is killed, if necessary, and waited for at the end of the scope.
class Child {
  public:
    explicit Child(pid_t id) : id_(id) {}
    Child(const Child &) = delete;
    Child &operator=(const Child &) = delete;
    ~Child() { end(); }

    // Whether it has ended. Does not wait.
    bool ended() { return wait(WNOHANG); }
    void end() {
        if (!ended()) {
            ::kill(id_, SIGKILL);
            wait(0);
        }
    }
    // Status from waitpid; zero, which is unknown, if the caller ignores SIGCHLD.
    int status() const { return status_; }
    double cpu_seconds() const {
        const auto seconds = [](const struct timeval &t) {
            return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
        };
        return seconds(usage_.ru_utime) + seconds(usage_.ru_stime);
    }

  private:
    bool wait(int options) {
        while (!ended_) {
            const pid_t found = ::wait4(id_, &status_, options, &usage_);
            if (found == 0)
                return false;
            ended_ = found == id_ || errno != EINTR;
        }
        return true;
    }

    pid_t id_;
    bool ended_ = false;
    int status_ = 0;
    struct rusage usage_ {};
};

// The first line of the child's output; replaces bytes that are not printable ASCII.
std::string first_line(std::string_view text) {
    constexpr std::size_t kMax = 160;
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    std::string line(text.substr(0, std::min(text.find_first_of("\r\n"), kMax)));
    for (char &c : line)
        c = c >= ' ' && c <= '~' ? c : '?';
    return line;
}

// Receives the child's data and messages.
class Conversation {
  public:
    Conversation(const ChildTask &task, Descriptor data, Descriptor messages)
        : task_(task), data_(std::move(data)), messages_(std::move(messages)), buffer_(std::size_t{1} << 18) {}

    // Receives until the child has ended. Kills it when the time is up, and sets `out_of_time`.
    Status follow(Child &child, int child_descriptor);

    bool out_of_time = false;
    std::string printed; // start of its standard error

  private:
    // Reads what is available, at most `max_reads` times, so that the deadline is met. False at the end of the pipe.
    template <class Use> bool drain(const Descriptor &from, int max_reads, Use &&use);
    Status read_some(int max_reads);

    const ChildTask &task_;
    Descriptor data_, messages_;
    std::vector<std::uint8_t> buffer_;
    Status received_;
};

template <class Use> bool Conversation::drain(const Descriptor &from, int max_reads, Use &&use) {
    for (int i = 0; from.ok() && i < max_reads; ++i) {
        const ssize_t count = ::read(from.number(), buffer_.data(), buffer_.size());
        if (count > 0)
            use(ByteView(buffer_.data(), static_cast<std::size_t>(count)));
        else if (count == 0 || errno != EINTR)
            return count < 0;
    }
    return from.ok();
}

Status Conversation::read_some(int max_reads) {
    const auto receive = [this](ByteView bytes) {
        if (received_)
            received_ = task_.receive(bytes);
    };
    constexpr std::size_t kMaxPrinted = 4096;
    const auto note = [this](ByteView bytes) {
        const std::size_t count = std::min(bytes.size(), kMaxPrinted - printed.size());
        printed.append(reinterpret_cast<const char *>(bytes.data()), count);
    };
    if (!drain(data_, max_reads, receive))
        static_cast<void>(data_.close());
    if (!drain(messages_, max_reads, note))
        static_cast<void>(messages_.close());
    return received_;
}

Status Conversation::follow(Child &child, int child_descriptor) {
    const Clock::time_point deadline = Clock::now() + std::chrono::seconds(task_.limits.wall_seconds);
    while (true) {
        // Check for the end first, then read: all data sent before the end are read. End-of-file on the pipes is no
        // sign of the end, since another thread's child may have inherited them.
        const bool ended = child.ended();
        constexpr int kSome = 8, kAll = std::numeric_limits<int>::max();
        if (Status status = read_some(ended ? kAll : kSome); !status || ended)
            return status;
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
        if (left <= 0) {
            out_of_time = true;
            child.end();
            continue;
        }
        constexpr int kTick = 10, kMaxWaited = 60'000;
        std::array<struct pollfd, 3> events{};
        events[0] = {data_.number(), POLLIN, 0}; // poll ignores negative descriptors
        events[1] = {messages_.number(), POLLIN, 0};
        events[2] = {child_descriptor, POLLIN, 0};
        const auto wait = static_cast<int>(std::min<decltype(left)>(left, child_descriptor >= 0 ? kMaxWaited : kTick));
        static_cast<void>(::poll(events.data(), events.size(), wait));
    }
}

// The result of a child that has ended.
Status judge(const ChildTask &task, const Child &child, const Conversation &talk,
             const std::optional<Verdict> &verdict) {
    const std::string printed = first_line(talk.printed);
    const std::string tail = (printed.empty() ? "" : " (" + printed + ")") + "; " + task.advice;
    const auto failed = [&](ErrorCode code, const std::string &how) {
        return Error{code, 0, task.name + " " + how + tail};
    };
    if (verdict) {
        switch (verdict->kind) {
        case Verdict::Kind::done: return {};
        case Verdict::Kind::error: return Error{verdict->code, verdict->offset, verdict->text.data()};
        case Verdict::Kind::no_memory:
            return failed(ErrorCode::memory,
                          "exceeded its memory limit of " + std::to_string(task.limits.memory >> 20) + " MB");
        case Verdict::Kind::exception:
            return failed(ErrorCode::bad_input, "failed: " + first_line(verdict->text.data()));
        }
    }
    const int signal = WIFSIGNALED(child.status()) ? WTERMSIG(child.status()) : 0;
    const bool used_up = child.cpu_seconds() >= task.limits.cpu_seconds;
    if (talk.out_of_time)
        return failed(ErrorCode::memory,
                      "was stopped: not done after " + std::to_string(task.limits.wall_seconds) + " s");
    if (signal == SIGXCPU || (signal == SIGKILL && used_up))
        return failed(ErrorCode::memory,
                      "was stopped: not done after " + std::to_string(task.limits.cpu_seconds) + " s of computing");
    if (signal == SIGKILL || signal == SIGTERM || signal == SIGINT || signal == SIGHUP)
        return failed(ErrorCode::memory,
                      "was killed (signal " + std::to_string(signal) + "), probably because memory ran out");
    if (signal != 0)
        return failed(ErrorCode::bad_input, "crashed (signal " + std::to_string(signal) + ")");
    return failed(ErrorCode::bad_input, "ended early (exit code " + std::to_string(WEXITSTATUS(child.status())) + ")");
}

std::optional<Verdict> read_verdict(const Descriptor &from) {
    Verdict verdict;
    ssize_t count = 0;
    do
        count = ::read(from.number(), &verdict, sizeof verdict);
    while (count < 0 && errno == EINTR);
    verdict.text.back() = '\0';
    return count == static_cast<ssize_t>(sizeof verdict) ? std::optional(verdict) : std::nullopt;
}

} // namespace

Status run_in_child(const ChildTask &task) {
    Result<Pipe> data = make_pipe(), messages = make_pipe(), verdict = make_pipe();
    for (const Result<Pipe> *pipe : {&data, &messages, &verdict})
        if (!*pipe)
            return pipe->error();
    ::fcntl(data->write.number(), F_SETPIPE_SZ, 1 << 20); // for speed; the smaller default also works
    Conversation talk(task, std::move(data->read), std::move(messages->read));
    const pid_t caller = ::getpid();
    const pid_t id = ::fork();
    if (id < 0)
        return Error{ErrorCode::memory, 0,
                     "cannot start a process for " + task.name + ": " + std::generic_category().message(errno)};
    if (id == 0) {
        enter_child(task.limits, caller, data->write.number(), messages->write.number(), verdict->write.number());
        be_child(task);
    }
    Child child(id);
    const Descriptor child_descriptor(
        static_cast<int>(::syscall(SYS_pidfd_open, id, 0))); // needs Linux 5.3, and may be forbidden
    for (Result<Pipe> *pipe : {&data, &messages, &verdict})
        static_cast<void>((*pipe)->write.close());
    if (Status status = talk.follow(child, child_descriptor.number()); !status)
        return status;
    return judge(task, child, talk, read_verdict(verdict->read));
}

} // namespace pbm
