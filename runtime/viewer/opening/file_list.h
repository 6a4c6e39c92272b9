// The files that the user goes through: those that were named, those of a folder, or the neighbours of one file.
#pragma once

#include "system/error.h"

#include <cstddef>
#include <string>
#include <vector>

namespace pbm {

// Models and scans in a folder by their extensions, as people sort them: scan-2 before scan-10. A scan beside the model
// that pbm-build would write of it (scan.ply, scan.pbvg) is left out.
std::vector<std::string> models_of_folder(const std::string &folder);

class FileList {
  public:
    FileList() = default;
    // Folders stand for their files. A single file stands for its folder: the list starts at it. Needs a path or more.
    //
    // errors  io  a folder has no model and no scan
    static Result<FileList> of(const std::vector<std::string> &paths);

    bool empty() const { return files_.empty(); }
    const std::string &current() const { return files_[at_]; }
    // Goes `steps` files on, or back if negative, and round at the ends. Returns whether there is another file.
    bool step(int steps);
    // " (2 of 5)"; empty for a single file, and for neighbours of which the user named none.
    std::string position() const;

  private:
    std::vector<std::string> files_;
    std::size_t at_ = 0;
    bool is_single_ = false; // the user named one file; its neighbours are listed at the first step
};

} // namespace pbm
