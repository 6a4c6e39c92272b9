// Waits until a file is replaced or rewritten, and says what an open file has become.
#pragma once

#include "system/files/descriptor.h"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace pbm {

// Differs once a file was written, or cut short, in place. A file that another one replaces, or that is removed, stays
// as it was for those who have it open.
struct FileStamp {
    std::int64_t size = 0, seconds = 0, nanoseconds = 0; // of the last change of its contents

    bool operator==(const FileStamp &) const = default;
};
// All zero if `file` is not open.
FileStamp stamp_of(const Descriptor &file);

// writing: it was written to, or cut short, and is not closed yet. whole: another file was renamed to its name, or a
// program that has written it closed it.
enum class FileChange { none, writing, whole };

// Watches a file that is there for what is written to it, and the folders of it, and of what it links to, for other
// files that are renamed to its name and for programs that have written it and close it. Where the system offers no
// watching (inotify), nothing is ever reported; network file systems report changes of this machine only.
class FileWatch {
  public:
    explicit FileWatch(const std::string &path);

    // Waits for the next change; `none` after `stop`. A file that is being written is reported ten times a second at
    // most. For one thread.
    FileChange wait();
    // Ends `wait`, now and later. Callable from any thread.
    void stop();

  private:
    void add(const std::string &path);
    void add_contents();
    FileChange take_events();

    const std::string path_;
    Descriptor events_, stop_;
    FileChange last_ = FileChange::none;
    int contents_ = -1;                              // number of the watch of the file itself
    std::vector<std::pair<int, std::string>> names_; // of each watched folder
};

} // namespace pbm
