#include "memory_limit.h"

#include "command_line/command_line.h"
#include "command_line/error_log.h"
#include "pbm_batch/memory_estimate.h"
#include "pbm_scan/text/printable.h"
#include "system/processes/paged_heap.h"
#include "system/processes/usable_memory.h"

#include <cstdlib>
#include <filesystem>
#include <iostream>

namespace pbm::build {
namespace {

namespace fs = std::filesystem;

std::string temporary_folder(const Arguments &arguments) {
    if (!arguments.temp_folder.empty())
        return arguments.temp_folder;
    const char *const given = std::getenv("TMPDIR");
    return given != nullptr && *given != '\0' ? given : "/var/tmp";
}

std::string amount_of(std::uint64_t bytes) {
    const auto amount = static_cast<double>(bytes);
    return bytes < 1'000'000'000 ? formatted("%.0f MB", amount * 1e-6) : formatted("%.1f GB", amount * 1e-9);
}

void announce(std::string_view program, const std::string &folder, std::uint64_t need, std::uint64_t limit) {
    std::error_code error;
    const std::uint64_t room = fs::space(folder, error).available;
    std::string text = "this build may need " + amount_of(need) + "; what is beyond " + amount_of(limit) +
                       " lies in temporary files in " + folder;
    if (!error)
        text += ", which has room for " + amount_of(room);
    if (!error && room < need - limit)
        text += ": another folder can be named by --temp-dir";
    std::cerr << program << ": note: " << command_line::printable(text) << '\n';
}

} // namespace

std::optional<int> limit_memory(std::string_view program, const Arguments &arguments) {
    const bool is_asked_for = arguments.max_memory != 0;
    const std::uint64_t limit = is_asked_for ? arguments.max_memory : usable_memory() / 4;
    const std::string folder = temporary_folder(arguments);
    if (const Status paged = page_heap(folder, limit); !paged)
        return is_asked_for || !arguments.temp_folder.empty()
                   ? std::optional(command_line::fail(program, "--temp-dir " + folder, paged.error()))
                   : std::nullopt;
    const std::uint64_t need = batch::likely_need(arguments.inputs);
    if (need > limit && arguments.verbosity >= command_line::Verbosity::normal)
        announce(program, folder, need, limit);
    return std::nullopt;
}

} // namespace pbm::build
