// Any file as a model that can be mapped: a model itself, or what pbm-build makes of a scan.
#pragma once

#include "command_line/progress_display.h"
#include "system/error.h"

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {

namespace command_line {
struct CommandLine;
}

// How scans become models.
struct ScanOptions {
    std::string cache{};  // folder of built models; "none": none; empty: $PBM_CACHE, else the user's cache folder
    std::string recipe{}; // options of pbm-build, a TOML file; empty: its defaults
    std::vector<std::string> fields{};  // measurements that the model keeps (pbm-build --field)
    std::vector<std::string> options{}; // further ones of pbm-build; a recipe's are weaker
};

// Declares --cache and --recipe. `options` must outlive the parsing.
void add_scan_options(command_line::CommandLine &line, ScanOptions &options);

// Whether `path` is a regular file that is neither a model by its magic number nor named like one. pbm-build decides
// whether it can read it.
bool is_scan(const std::string &path);

// A model on disk.
struct PreparedModel {
    std::string file;
    std::shared_ptr<const void> temporary{}; // its last owner removes the file; empty for a file that stays
    std::string warning{};                   // why the cache was not used; empty: it was, or none was asked for
};

struct Preparation {
    ScanOptions scans{};
    int threads = 0;                                                    // of pbm-build; 0: as many as processors
    std::function<void(std::string_view step, double done)> progress{}; // 0..1 of the step; another thread may call it
    std::stop_token stop{};                                             // ends pbm-build at once
    std::string builder{}; // path of pbm-build; empty: beside this program, else in PATH
    std::chrono::system_clock::time_point now = std::chrono::system_clock::now();
};

// The model at `path`, or the model of the scan at `path`. Such a model is taken from the cache, or built into it by
// the program pbm-build. Without a cache, or where it cannot be read, written or created, the model is temporary.
// The message of an error of pbm-build is passed on.
//
// errors  those of pbm-build: its exit code is that of the error
//         memory (exit code 4)  there is no pbm-build, or a signal ended it
//         io                    no folder for the model
Result<PreparedModel> prepare_model(const std::string &path, const Preparation &preparation);

} // namespace pbm
