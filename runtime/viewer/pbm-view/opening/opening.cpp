#include "viewer/pbm-view/opening/opening.h"

#include "viewer/options/option_values.h"

#include <new>
#include <utility>

namespace pbm {

Opening::Opening(ThreadPool &pool, std::string path, const ViewOptions &options, const ScanOptions &scans,
                 bool draws_first)
    : path_(std::move(path)) {
    const auto set_progress = [&pool, shared = shared_](std::optional<Progress> progress) {
        {
            const std::lock_guard lock(shared->mutex);
            shared->progress = std::move(progress);
        }
        pool.wake();
    };
    if (is_scan(path_))
        shared_->progress = Progress{"start", 0};
    Preparation preparation{.scans = scans,
                            .threads = options.load.threads,
                            .progress =
                                [set_progress](std::string_view step, double done) {
                                    set_progress(Progress{std::string(step), done});
                                },
                            .stop = stop_.get_token()};
    preparation.scans.fields = fields_to_keep(options.look);
    opened_ = pool.post([&pool, path = path_, options, set_progress, draws_first, shared = shared_,
                         preparation = std::move(preparation)]() -> Result<ShownModelPointer> {
        try {
            const auto prepared = prepare_model(path, preparation);
            set_progress(std::nullopt);
            if (!prepared)
                return prepared.error();
            {
                const std::lock_guard lock(shared->mutex);
                shared->warning = prepared->warning;
            }
            auto model = ShownModel::open(path, prepared->file, options, [&pool, shared] {
                shared->set(&Shared::arrived);
                pool.wake();
            });
            if (!model)
                return with_advice("pbm-view", model.error());
            if (draws_first) {
                shared->set(&Shared::draws);
                (*model)->draw_first([&] { return shared->wait_for_chunks(); });
            }
            return model;
        } catch (const std::bad_alloc &) {
            return out_of_memory();
        }
    });
}

Opening::~Opening() {
    cancel();
    if (progress() && opened_.valid())
        opened_.wait(); // until pbm-build has ended and its temporary files are removed
}

void Opening::hurry() {
    shared_->set(&Shared::hurries);
    const bool draws = [&] {
        const std::lock_guard lock(shared_->mutex);
        return shared_->draws;
    }();
    if (draws && opened_.valid())
        opened_.wait();
}

std::string Opening::warning() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->warning;
}

std::optional<Opening::Progress> Opening::progress() const {
    const std::lock_guard lock(shared_->mutex);
    return shared_->progress;
}

} // namespace pbm
