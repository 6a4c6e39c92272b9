// The work of a batch as a file for those who distribute it: Ninja on one machine, Slurm on many.
#pragma once

#include "options.h"
#include "pbm_batch/scan_list.h"

#include <span>
#include <string_view>

namespace pbm::build {

// Writes --plan. Both kinds of file call this very program with the options of the batch and --if-changed, so that what
// is interrupted goes on where it was.
//   .ninja  a target for each scan, with what it reads as dependencies
//   .slurm  a job array whose tasks build a shard each; at most kMaxTasks
//
// Returns the exit code: 1 if Ninja cannot write the name of a file, 2 if the file cannot be written.
int write_plan(std::string_view program, const Arguments &arguments, std::span<const batch::Scan> scans);

inline constexpr std::size_t kMaxTasks = 1000; // of a job array; Slurm's own default limit is 1,001

} // namespace pbm::build
