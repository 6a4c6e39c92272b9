// The shadows of lights that were moved: the file's are stale at once, new ones are baked in the background.
//
//   shadows.show(model)            forgets all
//   shadows.choose(appearance)     after each change of lights: says where the shadows of each light come from
//   shadows.serve(now)             between two events: bakes what rests, newest request first
//
// Dissertation section 7.1 asks for this.
#pragma once

#include "viewer/pbm-view/light/shadow_copy.h"
#include "viewer/scene/shown_model.h"

#include "system/threads/thread_pool.h"

#include <array>
#include <future>
#include <memory>
#include <optional>
#include <string>

namespace pbm {

class MovedShadows {
  public:
    // A light that has not moved for this long is baked, seconds.
    static constexpr double kRest = 0.2;

    // Bakes on `worker`, which must outlive it, one light at a time, with `threads` threads (0: half the processors).
    // `max_memory` bounds the copy of the model beside what `ShownModel` holds.
    MovedShadows(ThreadPool &worker, int threads, std::uint64_t max_memory);
    ~MovedShadows() { stop(); }
    MovedShadows(const MovedShadows &) = delete;
    MovedShadows &operator=(const MovedShadows &) = delete;

    void show(ShownModelPointer model); // null: none
    // Sets Appearance::shadows: the file's for a light in the file's place, fresh ones if there are any for the light's
    // place, else none.
    void choose(Appearance &appearance) const;
    // Notes the lights of a new look. `casts`: shadows are shown.
    void request(const Appearance &appearance, bool casts, double now);
    // Starts and stops baking and takes what is done. Returns whether `choose` has another answer than before.
    bool serve(double now);
    // When `serve` has something to start; absent: nothing before the next call of `request` or the worker's wake-up.
    std::optional<double> due() const;

    // The light whose shadows are baked now, or will be when it rests.
    std::optional<std::size_t> baking() const;
    // Why shadows could not be baked, since the last call.
    std::optional<Error> take_error() { return std::exchange(error_, std::nullopt); }
    // The baked shadows of a light in its present place; null if there are none.
    std::shared_ptr<const BakedShadows> baked(std::size_t light) const;
    // Whether the light has stale shadows: it was moved and nothing new is baked.
    bool is_stale(std::size_t light) const;

  private:
    using Copy = std::shared_ptr<const ShadowCopy>;
    struct Done {
        Copy copy;
        std::shared_ptr<const BakedShadows> baked; // null: stopped
    };
    struct Job {
        std::size_t light;
        Light place;
        std::shared_ptr<std::atomic<bool>> stop;
        std::future<Result<Done>> done;
    };
    bool is_moved(std::size_t light) const;
    void start(std::size_t light);
    void stop();

    ThreadPool &worker_;
    const int threads_;
    const std::uint64_t max_memory_;
    ShownModelPointer model_;
    Copy copy_;                 // loaded with the first light that moves
    std::vector<Light> lights_; // those with a shadow stream, where they are now
    std::array<std::shared_ptr<const BakedShadows>, kMaxLights> baked_;
    bool casts_ = true;
    double changed_ = 0;
    std::optional<Job> job_;
    bool refused_ = false; // this model cannot be baked
    std::optional<Error> error_;
};

} // namespace pbm
