// A model that a window shows: opened and drawn with what there is of it, while the rest is loaded.
#pragma once

#include "system/threads/thread_pool.h"
#include "viewer/options/view_options.h"
#include "viewer/scene/look.h"
#include "viewer/scene/painter.h"
#include "viewer/scene/scene.h"

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <optional>
#include <string>

namespace pbm {

// Of a picture as it was drawn.
struct PictureStatistics {
    RenderStatistics drawn;
    int coarsest_level = 0;  // drawn, `drawn.level` is the finest
    double error = 0;        // pixels, no voxel is larger; of what is missing the largest, infinite around the eye
    std::size_t missing = 0; // chunks
    double seconds = 0;      // it took
};

// The error of a picture that was chosen with `max_error`.
double error_of(const Detail &detail, double max_error);

class ShownModel {
  public:
    // Reads what a first camera needs and requests what the first picture of `options` lacks, so that it is loaded
    // until there is a window. `arrived` is called by other threads when more is there than `take_arrivals` has told.
    //
    // errors  as open_scene and StreamedModel::bounds
    static Result<std::shared_ptr<ShownModel>> open(const std::string &path, const ViewOptions &options,
                                                    std::function<void()> arrived);
    ShownModel(const ShownModel &) = delete;
    ShownModel &operator=(const ShownModel &) = delete;

    const std::string &path() const { return path_; }
    const Sphere &bounds() const { return bounds_; }
    const ModelParameters &parameters() const { return streamed().reader().parameters(); }
    const Grid &grid() const { return parameters().grid; }
    bool has_panorama() const { return streamed().reader().section(SectionType::panorama) != nullptr; }
    int depth() const { return streamed().reader().depth(); }

    // For one thread at a time, as it says.
    StreamedModel &streamed() { return scene_->model; }
    const StreamedModel &streamed() const { return scene_->model; }
    // Whether chunks arrived since the last call.
    bool take_arrivals() { return has_arrivals_.exchange(false); }
    bool has_arrivals() const { return has_arrivals_; }

    // Damage found since the last call, of chunks and of rasters.
    std::vector<Error> take_errors();

    DetailView view(const Camera &camera, glm::ivec2 size, double max_error) const;
    // As the command line and the file say.
    LookPointer first_look() const { return std::make_shared<Look>(options_.look, parameters()); }
    // Draws what was chosen for `view`: the window's thread, always fast, and the background thread, as `look` says.
    PictureStatistics draw_now(const Detail &detail, const DetailView &view, const LookPointer &look,
                               Framebuffer &target);
    // As `look` says, on the window's thread.
    PictureStatistics draw_and_wait(const Detail &detail, const DetailView &view, const LookPointer &look,
                                    Framebuffer &target);
    PictureStatistics draw_in_background(const Detail &detail, const DetailView &view, const LookPointer &look,
                                         Framebuffer &target);
    // A fine picture sample by sample, on the background thread: `target` is what there is of it.
    void begin_fine(const Detail &detail, const DetailView &view, const LookPointer &look);
    PictureStatistics add_sample(const Detail &detail, const DetailView &view, Framebuffer &target);

  private:
    ShownModel(std::string path, const ViewOptions &options) : path_(std::move(path)), options_(options) {}
    Painter &painter(std::optional<Painter> &made) const;
    PictureStatistics statistics(const Detail &detail, const DetailView &view, const RenderStatistics &drawn,
                                 std::chrono::steady_clock::time_point begin) const;

    const std::string path_;
    const ViewOptions options_;
    std::atomic<bool> has_arrivals_ = false;
    Sphere bounds_;
    std::unique_ptr<StreamedScene> scene_;
    std::optional<Painter> window_, background_, refining_; // made when first needed
};

using ShownModelPointer = std::shared_ptr<ShownModel>;
using Loading = std::future<Result<ShownModelPointer>>;

// Opens a model in the background; what arrives of it wakes who waits for that thread, which must outlive it.
Loading begin_loading(ThreadPool &background, const std::string &path, const ViewOptions &options);

// Lets go of a model, in the background if this was the last to know it: that waits for the chunks being decoded.
void let_go(ThreadPool &background, ShownModelPointer model);

} // namespace pbm
