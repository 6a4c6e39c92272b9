#include "batch_plan.h"

#include "command_line/command_line.h"
#include "depfile.h"
#include "pbm_batch/memory_estimate.h"
#include "pbm_scan/text/printable.h"
#include "system/files/file_names.h"

#include <algorithm>
#include <filesystem>

namespace pbm::build {
namespace {

namespace fs = std::filesystem;

// A word as a shell reads it.
std::string shell_word(const std::string &word) {
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_@%+=:,./-";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos)
        return word;
    std::string quoted = "'";
    for (const char c : word)
        quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

// A path in a line of Ninja.
std::string ninja_path(const std::string &path) {
    std::string escaped;
    for (const char c : path) {
        if (c == '$' || c == ' ' || c == ':')
            escaped += '$';
        escaped += c;
    }
    return escaped;
}

std::string ninja_value(const std::string &text) {
    std::string escaped;
    for (const char c : text)
        escaped += c == '$' ? std::string("$$") : std::string(1, c);
    return escaped;
}

// This program and the options that all its builds get.
std::string command_of(const Arguments &arguments) {
    std::error_code error;
    const fs::path self = fs::read_symlink("/proc/self/exe", error);
    std::string command = shell_word(error ? "pbm-build" : self.string());
    for (const std::string &word : arguments.forwarded)
        if (word != "--if-changed=true")
            command += " " + shell_word(word);
    return command + " --if-changed";
}

std::string ninja_plan(const Arguments &arguments, std::span<const batch::Scan> scans) {
    std::string text = "# Builds " + counted(scans.size(), "scan") +
                       " of pbm-build --batch; run it in the folder in which it was made:\n"
                       "#   ninja -f " +
                       arguments.plan +
                       "\n"
                       "ninja_required_version = 1.5\n\n"
                       "rule model\n"
                       "  command = " +
                       ninja_value(command_of(arguments)) +
                       " --warnings --threads=1 --dependency-file $out.d --output $out -- $in\n"
                       "  description = $in\n"
                       "  depfile = $out.d\n"
                       "  deps = gcc\n"
                       "  restat = 1\n\n";
    for (const batch::Scan &scan : scans)
        text += "build " + ninja_path(scan.output) + ": model " + ninja_path(scan.input) + "\n";
    return text;
}

std::string slurm_plan(const Arguments &arguments, std::span<const batch::Scan> scans) {
    const batch::MemoryEstimate estimate;
    std::uint64_t most = 0;
    for (const batch::Scan &scan : scans)
        most = std::max(most, estimate.of(scan.input, scan.bytes));
    const std::size_t tasks = std::min(scans.size(), kMaxTasks);
    const std::string folder = fs::absolute(arguments.output_folder).lexically_normal().string();
    std::string text = "#!/bin/bash\n"
                       "# Builds " +
                       counted(scans.size(), "scan") +
                       " of pbm-build --batch:\n"
                       "#   sbatch " +
                       shell_word(arguments.plan) +
                       "\n"
                       "# What sbatch is told overrules these lines.\n"
                       "#SBATCH --job-name=pbm-build\n"
                       "#SBATCH --array=0-" +
                       std::to_string(tasks - 1) +
                       "\n"
                       "#SBATCH --cpus-per-task=1\n"
                       "#SBATCH --mem=" +
                       std::to_string((most >> 20) + 1) +
                       "M\n"
                       "#SBATCH --requeue\n"
                       "#SBATCH --open-mode=append\n"
                       "#SBATCH --output=" +
                       folder +
                       "/slurm-%a.log\n\n"
                       "cd " +
                       shell_word(fs::current_path().string()) +
                       " || exit 2\n"
                       "exec " +
                       command_of(arguments) + " --batch " + shell_word(arguments.batch) + " --output-dir " +
                       shell_word(arguments.output_folder) +
                       " --keep-going --warnings \\\n"
                       "    --shard \"$SLURM_ARRAY_TASK_ID/" +
                       std::to_string(tasks) +
                       "\" --threads \"${SLURM_CPUS_PER_TASK:-1}\" \\\n"
                       "    --json=" +
                       shell_word(arguments.output_folder) + "/\"shard-$SLURM_ARRAY_TASK_ID.jsonl\"\n";
    return text;
}

} // namespace

int write_plan(std::string_view program, const Arguments &arguments, std::span<const batch::Scan> scans) {
    const bool is_ninja = lower_extension(arguments.plan) == ".ninja";
    if (scans.empty() || is_stream(arguments.batch) || arguments.shard.count != 1)
        return command_line::fail_usage(program, "a plan is of a whole list or folder, not of a stream or a shard");
    for (const batch::Scan &scan : scans)
        for (const std::string &name : {scan.input, scan.output})
            if (const Status writable = check_depfile_name(name); is_ninja && !writable)
                return command_line::fail(program, name, writable.error());
    std::error_code error;
    fs::create_directories(arguments.output_folder, error); // where Slurm writes logs
    const Status written = command_line::write_text(arguments.plan, is_ninja ? ninja_plan(arguments, scans)
                                                                             : slurm_plan(arguments, scans));
    return written ? 0 : command_line::fail(program, command_line::output_name(arguments.plan), written.error());
}

} // namespace pbm::build
