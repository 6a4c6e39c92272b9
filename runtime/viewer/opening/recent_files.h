// The files that were shown last, newest first, kept in the user's state folder from run to run.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace pbm {

class RecentFiles {
  public:
    static constexpr std::size_t kMax = 12;

    // `file` holds one full path a line; empty: nothing is kept. By default $XDG_STATE_HOME/pbm/recent.
    explicit RecentFiles(std::string file = default_file()) : file_(std::move(file)) {}
    static std::string default_file();

    // Those that still exist.
    std::vector<std::string> list() const;
    // Puts `path` first. What cannot be written is lost without a word: showing models must not fail because of it.
    void add(const std::string &path) const;

  private:
    std::vector<std::string> read() const;

    std::string file_;
};

} // namespace pbm
