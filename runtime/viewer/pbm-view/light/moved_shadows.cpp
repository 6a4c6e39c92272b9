#include "viewer/pbm-view/light/moved_shadows.h"

#include "system/threads/parallel.h"
#include "viewer/pbm-view/light/light_motion.h"

#include <algorithm>
#include <new>
#include <utility>

namespace pbm {

MovedShadows::MovedShadows(ThreadPool &worker, int threads, std::uint64_t max_memory)
    : worker_(worker), threads_(threads > 0 ? threads : std::max(1, resolve_threads(0) / 2)), max_memory_(max_memory) {}

void MovedShadows::show(ShownModelPointer model) {
    stop();
    model_ = std::move(model);
    copy_.reset();
    lights_.clear();
    baked_ = {};
    refused_ = false;
    error_.reset();
}

void MovedShadows::stop() {
    if (job_)
        *job_->stop = true;
    job_.reset();
}

bool MovedShadows::is_moved(std::size_t light) const {
    return !same_place(lights_[light], model_->parameters().lights[light]);
}

std::shared_ptr<const BakedShadows> MovedShadows::baked(std::size_t light) const {
    return light < lights_.size() && baked_[light] && same_place(baked_[light]->light, lights_[light]) ? baked_[light]
                                                                                                       : nullptr;
}

bool MovedShadows::is_stale(std::size_t light) const {
    return light < lights_.size() && is_moved(light) && !baked(light);
}

void MovedShadows::choose(Appearance &appearance) const {
    if (!model_)
        return;
    const ModelParameters &file = model_->parameters();
    for (std::size_t l = 0; l < static_cast<std::size_t>(file.attributes.lights); ++l) {
        ShadowSource &source = appearance.shadows[l];
        const Light &light = appearance.lights[l];
        source = {.of_file = same_place(light, file.lights[l]), .fresh = nullptr};
        if (!source.of_file && baked_[l] && same_place(baked_[l]->light, light))
            source.fresh = baked_[l]->fractions;
    }
}

void MovedShadows::request(const Appearance &appearance, bool casts, double now) {
    if (!model_)
        return;
    const auto count = static_cast<std::ptrdiff_t>(model_->parameters().attributes.lights);
    std::vector<Light> lights(appearance.lights.begin(), appearance.lights.begin() + count);
    const bool same = std::equal(lights.begin(), lights.end(), lights_.begin(), lights_.end(), same_place);
    lights_ = std::move(lights);
    if (!same || casts != casts_)
        changed_ = now;
    casts_ = casts;
    if (job_ && !same_place(job_->place, lights_[job_->light]))
        *job_->stop = true;
}

std::optional<std::size_t> MovedShadows::baking() const {
    if (!refused_ && casts_)
        for (std::size_t l = 0; l < lights_.size(); ++l)
            if (is_stale(l))
                return l;
    return std::nullopt;
}

std::optional<double> MovedShadows::due() const {
    return baking() && !job_ ? std::optional(changed_ + kRest) : std::nullopt;
}

void MovedShadows::start(std::size_t light) {
    const std::uint64_t shown = model_->streamed().statistics().memory;
    const std::uint64_t allowed = max_memory_ > shown ? max_memory_ - shown : 0;
    const auto stopped = std::make_shared<std::atomic<bool>>(false);
    const Light place = lights_[light];
    auto work = [model = model_, copy = copy_, light, place, stopped, allowed,
                 threads = threads_]() mutable -> Result<Done> {
        try {
            if (!copy) {
                auto loaded = ShadowCopy::load(model->bytes(), threads, allowed);
                if (!loaded)
                    return loaded.error();
                copy = std::move(*loaded);
            }
            auto baked = copy->bake(place, light, threads, *stopped);
            return Done{std::move(copy), std::move(baked)};
        } catch (const std::bad_alloc &) {
            return out_of_memory();
        }
    };
    job_ = Job{.light = light, .place = place, .stop = stopped, .done = worker_.post(std::move(work))};
}

bool MovedShadows::serve(double now) {
    bool changed = false;
    if (job_ && is_ready(job_->done)) {
        Result<Done> done = job_->done.get();
        const std::size_t light = job_->light;
        job_.reset();
        if (!done) {
            refused_ = true;
            error_ = done.error();
            return false;
        }
        copy_ = std::move(done->copy);
        if (done->baked) {
            baked_[light] = std::move(done->baked);
            changed = baked(light) != nullptr;
        }
    }
    if (const auto next = baking(); next && !job_ && now >= changed_ + kRest)
        start(*next);
    return changed;
}

} // namespace pbm
