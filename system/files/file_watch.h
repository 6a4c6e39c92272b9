// Waits until a file is replaced or rewritten.
#pragma once

#include "system/files/descriptor.h"

#include <string>
#include <utility>
#include <vector>

namespace pbm {

// Watches the folders of a file, and of what it links to, for other files that are renamed to its name and for programs
// that have written it and close it. Where the system offers no watching (inotify), nothing is ever reported; network
// file systems report changes of this machine only.
class FileWatch {
  public:
    explicit FileWatch(const std::string &path);

    // Waits for the next change; false after `stop`. For one thread.
    bool wait();
    // Ends `wait`, now and later. Callable from any thread.
    void stop();

  private:
    void add(const std::string &path);
    bool take_events();

    Descriptor events_, stop_;
    std::vector<std::pair<int, std::string>> names_; // of each watched folder
};

} // namespace pbm
