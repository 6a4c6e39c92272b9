// The work of a batch, or of one model in parts, as a file for those who distribute it: Ninja on one machine, Slurm on
// many.
#pragma once

#include "options/options.h"
#include "pbm_batch/scan_list.h"

#include <span>
#include <string_view>

namespace pbm::build {

// Write --plan. Both kinds of file call this very program with the options that it was given, so that what is
// interrupted goes on where it was. Return the exit code: 1 if the file cannot hold a name, 2 if it
// cannot be written.

// Of a batch.
//   .ninja  a target for each scan, with what it reads as dependencies, and with the version of this program
//   .slurm  a job array whose tasks build every nth scan each; at most kMaxTasks. The script holds the names of all
//           scans: what comes into the folder later is in no task, and what leaves it fails
// `root`: batch::root_of the scans.
int plan_batch(std::string_view program, const Arguments &arguments, const std::string &root,
               std::span<const batch::Scan> scans);

// Of one model in --shards parts.
//   .ninja  a target for each part, which every run verifies, and the model
//   .slurm  a job array of the parts, and a job that joins them if all of them succeeded
int plan_parts(std::string_view program, const Arguments &arguments);

} // namespace pbm::build
