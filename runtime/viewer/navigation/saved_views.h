// Views that the user has saved, four for each model, kept from run to run.
#pragma once

#include "system/error.h"
#include "viewer/cameras/model_views.h"

#include <optional>
#include <string>

namespace pbm {

class SavedViews {
  public:
    // `file` has one view a line: its number, the options of pbm-render that draw it, a tab, the full path of the
    // model. Empty: views are not kept. By default $XDG_STATE_HOME/pbm/views.
    explicit SavedViews(std::string file = default_file()) : file_(std::move(file)) {}
    static std::string default_file();

    // Views beyond this many are lost, the oldest first.
    static constexpr std::size_t kMax = 200;

    // View `number` of the model at `path`; absent if there is none. Lines that are not understood are skipped.
    std::optional<SavedView> find(const std::string &path, int number) const;
    // Replaces it.
    //
    // errors  io     the file cannot be written
    //         usage  there is no file to keep views in, or the path has a line break
    Status save(const std::string &path, int number, const SavedView &view) const;

  private:
    std::string file_;
};

} // namespace pbm
