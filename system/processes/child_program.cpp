#include "system/processes/child_program.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace pbm {
namespace {

constexpr int kNothing = -1; // /dev/null
constexpr std::size_t kMaxLine = 64 << 10, kMaxMessage = 4 << 10;

// What a program starts with: its standard streams, and default signal handlers.
class Start {
  public:
    Start(int input, int output, int messages) {
        ::posix_spawn_file_actions_init(&actions_);
        set_stream(STDIN_FILENO, input, O_RDONLY);
        set_stream(STDOUT_FILENO, output, O_WRONLY);
        set_stream(STDERR_FILENO, messages, O_WRONLY);
        ::posix_spawnattr_init(&attributes_);
        sigset_t ignored;
        ::sigemptyset(&ignored);
        ::sigaddset(&ignored, SIGPIPE); // ignored by this process, and ignored signals are inherited
        ::sigaddset(&ignored, SIGXFSZ);
        ::posix_spawnattr_setsigdefault(&attributes_, &ignored);
        ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGDEF);
    }
    Start(const Start &) = delete;
    Start &operator=(const Start &) = delete;
    ~Start() {
        ::posix_spawnattr_destroy(&attributes_);
        ::posix_spawn_file_actions_destroy(&actions_);
    }

    // 0, or errno.
    int run(const std::vector<std::string> &arguments, pid_t &id) const {
        std::vector<char *> words;
        words.reserve(arguments.size() + 1);
        for (const std::string &argument : arguments)
            words.push_back(const_cast<char *>(argument.c_str())); // not modified: POSIX lacks a const type
        words.push_back(nullptr);
        return ::posix_spawnp(&id, words.front(), &actions_, &attributes_, words.data(), environ);
    }

  private:
    void set_stream(int stream, int file, int mode) {
        if (file == kNothing)
            ::posix_spawn_file_actions_addopen(&actions_, stream, "/dev/null", mode, 0);
        else
            ::posix_spawn_file_actions_adddup2(&actions_, file, stream);
    }

    posix_spawn_file_actions_t actions_{};
    posix_spawnattr_t attributes_{};
};

// The first line of the output; replaces bytes that are not printable ASCII.
std::string first_line(const Descriptor &file) {
    std::array<char, 200> text{};
    const ssize_t size = ::pread(file.number(), text.data(), text.size(), 0);
    std::string line(text.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    line.erase(std::min(line.find_first_of("\r\n"), line.size()));
    for (char &c : line)
        c = c >= ' ' && c <= '~' ? c : '?';
    return line;
}

// The last line of the output that is not empty.
std::string last_line(const Descriptor &file) {
    const off_t size = ::lseek(file.number(), 0, SEEK_END);
    std::array<char, kMaxMessage> text{};
    const off_t from = std::max<off_t>(0, size - static_cast<off_t>(text.size()));
    const ssize_t count = ::pread(file.number(), text.data(), text.size(), from);
    std::string line(text.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    line.erase(line.find_last_not_of("\r\n") + 1);
    return line.substr(line.find_last_of("\r\n") + 1);
}

Error cannot_start(const std::string &name, int number) {
    return {ErrorCode::memory, 0,
            number == ENOENT ? name + " is not installed"
                             : "cannot start " + name + ": " + std::generic_category().message(number)};
}

// Calls `line` for each line until the end of the stream.
void read_lines(int file, const std::function<void(std::string_view)> &line) {
    std::array<char, 4096> buffer{};
    std::string text;
    for (;;) {
        const ssize_t count = ::read(file, buffer.data(), buffer.size());
        if (count < 0 && errno == EINTR)
            continue;
        if (count <= 0)
            break;
        for (const char c : std::string_view(buffer.data(), static_cast<std::size_t>(count))) {
            if (c == '\n')
                line(std::exchange(text, {}));
            else if (text.size() < kMaxLine)
                text += c;
        }
    }
    if (!text.empty())
        line(text);
}

bool is_program(const std::filesystem::path &file) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    constexpr fs::perms kExecutable = fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec;
    return fs::is_regular_file(file, ignored) &&
           (fs::status(file, ignored).permissions() & kExecutable) != fs::perms::none;
}

} // namespace

std::string find_program(std::string_view name) {
    std::error_code ignored;
    std::vector<std::filesystem::path> folders{std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path()};
    const char *const path = std::getenv("PATH");
    std::istringstream names(path == nullptr ? "" : path);
    for (std::string folder; std::getline(names, folder, ':');)
        folders.emplace_back(folder.empty() ? "." : folder);
    for (const std::filesystem::path &folder : folders)
        if (is_program(folder / name))
            return (folder / name).string();
    return {};
}

Result<ProgramEnd> run_program(const std::vector<std::string> &arguments,
                               const std::function<void(std::string_view)> &line, const std::stop_token &stop) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
        return io_error("cannot make a pipe", errno);
    const Descriptor output(ends[0]);
    Descriptor write_end(ends[1]);
    const Descriptor messages(::memfd_create("messages", MFD_CLOEXEC));
    if (!messages.ok())
        return io_error("cannot start " + arguments.front(), errno);
    pid_t id = -1;
    if (const int error = Start(kNothing, write_end.number(), messages.number()).run(arguments, id); error != 0)
        return cannot_start(arguments.front(), error);
    static_cast<void>(write_end.close());
    siginfo_t ended{};
    {
        const std::stop_callback kill_it(stop, [id] { ::kill(id, SIGKILL); });
        read_lines(output.number(), line);
        // Leave the process unreaped, so that a stop request cannot kill another one that got its number.
        while (::waitid(P_PID, static_cast<id_t>(id), &ended, WEXITED | WNOWAIT) < 0 && errno == EINTR) {
        }
    }
    int status = 0;
    while (::waitpid(id, &status, 0) < 0 && errno == EINTR) {
    }
    return ProgramEnd{WIFEXITED(status) ? WEXITSTATUS(status) : -1, last_line(messages)};
}

Result<ChildProgram> ChildProgram::start(const std::vector<std::string> &arguments) {
    ChildProgram program;
    program.name_ = arguments.front();
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
        return io_error("cannot make a pipe", errno);
    const Descriptor read_end(ends[0]);
    program.input_ = Descriptor(ends[1]);
    ::fcntl(ends[1], F_SETPIPE_SZ, 1 << 20); // for speed; the smaller default also works
    program.messages_ = Descriptor(::memfd_create("messages", MFD_CLOEXEC));
    if (!program.messages_.ok())
        return io_error("cannot start " + program.name_, errno);
    const Start start(read_end.number(), kNothing, program.messages_.number());
    if (const int error = start.run(arguments, program.id_); error != 0) {
        program.id_ = -1;
        return cannot_start(program.name_, error);
    }
    return program;
}

Status ChildProgram::write(ByteView bytes) {
    if (write_all(input_.number(), bytes) == 0)
        return {};
    const Status ended = finish();
    return ended ? Error{ErrorCode::memory, 0, name_ + " ended before it had all of its input"} : ended;
}

Status ChildProgram::finish() {
    static_cast<void>(input_.close());
    const int status = wait();
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
        return {};
    const std::string printed = first_line(messages_);
    return Error{ErrorCode::memory, 0,
                 name_ +
                     (WIFSIGNALED(status) ? " was ended by signal " + std::to_string(WTERMSIG(status))
                                          : " failed with exit code " + std::to_string(WEXITSTATUS(status))) +
                     (printed.empty() ? "" : ": " + printed)};
}

int ChildProgram::wait() {
    int status = 0;
    while (id_ > 0 && ::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
    }
    id_ = -1;
    return status;
}

ChildProgram::ChildProgram(ChildProgram &&other) noexcept
    : name_(std::move(other.name_)), input_(std::move(other.input_)), messages_(std::move(other.messages_)),
      id_(std::exchange(other.id_, -1)) {}

ChildProgram::~ChildProgram() {
    if (id_ > 0) {
        ::kill(id_, SIGKILL);
        wait();
    }
}

} // namespace pbm
