#include "command_line/error_log.h"

#include "command_line/command_line.h"
#include "system/files/descriptor.h"

#include <array>
#include <cerrno>
#include <ctime>
#include <mutex>

namespace pbm::command_line {
namespace {

struct Log {
    std::mutex mutex;
    std::string program, path;
    Descriptor file; // open until the process ends
    int error = 0;   // errno of the first line that was lost
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
    log.file = open_to_append(path);
    if (errno == ENXIO && !log.file.ok())
        return Error{ErrorCode::io, 0, "cannot open the log: nobody reads this pipe"};
    if (!log.file.ok())
        return io_error("cannot open the log", errno);
    log.program = program;
    log.path = path;
    return {};
}

const std::string &log_path() { return the_log().path; }

void log_line(LogKind kind, std::string_view text) {
    Log &log = the_log();
    if (!log.file.ok())
        return;
    const std::string line = time_stamp() + " " + log.program + ": " + name_of(kind) + ": " + printable(text) + "\n";
    const std::lock_guard lock(log.mutex);
    if (const int error = write_all(log.file.number(), as_bytes(line)); error != 0 && log.error == 0)
        log.error = error;
}

Status log_status() {
    if (const int error = the_log().error; error != 0)
        return io_error("cannot write the log", error);
    return {};
}

} // namespace pbm::command_line
