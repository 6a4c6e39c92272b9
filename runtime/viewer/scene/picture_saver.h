// Saves pictures at full detail on request: each waits until its chunks are loaded.
#pragma once

#include "system/threads/thread_pool.h"
#include "viewer/scene/shown_model.h"

#include <deque>
#include <future>
#include <string>
#include <vector>

namespace pbm {

class PictureSaver {
  public:
    using Saved = Result<std::string>; // a path

    // Draws and writes on `background`, which must outlive it, into the current folder of the process.
    explicit PictureSaver(ThreadPool &background) : background_(background) {}

    // Enqueues the picture of `view` with `look`, to be saved under the model's name.
    void add(ShownModelPointer model, const DetailView &view, LookPointer look) {
        waiting_.push_back({std::move(model), view, std::move(look)});
    }

    // Starts the pictures that can start and requests the chunks that the next one lacks. Call after `add`, when
    // chunks have arrived and when a task of `background` has ended, on the thread that owns the models. Loading serves
    // one view at a time: while pictures wait, nobody else should request chunks.
    void serve();
    bool is_waiting() const { return !waiting_.empty(); }

    // Results of pictures done since the last call. `all`: waits for all pictures.
    std::vector<Saved> take_done(bool all);

  private:
    struct Waiting {
        ShownModelPointer model;
        DetailView view;
        LookPointer look;
        bool requested = false; // its chunks, when no other picture held any
    };
    void begin(const Waiting &picture, Detail detail);

    ThreadPool &background_;
    std::deque<Waiting> waiting_;
    std::deque<std::future<Saved>> saving_;
};

} // namespace pbm
