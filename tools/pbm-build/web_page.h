// --page: a page that shows the model.
#pragma once

#include "options/options.h"

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string_view>

namespace pbm::build {

// The folder of a page. If it was made here and nothing was written into it, it goes again.
class PageFolder {
  public:
    PageFolder() = default;
    ~PageFolder();
    PageFolder(const PageFolder &) = delete;
    PageFolder &operator=(const PageFolder &) = delete;

    // Makes the folder, so that the output can be written there.
    //
    // Returns the exit code of an error.
    std::optional<int> begin(std::string_view program, const Arguments &arguments);

  private:
    std::filesystem::path made_;
};

// Runs pbm-render --page for the output, which is there. Its report goes to `report`, which may be null.
//
// Returns the exit code of an error: that of pbm-render; 4: it is not installed.
std::optional<int> make_page(std::string_view program, const Arguments &arguments, std::ostream *report);

} // namespace pbm::build
