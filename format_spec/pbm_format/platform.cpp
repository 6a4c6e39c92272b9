#include "pbm_format/platform.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <optional>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
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

Error io_error(const std::string &what, int number) {
    return {ErrorCode::io, 0, what + ": " + std::generic_category().message(number)};
}

std::string folder_of(const std::string &path) {
    const std::size_t slash = path.find_last_of('/');
    return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

// Closes at the end of a scope; `close()` early to see its error.
class Descriptor {
  public:
    explicit Descriptor(int number = -1) : number_(number) {}
    Descriptor(Descriptor &&other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor &operator=(Descriptor &&other) noexcept { return std::swap(number_, other.number_), *this; }
    Descriptor(const Descriptor &) = delete;
    Descriptor &operator=(const Descriptor &) = delete;
    ~Descriptor() { static_cast<void>(close()); }

    int number() const { return number_; }
    bool ok() const { return number_ >= 0; }
    int close() { return number_ < 0 ? 0 : ::close(std::exchange(number_, -1)); }

  private:
    int number_;
};

// 0, or errno.
int write_all(int file, ByteView bytes) {
    constexpr std::size_t kMostAtOnce = std::size_t{1} << 30;
    while (!bytes.empty()) {
        const ssize_t written = ::write(file, bytes.data(), std::min(bytes.size(), kMostAtOnce));
        if (written < 0 && errno == EINTR)
            continue;
        if (written <= 0)
            return written < 0 ? errno : ENOSPC;
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return 0;
}

} // namespace

Result<MappedFile> MappedFile::open(const std::string &path) {
    // O_NONBLOCK: a pipe without a writer is refused below instead of waited for.
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    if (!file.ok())
        return io_error("cannot open", errno);
    struct stat status {};
    if (::fstat(file.number(), &status) != 0)
        return io_error("cannot read", errno);
    if (S_ISDIR(status.st_mode))
        return Error{ErrorCode::io, 0, "cannot open: this is a folder"};
    if (!S_ISREG(status.st_mode))
        return Error{ErrorCode::io, 0, "cannot open: not a regular file"};
    const auto size = static_cast<std::size_t>(status.st_size);
    if (size == 0)
        return MappedFile(nullptr, 0);
    void *data = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file.number(), 0);
    if (data == MAP_FAILED)
        return io_error("cannot map", errno);
    return MappedFile(static_cast<const std::uint8_t *>(data), size);
}

bool is_stream(const std::string &path) {
    struct stat status {};
    return path == "-" || (::stat(path.c_str(), &status) == 0 &&
                           (S_ISFIFO(status.st_mode) || S_ISCHR(status.st_mode) || S_ISSOCK(status.st_mode)));
}

Result<MappedFile> MappedFile::read_stream(const std::string &path, std::uint64_t max_bytes) {
    constexpr std::size_t kFirst = std::size_t{1} << 20, kMostAtOnce = std::size_t{1} << 30;
    const Descriptor file(path == "-" ? ::dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file.ok())
        return io_error("cannot open", errno);
    if (::isatty(file.number()) == 1)
        return Error{ErrorCode::io, 0, "cannot read: this is a terminal; name a file, or send one through a pipe"};
    const auto too_long = [&] {
        return Error{ErrorCode::memory, 0,
                     "more than " + std::to_string(max_bytes >> 20) + " MiB from a stream; write it to a file first"};
    };
    std::size_t room = kFirst, size = 0;
    void *data = ::mmap(nullptr, room, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (data == MAP_FAILED)
        return Error{ErrorCode::memory, 0, "out of memory"};
    for (;;) {
        if (size == room) {
            void *const larger = ::mremap(data, room, 2 * room, MREMAP_MAYMOVE);
            if (larger == MAP_FAILED) {
                ::munmap(data, room);
                return Error{ErrorCode::memory, 0, "out of memory"};
            }
            data = larger;
            room *= 2;
        }
        const ssize_t got =
            ::read(file.number(), static_cast<std::uint8_t *>(data) + size, std::min(room - size, kMostAtOnce));
        if (got < 0 && errno == EINTR)
            continue;
        if (got > 0)
            size += static_cast<std::size_t>(got);
        if (got > 0 && size <= max_bytes)
            continue;
        const int error = got < 0 ? errno : 0;
        if (got == 0 && size > 0) {
            // Whole pages: what is beyond the last one goes back.
            const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
            const std::size_t kept = (size + page - 1) / page * page;
            if (kept < room)
                ::munmap(static_cast<std::uint8_t *>(data) + kept, room - kept);
            return MappedFile(static_cast<const std::uint8_t *>(data), size);
        }
        ::munmap(data, room);
        if (error != 0)
            return io_error("cannot read", error);
        return got == 0 ? Result<MappedFile>(MappedFile(nullptr, 0)) : Result<MappedFile>(too_long());
    }
}

MappedFile::MappedFile(MappedFile &&other) noexcept
    : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}

MappedFile &MappedFile::operator=(MappedFile &&other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
}

MappedFile::~MappedFile() {
    if (data_ != nullptr)
        ::munmap(const_cast<std::uint8_t *>(data_), size_);
}

Status check_replaceable(const std::string &path) {
    struct stat status {};
    if (::stat(path.c_str(), &status) == 0) {
        if (S_ISDIR(status.st_mode))
            return Error{ErrorCode::io, 0, "cannot write: this is a folder"};
        if (!S_ISREG(status.st_mode))
            return {};
    }
    const std::string folder = folder_of(path);
    if (::stat(folder.c_str(), &status) != 0)
        return io_error("cannot write into " + folder, errno);
    if (!S_ISDIR(status.st_mode))
        return io_error("cannot write into " + folder, ENOTDIR);
    if (::access(folder.c_str(), W_OK | X_OK) != 0)
        return io_error("cannot write into " + folder, errno);
    return {};
}

FileReplacement::FileReplacement(FileReplacement &&other) noexcept
    : file_(std::exchange(other.file_, -1)), target_(std::move(other.target_)),
      sibling_(std::exchange(other.sibling_, {})), mode_(other.mode_) {}

FileReplacement::~FileReplacement() {
    if (file_ >= 0)
        ::close(file_);
    if (!sibling_.empty())
        ::unlink(sibling_.c_str());
}

Result<FileReplacement> FileReplacement::begin(const std::string &path) {
    FileReplacement file;
    if (path == "-") {
        file.file_ = ::dup(STDOUT_FILENO);
        return file.file_ >= 0 ? Result<FileReplacement>(std::move(file)) : io_error("cannot write", errno);
    }
    if (Status status = check_replaceable(path); !status)
        return status.error();
    struct stat old {};
    const bool exists = ::stat(path.c_str(), &old) == 0;
    if (exists && !S_ISREG(old.st_mode)) {
        file.file_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
        return file.file_ >= 0 ? Result<FileReplacement>(std::move(file)) : io_error("cannot write", errno);
    }
    // A link is followed, so that the file it names is replaced and the link stays.
    file.target_ = path;
    if (exists) {
        if (char *resolved = ::realpath(path.c_str(), nullptr); resolved != nullptr) {
            file.target_ = resolved;
            std::free(resolved);
        }
    }
    std::string sibling = file.target_ + ".XXXXXX";
    file.file_ = ::mkostemp(sibling.data(), O_CLOEXEC);
    if (file.file_ < 0)
        return io_error("cannot write into " + folder_of(file.target_), errno);
    file.sibling_ = std::move(sibling);
    const mode_t mask = ::umask(0);
    ::umask(mask);
    file.mode_ = exists ? old.st_mode & 07777 : 0666 & ~mask;
    return file;
}

Status FileReplacement::write(ByteView bytes) {
    const int error = write_all(file_, bytes);
    return error == 0 ? Status() : io_error("cannot write", error);
}

Status FileReplacement::finish() {
    int error = 0;
    if (!sibling_.empty() && (::fchmod(file_, mode_) != 0 || ::fsync(file_) != 0))
        error = errno;
    if (::close(std::exchange(file_, -1)) != 0 && error == 0)
        error = errno;
    if (error == 0 && !sibling_.empty() && ::rename(sibling_.c_str(), target_.c_str()) != 0)
        error = errno;
    if (error != 0)
        return io_error("cannot write", error);
    if (sibling_.empty())
        return {};
    sibling_.clear();
    // The rename itself survives a power cut only when the folder reached the disk; some file systems cannot do it.
    const Descriptor folder(::open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (folder.ok())
        static_cast<void>(::fsync(folder.number()));
    return {};
}

Status replace_file(const std::string &path, ByteView bytes) {
    Result<FileReplacement> file = FileReplacement::begin(path);
    if (!file)
        return file.error();
    if (Status written = file->write(bytes); !written)
        return written;
    return file->finish();
}

void make_write_errors_returns() {
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

namespace {

// What the handler says; only async-signal-safe calls are allowed in it.
std::array<char, 160> shrink_message{};

extern "C" void report_shrunk_file(int) {
    const ssize_t written = ::write(STDERR_FILENO, shrink_message.data(), ::strlen(shrink_message.data()));
    ::_exit(written < 0 ? 2 : exit_code(ErrorCode::io));
}

} // namespace

void end_when_mapped_file_shrinks(std::string_view program) {
    std::snprintf(shrink_message.data(), shrink_message.size(),
                  "%.*s: the file became shorter while it was read; wait until it is written and try again\n",
                  static_cast<int>(std::min<std::size_t>(program.size(), 40)), program.data());
    struct sigaction action {};
    action.sa_handler = report_shrunk_file;
    ::sigemptyset(&action.sa_mask);
    ::sigaction(SIGBUS, &action, nullptr);
}

std::uint64_t peak_memory() {
    struct rusage usage {};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

namespace {

#ifdef PBM_SANITIZED
constexpr bool kSanitized = true; // shadow memory is address space, and crashes are the sanitizer's to report
#else
constexpr bool kSanitized = false;
#endif

using Clock = std::chrono::steady_clock;

struct Pipe {
    Descriptor read, write;
};

// The number of the write end is at least 10, where it is not in the way of those that the child gets.
Result<Pipe> make_pipe() {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
        return io_error("cannot make a pipe", errno);
    Pipe pipe{Descriptor(ends[0]), Descriptor(ends[1])};
    Descriptor high(::fcntl(ends[1], F_DUPFD_CLOEXEC, 10));
    if (!high.ok() || ::fcntl(ends[0], F_SETFL, O_NONBLOCK) != 0)
        return io_error("cannot make a pipe", errno);
    pipe.write = std::move(high);
    return pipe;
}

// How the child's work ended: one write that fits into a pipe.
struct Verdict {
    enum class Kind : std::uint8_t { done, error, no_memory, exception };
    Kind kind = Kind::done;
    ErrorCode code{};
    std::uint64_t offset = 0;
    std::array<char, 1000> text{}; // ends in a zero

    void say(std::string_view message) { message.copy(text.data(), text.size() - 1); }
};

constexpr int kData = 3, kVerdict = 4; // the child's descriptors, beside the standard three

// The bytes of address space that this process has mapped; nothing without /proc.
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
        ::_exit(1); // it ended before the line above
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
    std::atexit([] { ::_exit(1); }); // `exit` in the work: first of all handlers, and the caller's do not run
    ::prctl(PR_SET_DUMPABLE, 0);     // a core file limit of zero does not hold for a system that collects crashes
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

// A child that is killed and waited for at the latest at the end of a scope.
class Child {
  public:
    explicit Child(pid_t id) : id_(id) {}
    Child(const Child &) = delete;
    Child &operator=(const Child &) = delete;
    ~Child() { end(); }

    // Whether it has ended; never waits.
    bool ended() { return wait(WNOHANG); }
    void end() {
        if (!ended()) {
            ::kill(id_, SIGKILL);
            wait(0);
        }
    }
    // What waitpid said of it; zero where the caller ignores SIGCHLD, so that nobody knows.
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

// The first line of what the child printed, without what a terminal would obey.
std::string first_line(std::string_view text) {
    constexpr std::size_t kMost = 160;
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
    std::string line(text.substr(0, std::min(text.find_first_of("\r\n"), kMost)));
    for (char &c : line)
        c = c >= ' ' && c <= '~' ? c : '?';
    return line;
}

// Both ways that a child's bytes come.
class Conversation {
  public:
    Conversation(const ChildTask &task, Descriptor data, Descriptor messages)
        : task_(task), data_(std::move(data)), messages_(std::move(messages)), buffer_(std::size_t{1} << 18) {}

    // Until the child has ended or the time is up: then it is killed, and `out_of_time` true.
    Status follow(Child &child, int child_descriptor);

    bool out_of_time = false;
    std::string printed; // on standard error, its beginning

  private:
    // Reads what is there, but at most so many times: the deadline waits. False at the end of the pipe.
    template <class Use> bool drain(const Descriptor &from, int most_reads, Use &&use);
    Status read_some(int most_reads);

    const ChildTask &task_;
    Descriptor data_, messages_;
    std::vector<std::uint8_t> buffer_;
    Status received_;
};

template <class Use> bool Conversation::drain(const Descriptor &from, int most_reads, Use &&use) {
    for (int i = 0; from.ok() && i < most_reads; ++i) {
        const ssize_t count = ::read(from.number(), buffer_.data(), buffer_.size());
        if (count > 0)
            use(ByteView(buffer_.data(), static_cast<std::size_t>(count)));
        else if (count == 0 || errno != EINTR)
            return count < 0;
    }
    return from.ok();
}

Status Conversation::read_some(int most_reads) {
    const auto receive = [this](ByteView bytes) {
        if (received_)
            received_ = task_.receive(bytes);
    };
    constexpr std::size_t kMostPrinted = 4096;
    const auto note = [this](ByteView bytes) {
        const std::size_t count = std::min(bytes.size(), kMostPrinted - printed.size());
        printed.append(reinterpret_cast<const char *>(bytes.data()), count);
    };
    if (!drain(data_, most_reads, receive))
        static_cast<void>(data_.close());
    if (!drain(messages_, most_reads, note))
        static_cast<void>(messages_.close());
    return received_;
}

Status Conversation::follow(Child &child, int child_descriptor) {
    const Clock::time_point deadline = Clock::now() + std::chrono::seconds(task_.limits.wall_seconds);
    while (true) {
        // In this order: what it sent before its end is read after its end is known. The ends of the pipes tell
        // nothing, since another thread's child may have inherited them.
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
        constexpr int kTick = 10, kMostWaited = 60'000;
        std::array<struct pollfd, 3> events{};
        events[0] = {data_.number(), POLLIN, 0}; // negative numbers are passed over
        events[1] = {messages_.number(), POLLIN, 0};
        events[2] = {child_descriptor, POLLIN, 0};
        const auto wait = static_cast<int>(std::min<decltype(left)>(left, child_descriptor >= 0 ? kMostWaited : kTick));
        static_cast<void>(::poll(events.data(), events.size(), wait));
    }
}

// What became of a child that has ended.
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
            return failed(ErrorCode::memory, "ran out of memory, of which it may take " +
                                                 std::to_string(task.limits.memory >> 20) + " MB");
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
                      "was ended from outside (signal " + std::to_string(signal) + "), most likely for want of memory");
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
    ::fcntl(data->write.number(), F_SETPIPE_SZ, 1 << 20); // fewer turns; the smaller default will do
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
        static_cast<int>(::syscall(SYS_pidfd_open, id, 0))); // from Linux 5.3 on, and where it is allowed
    for (Result<Pipe> *pipe : {&data, &messages, &verdict})
        static_cast<void>((*pipe)->write.close());
    if (Status status = talk.follow(child, child_descriptor.number()); !status)
        return status;
    return judge(task, child, talk, read_verdict(verdict->read));
}

} // namespace pbm
