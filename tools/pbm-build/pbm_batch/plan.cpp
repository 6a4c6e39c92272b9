#include "pbm_batch/plan.h"

#include "command_line/command_line.h"
#include "pbm_batch/memory_estimate.h"
#include "pbm_build/parts/part_file.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "sources/depfile.h"
#include "system/files/file_names.h"
#include "system/files/mapped_file.h"

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

// This program.
std::string self() {
    std::error_code error;
    const fs::path self = fs::read_symlink("/proc/self/exe", error);
    return shell_word(error ? "pbm-build" : self.string());
}

// It and the options that all its builds get.
std::string command_of(const Arguments &arguments) {
    std::string command = self();
    for (const std::string &word : arguments.forwarded)
        if (word != "--if-changed=true")
            command += " " + shell_word(word);
    return command;
}

std::string ninja_head(const Arguments &arguments, const std::string &what) {
    return "# Builds " + what + "; run it in the folder in which it was made:\n#   ninja -f " +
           shell_word(arguments.plan) + "\nninja_required_version = 1.5\n\n";
}

// The first lines of a script, up to its last option for sbatch. `how` starts it.
std::string slurm_head(const std::string &what, const std::string &how, const std::vector<std::string> &options) {
    std::string text = "#!/bin/bash\n# Builds " + what + ":\n#   " + how +
                       "\n# What sbatch is told overrules these lines.\n"
                       "#SBATCH --job-name=pbm-build\n"
                       "#SBATCH --cpus-per-task=1\n"
                       "#SBATCH --requeue\n"
                       "#SBATCH --open-mode=append\n";
    for (const std::string &option : options)
        text += "#SBATCH " + option + "\n";
    return text + "\ncd " + shell_word(fs::current_path().string()) + " || exit 2\n";
}

// A file of a task as an option for sbatch, which replaces what begins with %.
std::string slurm_log(const std::string &folder_and_name, const std::string &ending) {
    std::string escaped;
    for (const char c : folder_and_name)
        escaped += c == '%' ? std::string("%%") : std::string(1, c);
    return shell_word("--output=" + escaped + ending);
}

std::string slurm_memory(std::uint64_t bytes) { return "--mem=" + std::to_string((bytes >> 20) + 1) + "M"; }

std::string last_task(std::size_t tasks) { return "--array=0-" + std::to_string(tasks - 1); }

int write_plan(std::string_view program, const Arguments &arguments, const std::string &text) {
    const Status written = command_line::write_text(arguments.plan, text);
    return written ? 0 : command_line::fail(program, command_line::output_name(arguments.plan), written.error());
}

bool is_ninja(const Arguments &arguments) { return lower_extension(arguments.plan) == ".ninja"; }

// 0 unless the file cannot hold one of the names. `check`: of a name in a file of Ninja.
int check_names(std::string_view program, const Arguments &arguments, std::span<const std::string> names,
                Status (*check)(const std::string &)) {
    for (const std::string &name : names) {
        Status writable;
        if (is_ninja(arguments))
            writable = check(name);
        else if (name.find_first_of("\r\n") != std::string::npos) // would end a comment, or a line of a list
            writable = usage_error("a name of several lines cannot stand in a script; rename the file or its folder");
        if (!writable)
            return command_line::fail(program, name, writable.error());
    }
    return 0;
}

constexpr const char *kAlways = "pbm-build-always"; // a target that is never there

// Ninja has no escape for | in paths.
Status check_ninja_path(const std::string &name) {
    if (name.find_first_of("|\r\n") != std::string::npos)
        return usage_error(
            "a name with | or of several lines cannot stand in a file of Ninja; rename the file or its folder");
    return {};
}

// A file of the program's version, which changes when that does, makes models be built again: the time of the program
// may be that of its package. A scan whose name cannot stand in a dependency file is looked at by every run, by its
// hash.
std::string ninja_batch(const Arguments &arguments, std::span<const batch::Scan> scans) {
    const std::string version = ninja_value(self() + " --version"), stamp = ninja_path(arguments.plan + ".version");
    const std::string command =
        "  command = " + ninja_value(command_of(arguments)) + " --if-changed --warnings --threads=1";
    std::string text = ninja_head(arguments, counted(scans.size(), "scan") + " of pbm-build --batch") + "rule model\n" +
                       command +
                       " --dependency-file $out.d --output $out -- $in\n"
                       "  description = $in\n"
                       "  depfile = $out.d\n"
                       "  deps = gcc\n"
                       "  restat = 1\n"
                       "rule model_by_hash\n" +
                       command +
                       " --output $out -- $in\n"
                       "  description = $in\n"
                       "  restat = 1\n"
                       "rule version\n"
                       "  command = " +
                       version + " | cmp -s - $out || " + version +
                       " >$out\n"
                       "  description = the version of pbm-build\n"
                       "  restat = 1\n\nbuild " +
                       kAlways + ": phony\nbuild " + stamp + ": version | " + kAlways + "\n";
    for (const batch::Scan &scan : scans) {
        const bool has_depfile = check_depfile_name(scan.input) && check_depfile_target(scan.output);
        text += "build " + ninja_path(scan.output) + (has_depfile ? ": model " : ": model_by_hash ") +
                ninja_path(scan.input) + " | " + stamp + (has_depfile ? "" : std::string(" ") + kAlways) + "\n";
    }
    return text;
}

// A line of a list of scans: one that begins with # would be left out, and so would the mark of UTF-8.
std::string list_line(const std::string &scan) {
    return scan.starts_with('#') || scan.starts_with('\xEF') ? "./" + scan : scan;
}

std::string slurm_batch(const Arguments &arguments, const std::string &root, std::span<const batch::Scan> scans) {
    const batch::MemoryEstimate estimate;
    std::uint64_t most = 0;
    std::string names;
    for (const batch::Scan &scan : scans) {
        most = std::max(most, estimate.of(scan.input, scan.bytes));
        names += "    " + shell_word(list_line(scan.input)) + "\n";
    }
    const std::size_t tasks = std::min<std::size_t>(scans.size(), kMaxTasks);
    const std::string folder = fs::absolute(arguments.output_folder).lexically_normal().string();
    return slurm_head(counted(scans.size(), "scan") + " of pbm-build --batch", "sbatch " + shell_word(arguments.plan),
                      {last_task(tasks), slurm_memory(most), slurm_log(folder, "/slurm-%a.log")}) +
           "task=${SLURM_ARRAY_TASK_ID:?is set by sbatch}\ntasks=" + std::to_string(tasks) + "\nscans=(\n" + names +
           ")\n"
           "exec " +
           command_of(arguments) + " --if-changed --batch -" +
           (root.empty() ? "" : " --batch-root " + shell_word(root)) + " --output-dir " +
           shell_word(arguments.output_folder) + (arguments.keep_extension ? " --keep-extension" : "") +
           " --keep-going --warnings --allow stale-model \\\n"
           "    --threads \"${SLURM_CPUS_PER_TASK:-1}\" --json=" +
           shell_word(arguments.output_folder) +
           "/\"shard-$task.jsonl\" \\\n"
           "    < <(for ((i = task; i < ${#scans[@]}; i += tasks)); do printf '%s\\n' \"${scans[i]}\"; done)\n";
}

// The inputs as a shell reads them, each behind a space.
std::string input_words(const Arguments &arguments) {
    std::string words;
    for (const std::string &input : arguments.inputs)
        words += " " + shell_word(input);
    return words;
}

// What builds a part or the model, but for --threads, the step, and the inputs.
std::string command_of_parts(const Arguments &arguments) {
    const std::uint64_t limit = arguments.max_memory;
    return command_of(arguments) + (limit == 0 ? "" : " --max-memory=" + std::to_string(limit)) +
           " --warnings --output " + shell_word(arguments.output);
}

std::string ninja_part(const std::string &part, const std::string &needed, const std::string &shard) {
    return "build " + part + ": part" + needed + " | " + kAlways + "\n  shard = " + shard + "\n";
}

// Ninja judges by times, which damage need not change, and does not know what scans name: each run lets every shard
// verify its part. A part that is kept has its old time, so that the model is kept, too.
std::string ninja_parts(const Arguments &arguments) {
    const std::string count = std::to_string(arguments.shards), model = ninja_path(arguments.output);
    std::string text = ninja_head(arguments, arguments.output + " in " + counted(arguments.shards, "part")) +
                       "program = " + ninja_value(command_of_parts(arguments)) +
                       "\ninputs =" + ninja_value(input_words(arguments)) +
                       "\n\nrule part\n"
                       "  command = $program --threads=1 --shard $shard -- $inputs\n"
                       "  description = part $shard of " +
                       ninja_value(arguments.output) +
                       "\n  restat = 1\n"
                       "rule model\n"
                       "  command = $program --merge " +
                       count +
                       " -- $inputs\n"
                       "  description = " +
                       ninja_value(arguments.output) + "\n\nbuild " + kAlways + ": phony\n";
    std::string needed, parts;
    for (const std::string &source : arguments.sources)
        needed += " " + ninja_path(source);
    for (std::uint64_t i = 0; i < arguments.shards; ++i) {
        const std::string part = ninja_path(part_file_name(arguments.output, {i, arguments.shards}));
        text += ninja_part(part, needed, std::to_string(i) + "/" + count);
        parts += " " + part;
    }
    return text + "build " + model + ": model" + parts + " |" + needed + "\ndefault " + model + "\n";
}

// Bytes of memory that a part or the merge needs at most.
std::uint64_t need_of_part(const Arguments &arguments) {
    // Slurm may count pages of the temporary file that the system keeps.
    const std::uint64_t need = batch::likely_need(arguments.inputs), limit = arguments.max_memory;
    return limit == 0 ? need : std::min(need, limit + limit / 2);
}

// Started by hand, the script submits itself twice, with a word that says as what.
std::string slurm_parts(const Arguments &arguments) {
    const std::string log = fs::absolute(arguments.output).lexically_normal().string();
    const std::string script = shell_word(arguments.plan), count = std::to_string(arguments.shards);
    return slurm_head(arguments.output + " in " + counted(arguments.shards, "part"), "sh " + script + " [OPTIONS]",
                      {slurm_memory(need_of_part(arguments))}) +
           "case \"$1\" in\n"
           "shard) step=\"--shard=$SLURM_ARRAY_TASK_ID/" +
           count +
           "\" ;;\n"
           "merge) step=--merge=" +
           count +
           " ;;\n"
           "*)\n"
           "    parts=$(sbatch --parsable " +
           last_task(arguments.shards) + " " + slurm_log(log, ".slurm-%a.log") + " \"$@\" " + script +
           " shard) || exit 2\n"
           "    exec sbatch --parsable --dependency=\"afterok:${parts%%;*}\" --kill-on-invalid-dep=yes \\\n"
           "        " +
           slurm_log(log, ".slurm-merge.log") + " \"$@\" " + script +
           " merge\n"
           "    ;;\n"
           "esac\n"
           "exec " +
           command_of_parts(arguments) + " \\\n    --threads \"${SLURM_CPUS_PER_TASK:-1}\" \"$step\" --" +
           input_words(arguments) + "\n";
}

} // namespace

int plan_batch(std::string_view program, const Arguments &arguments, const std::string &root,
               std::span<const batch::Scan> scans) {
    if (scans.empty() || is_stream(arguments.batch) || arguments.shard.count != 1)
        return command_line::fail_usage(program, "a plan is of a whole list or folder, not of a stream or a shard");
    std::vector<std::string> names{arguments.plan};
    for (const batch::Scan &scan : scans) {
        names.push_back(scan.input);
        names.push_back(scan.output);
    }
    if (const int code = check_names(program, arguments, names, check_ninja_path); code != 0)
        return code;
    std::error_code error;
    fs::create_directories(arguments.output_folder, error); // where Slurm writes logs
    return write_plan(program, arguments,
                      is_ninja(arguments) ? ninja_batch(arguments, scans) : slurm_batch(arguments, root, scans));
}

int plan_parts(std::string_view program, const Arguments &arguments) {
    if (const int code = check_names(program, arguments, arguments.sources, check_depfile_name); code != 0)
        return code;
    const std::vector<std::string> outputs{arguments.plan, arguments.output};
    if (const int code = check_names(program, arguments, outputs, check_depfile_target); code != 0)
        return code;
    return write_plan(program, arguments, is_ninja(arguments) ? ninja_parts(arguments) : slurm_parts(arguments));
}

} // namespace pbm::build
