// A model that a window shows: it is drawn with the chunks loaded so far while others are loaded.
#pragma once

#include "system/files/file_watch.h"
#include "system/threads/thread_pool.h"
#include "viewer/options/view_options.h"
#include "viewer/scene/look.h"
#include "viewer/scene/painter.h"
#include "viewer/scene/scene.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace pbm {

struct PictureStatistics {
    RenderStatistics drawn;
    int coarsest_level = 0;  // `drawn.level` is the finest
    double error = 0;        // edge of the largest voxel in pixels, counting missing chunks; infinite around the eye
    std::size_t missing = 0; // chunks
    double seconds = 0;      // duration
    bool is_lost = false;    // the file was written in place before the picture was done
};

// The error of a picture that was chosen with `max_error`.
double error_of(const Detail &detail, double max_error);

class ShownModel {
  public:
    // Maps `file`, the model of the file at `path`, which may be a scan. Reads what a first camera needs and requests
    // the chunks of the first picture of `options`, which load while the window opens. Other threads call `arrived`
    // when chunks arrive after a call of `take_arrivals`.
    //
    // errors  as open_scene and StreamedModel::bounds
    static Result<std::shared_ptr<ShownModel>> open(const std::string &path, const std::string &file,
                                                    const ViewOptions &options, std::function<void()> arrived);
    ShownModel(const ShownModel &) = delete;
    ShownModel &operator=(const ShownModel &) = delete;

    // A picture that was drawn before the model is shown.
    struct FirstPicture {
        DetailView view;
        Framebuffer pixels;
        PictureStatistics drawn;
    };
    // Draws the picture that `open` has requested chunks for, once they are there. `wait` is called while they are
    // loaded; it returns, false to give up, when chunks arrive or soon after. Before the model is shown.
    void draw_first(const std::function<bool()> &wait);
    // That picture, once, if there is one.
    std::optional<FirstPicture> take_first() { return std::exchange(drawn_first_, std::nullopt); }

    const std::string &path() const { return path_; }
    ByteView bytes() const { return scene_->file.bytes(); }
    // What the file has become. Once it was written in place, its bytes are not those of this model any more.
    FileStamp stamp() const { return stamp_of(opened_); }
    bool is_overwritten() const { return stamp() != first_; }
    const Extent &extent() const { return extent_; }
    const Sphere &bounds() const { return extent_.sphere; }
    const ModelParameters &parameters() const { return streamed().reader().parameters(); }
    const Grid &grid() const { return parameters().grid; }
    const std::optional<FieldColours> &colours() const { return scene_->colours; }
    bool has_panorama() const { return streamed().reader().section(SectionType::panorama) != nullptr; }
    int depth() const { return streamed().reader().depth(); }

    // One thread at a time.
    StreamedModel &streamed() { return scene_->model; }
    const StreamedModel &streamed() const { return scene_->model; }
    // Whether chunks arrived since the last call.
    bool take_arrivals() { return has_arrivals_.exchange(false); }
    bool has_arrivals() const { return has_arrivals_; }

    // Damage found since the last call, of chunks and of rasters.
    std::vector<Error> take_errors();

    DetailView view(const Camera &camera, glm::ivec2 size, double max_error) const;
    // The look of the command line and the file.
    LookPointer first_look() const { return look_with(options_.look, up_of(options_, grid())); }
    LookPointer look_with(const LookOptions &options, UpAxis up) const {
        return std::make_shared<Look>(options, parameters(), up, scene_->unasked.depth_cue, scene_->has_one_colour);
    }
    // Draws the detail chosen for `view`, always fast: on the window's thread and on the background thread.
    PictureStatistics draw_now(const Detail &detail, const DetailView &view, const LookPointer &look,
                               Framebuffer &target);
    PictureStatistics draw_in_background(const Detail &detail, const DetailView &view, const LookPointer &look,
                                         Framebuffer &target);
    // Draws a frame of a video on the window's thread, and a still picture to be saved on the background thread.
    PictureStatistics draw_frame(const Detail &detail, const DetailView &view, const LookPointer &look,
                                 Framebuffer &target);
    PictureStatistics draw_still(const Detail &detail, const DetailView &view, const LookPointer &look,
                                 Framebuffer &target);
    // Refines a fine picture on the background thread: samples update `target`. `stop`: see Painter::add_samples.
    void begin_fine(const Detail &detail, const DetailView &view, const LookPointer &look, const Framebuffer &target);
    PictureStatistics add_samples(const Detail &detail, const DetailView &view, int count, Framebuffer &target,
                                  const std::atomic<bool> *stop = nullptr);

  private:
    ShownModel(std::string path, Descriptor opened, const ViewOptions &options)
        : path_(std::move(path)), opened_(std::move(opened)), options_(options) {}
    Painter &painter(std::optional<Painter> &made) const;
    // Times `draw`, which returns RenderStatistics.
    template <class Draw>
    PictureStatistics measure(const Detail &detail, const DetailView &view, const Draw &draw) const;

    const std::string path_;
    const Descriptor opened_; // the file that is mapped
    const FileStamp first_ = stamp();
    const ViewOptions options_;
    std::atomic<bool> has_arrivals_ = false;
    Extent extent_;
    std::optional<DetailView> first_view_; // absent if the camera is unusable, or one of the file's
    std::optional<FirstPicture> drawn_first_;
    std::unique_ptr<StreamedScene> scene_;
    std::optional<Painter> window_, background_, refining_; // created on first use
};

using ShownModelPointer = std::shared_ptr<ShownModel>;
// Releases a model on the background thread: the last owner waits for chunks that are being decoded.
void destroy_in(ThreadPool &background, ShownModelPointer model);

} // namespace pbm
