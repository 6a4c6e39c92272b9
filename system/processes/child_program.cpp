#include "system/processes/child_program.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace pbm {
namespace {

// What a program starts with: its standard streams, and default signal handlers.
class Start {
  public:
    Start(int input, int messages) {
        ::posix_spawn_file_actions_init(&actions_);
        ::posix_spawn_file_actions_adddup2(&actions_, input, STDIN_FILENO);
        ::posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
        ::posix_spawn_file_actions_adddup2(&actions_, messages, STDERR_FILENO);
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

} // namespace

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
    const Start start(read_end.number(), program.messages_.number());
    if (const int error = start.run(arguments, program.id_); error != 0) {
        program.id_ = -1;
        return Error{ErrorCode::memory, 0,
                     error == ENOENT ? program.name_ + " is not installed"
                                     : "cannot start " + program.name_ + ": " + std::generic_category().message(error)};
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
