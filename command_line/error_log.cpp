#include "command_line/error_log.h"

#include "command_line/command_line.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <ctime>
#include <mutex>
#include <system_error>

#include <fcntl.h>

namespace pbm::command_line {
namespace {

struct Log {
    std::mutex mutex;
    std::string program, path;
    std::FILE *file = nullptr; // open until the process ends
    int error = 0;             // errno of the first line that was lost
};

Log &the_log() {
    static Log log;
    return log;
}

std::string name_of(LogKind kind) { return std::array{"error", "warning", "progress"}[static_cast<std::size_t>(kind)]; }

std::string time_stamp() {
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    ::gmtime_r(&now, &utc);
    std::array<char, 32> text{};
    std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc);
    return text.data();
}

} // namespace

Status open_log(std::string_view program, const std::string &path) {
    Log &log = the_log();
    // Without O_NONBLOCK, opening a pipe waits for somebody who reads it.
    const int file = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK, 0666);
    if (file >= 0)
        ::fcntl(file, F_SETFL, O_APPEND);
    log.file = file < 0 ? nullptr : ::fdopen(file, "a");
    if (log.file == nullptr)
        return Error{ErrorCode::io, 0,
                     "cannot open the log: " + (errno == ENXIO ? std::string("nobody reads this pipe")
                                                               : std::generic_category().message(errno))};
    std::setvbuf(log.file, nullptr, _IOFBF, std::size_t{1} << 16); // one write per line
    log.program = program;
    log.path = path;
    return {};
}

const std::string &log_path() { return the_log().path; }

void log_line(LogKind kind, std::string_view text) {
    Log &log = the_log();
    if (log.file == nullptr)
        return;
    const std::string line = time_stamp() + " " + log.program + ": " + name_of(kind) + ": " + printable(text) + "\n";
    const std::lock_guard lock(log.mutex);
    if ((std::fwrite(line.data(), 1, line.size(), log.file) != line.size() || std::fflush(log.file) != 0) &&
        log.error == 0)
        log.error = errno;
}

Status log_status() {
    if (const int error = the_log().error; error != 0)
        return Error{ErrorCode::io, 0, "cannot write the log: " + std::generic_category().message(error)};
    return {};
}

} // namespace pbm::command_line
