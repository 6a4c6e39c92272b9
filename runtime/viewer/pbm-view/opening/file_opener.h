// Which file is opened: one at a time; the one asked for last when it ends. Asks for files in a dialog.
#pragma once

#include "viewer/pbm-view/opening/opening.h"

#include "viewer/opening/file_dialog.h"
#include "viewer/opening/file_list.h"

#include <filesystem>
#include <utility>
#include <vector>

namespace pbm {

class FileOpener {
  public:
    using Paths = std::vector<std::string>;
    // A file that was opened, or could not be.
    struct Opened {
        std::string path;
        Result<ShownModelPointer> model;
        bool was_cancelled;
        bool again;       // the file of the model shown, which was replaced
        bool quietly;     // nobody said that the file is whole
        std::string next; // to be opened now; empty for none
        std::string warning;
    };

    // `pool` outlives it. `first`, which opens the current one of `files`, may be null.
    FileOpener(ThreadPool &pool, const ScanOptions &scans, FileList files, std::unique_ptr<Opening> first)
        : pool_(pool), scans_(scans), files_(std::move(files)), opening_(std::move(first)) {}
    ~FileOpener() { stop_.request_stop(); }

    FileList &files() { return files_; } // that the user goes through

    // Opens a file, see Opened. Another that is being built is cancelled.
    void open(const std::string &path, const ViewOptions &options, bool again, bool quietly) {
        if (opening_) {
            next_ = path;
            if (opening_->progress())
                opening_->cancel();
            return;
        }
        again_ = again;
        quietly_ = quietly;
        opening_ = std::make_unique<Opening>(pool_, path, options, scans_);
    }
    Opening *opening() const { return opening_.get(); } // in progress; null for none
    // Once the opening has ended.
    std::optional<Opened> take() {
        if (!opening_ || !opening_->is_ready())
            return std::nullopt;
        const auto done = std::exchange(opening_, nullptr);
        return Opened{done->path(),   done->take(), done->was_cancelled(), again_, quietly_, std::exchange(next_, ""),
                      done->warning()};
    }

    // Shows the dialog, unless it is shown.
    void ask() {
        if (dialog_.valid())
            return;
        std::error_code ignored;
        const std::filesystem::path here = files_.empty() ? "" : std::filesystem::path(files_.current()).parent_path();
        dialog_ = pool_.post([folder = std::filesystem::absolute(here.empty() ? "." : here, ignored).string(),
                              stop = stop_.get_token()] { return ask_for_files(folder, stop); });
    }
    bool asks() const { return dialog_.valid(); }
    // What was chosen in the dialog, empty for nothing; absent while it is shown.
    std::optional<Result<Paths>> take_answer() {
        return pbm::is_ready(dialog_) ? std::optional(dialog_.get()) : std::nullopt;
    }

  private:
    ThreadPool &pool_;
    const ScanOptions scans_;
    FileList files_;
    std::unique_ptr<Opening> opening_;
    bool again_ = false, quietly_ = false; // see Opened
    std::string next_;
    std::future<Result<Paths>> dialog_;
    std::stop_source stop_; // ends the dialog
};

} // namespace pbm
