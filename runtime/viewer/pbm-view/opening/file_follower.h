// Follows the file of the model shown, which others may replace, or write in place.
#pragma once

#include "viewer/pbm-view/drawing/shown.h"
#include "viewer/pbm-view/window/view_text.h"

#include "system/files/file_watch.h"
#include "system/threads/thread_pool.h"

#include <atomic>
#include <memory>
#include <string>

namespace pbm {

class FileFollower {
  public:
    static constexpr double kLook = 1; // seconds, from one look at a file that was written in place to the next

    // A thread of `pool`, which it wakes, waits for news of the file. All outlive this.
    FileFollower(const Shown &shown, Window &window, ThreadPool &pool)
        : shown_(shown), window_(window), watch_(std::make_shared<FileWatch>(shown.model->path())) {
        pool.post([watch = watch_, news = news_, &pool] {
            for (FileChange change = watch->wait(); change != FileChange::none; change = watch->wait())
                if (news->exchange(change) != change)
                    pool.wake();
        });
    }
    ~FileFollower() { watch_->stop(); }
    FileFollower(const FileFollower &) = delete;
    FileFollower &operator=(const FileFollower &) = delete;

    bool has_news() const { return *news_ != FileChange::none; }
    bool is_being_written() const { return *news_ == FileChange::writing; }
    // Whether somebody said, since the last call, that the file is whole.
    bool take_whole() {
        FileChange whole = FileChange::whole;
        return news_->compare_exchange_strong(whole, FileChange::none);
    }
    // The file was written in place: watches its size and time of change from now on.
    void hold() {
        seen_ = shown_.model->stamp();
        tried_ = {};
        grows_ = true;
        next_look_ = Window::now() + kLook;
    }
    double next_look() const { return next_look_; } // window's clock
    // Whether a held file, of which nobody tells when it is whole, has stopped to change: such news come from this
    // machine alone.
    bool has_settled() {
        if (!shown_.is_overwritten || Window::now() < next_look_)
            return false;
        const FileStamp stamp = shown_.model->stamp();
        grows_ = stamp != std::exchange(seen_, stamp);
        next_look_ = Window::now() + kLook;
        window_.invalidate();
        return !grows_ && !has_news() && stamp != tried_;
    }
    // The present contents of the file are opened.
    void try_again() { tried_ = shown_.model->stamp(); }
    // What is told of the file while it is not whole, else nothing.
    std::string status() const {
        if (!shown_.is_overwritten && !is_being_written())
            return "";
        return file_name(shown_.model->path()) +
               (is_being_written() || grows_ ? " is being written" : " was written over") +
               "; this picture is the last one";
    }

  private:
    using News = std::atomic<FileChange>;
    const Shown &shown_;
    Window &window_;
    const std::shared_ptr<FileWatch> watch_;
    const std::shared_ptr<News> news_ = std::make_shared<News>(FileChange::none);
    // Of a held file:
    FileStamp seen_, tried_; // when it was looked at, and opened, last
    bool grows_ = false;     // changed between the last two looks
    double next_look_ = 0;
};

} // namespace pbm
