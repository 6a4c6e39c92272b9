// Pictures that a window saves on request: exact ones, so each waits until all that it needs is loaded.
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
    // Draws and writes on `background`, which must outlive it, into the folder of the process.
    explicit PictureSaver(ThreadPool &background) : background_(background) {}

    // The picture of `view`, drawn as `look` says, is to be saved under the model's name, in the order of these calls.
    void add(ShownModelPointer model, const DetailView &view, LookPointer look) {
        waiting_.push_back({std::move(model), view, std::move(look)});
    }

    // Begins what can begin and requests what the next picture lacks. To be called after `add` and when chunks arrived,
    // on the thread that owns the models. Loading is for one view at a time: until nothing waits nobody else should
    // request chunks.
    void serve();
    bool is_waiting() const { return !waiting_.empty(); }

    // What became of pictures, once: paths, errors. `all`: of all that were asked for,
    // which may take a while.
    std::vector<Result<std::string>> take_done(bool all);

  private:
    struct Waiting {
        ShownModelPointer model;
        DetailView view;
        LookPointer look;
        bool requested = false;
    };
    void begin(const Waiting &picture, Detail detail);

    ThreadPool &background_;
    std::deque<Waiting> waiting_;
    std::deque<std::future<Result<std::string>>> saving_;
};

} // namespace pbm
