// Damage of a model: looks for it in what no picture shows, and knows what was met before.
#pragma once

#include "system/processes/this_process.h"
#include "system/threads/thread_pool.h"
#include "viewer/scene/damage_search.h"
#include "viewer/scene/shown_model.h"

#include <future>
#include <set>
#include <stop_token>
#include <vector>

namespace pbm {

class Damage {
  public:
    ~Damage() { stop(); }

    // Searches the whole file on `pool`, once, unless it is too large.
    void search(ThreadPool &pool, const ShownModelPointer &model) {
        if (std::exchange(is_searched_, true) || model->bytes().size() > kMaxSearchedBytes)
            return;
        search_ = pool.post([model, stop = stop_.get_token()] {
            lower_priority();
            return find_damage(model->bytes(), stop);
        });
    }
    bool is_searching() const { return search_.valid(); }
    // Ends the search; nothing of it is found.
    void stop() {
        stop_.request_stop();
        search_ = {};
    }
    // What the search has found, once.
    std::vector<Error> take_found() { return is_ready(search_) ? search_.get() : std::vector<Error>(); }
    // Whether this fault is met for the first time, by a picture or the search.
    bool is_new(const Error &fault) { return !has_offset(fault) || met_.insert(fault.offset).second; }

  private:
    bool is_searched_ = false;
    std::stop_source stop_;
    std::future<std::vector<Error>> search_;
    std::set<std::uint64_t> met_; // offsets
};

} // namespace pbm
