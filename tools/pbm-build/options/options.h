// The command line of pbm-build.
#pragma once

#include "command_line/parse.h"
#include "command_line/progress_display.h"
#include "pbm_build/pipeline.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// That a batch or a model is divided into; Slurm's own default limit of a job array is 1,001.
inline constexpr int kMaxTasks = 1000;

struct Arguments {
    std::vector<std::string> inputs; // at least one, unless this is a batch
    std::string output;
    std::string page, page_view;         // folder for a web server; options of pbm-render
    std::vector<std::string> fields;     // of --field, readable
    std::vector<std::string> viewpoints; // "X,Y,Z", readable: none, one for all inputs, or one for each
    std::string grid_like;               // .pbvg whose grid is taken, empty for none
    std::string json;                    // file, "-" for stdout, empty for none
    bool if_changed = false, source_hash = false;
    bool action_key = false;              // print the key of the output, build nothing
    std::string list_warnings;            // "text", "markdown"; empty: no
    std::vector<std::string> deny, allow; // names of warnings
    std::string cache;                    // folder, empty for none
    std::uint64_t cache_size = std::uint64_t{20} << 30;
    std::string temp_folder; // of --max-memory, empty: the system's
    bool progress = false;   // lines of progress on stdout
    bool depfile = false;
    std::string depfile_name;           // empty: the output's with .d
    std::string depfile_target;         // the output's name in it; empty: as given
    std::string recipe;                 // file, empty for none
    bool allow_outside = false;         // the recipe may write outside its folder
    std::vector<std::string> sources;   // every file on the command line (or in the recipe) that is read
    std::string request;                // all options that affect the result, in one spelling
    std::string batch;                  // list or folder of scans that are built each on its own, empty for none
    std::string output_folder;          // of a batch
    std::string batch_root;             // of a list, as whose scans the models lie; empty: the list's folder
    bool keep_extension = false;        // models of a batch are named after whole names of scans
    std::uint64_t max_memory = 0;       // bytes; 0: not given
    bool keep_going = false;            // of a batch, after a failure
    double timeout = 0;                 // of a batch: seconds that one build may take; 0: no limit
    PartNumber shard;                   // of the scans of a batch, by a hash of their names, or a part of one scan
    std::uint64_t shards = 0;           // parts that a plan has; 0: not given
    std::uint64_t merged = 0;           // parts that become the model; 0: it is built from the inputs
    std::string plan;                   // file to write instead of building anything, empty for none
    std::vector<std::string> forwarded; // words of the options that each build of a batch or plan gets
    WarningSet allowed{};               // not printed
    BuildOptions build;
    command_line::Verbosity verbosity = command_line::Verbosity::normal;
};

// Fills `arguments`, or returns the exit code after --help, --version or an error.
std::optional<int> parse(std::string_view program, int argc, char **argv, Arguments &arguments);

// For libraries: the options that decide what is in a model, by their long names without dashes; a recipe of them; and
// "threads".
using OptionValue = command_line::NamedValue;

// errors  usage; those of read_recipe and read_grid
Result<BuildOptions> read_options(std::span<const OptionValue> given);

} // namespace pbm::build
