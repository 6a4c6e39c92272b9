// Builds many scans, several at a time, each by a process of its own: a scan that crashes or exhausts the memory costs
// only itself.
#pragma once

#include "pbm_batch/scan_list.h"

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

namespace pbm::batch {

struct Request {
    std::vector<std::string> builder;      // program and options of every build
    int jobs = 1;                          // builds at a time, at most
    int threads = 1;                       // of all builds together
    std::uint64_t max_memory = UINT64_MAX; // bytes of all builds together, by estimates; one build always runs
    bool keep_going = false;               // after a failure
    double timeout = 0;                    // seconds that one build may take; 0: no limit
};

// How the build of a scan ended.
struct Ending {
    const Scan *scan = nullptr;
    int exit_code = 0;    // 4 if a signal or the timeout ended it
    std::string message;  // of a failure, one line
    std::string warning;  // of a build that succeeded, one line; empty for none
    std::string document; // JSON of --json of the build; empty if it wrote none
    double seconds = 0;
};

// Calls `ended` after each build, one call at a time. After a failure, unless `keep_going`, it starts no more builds;
// those that run go on to their end.
void build_all(std::span<const Scan> scans, const Request &request, const std::function<void(const Ending &)> &ended);

} // namespace pbm::batch
