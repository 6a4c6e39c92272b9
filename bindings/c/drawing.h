// Draws an open model, and keeps decoded chunks and renderers for its next picture.
#pragma once

#include "model.h"

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/appearance/legend.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/shading/unasked_look.h"
#include "pbm_render/surroundings/surroundings.h"
#include "system/threads/thread_pool.h"

#include <array>
#include <memory>
#include <optional>
#include <string>

namespace pbm::c_api {

class Drawing {
  public:
    // What it is opened for.
    struct Setup {
        int threads = 0;
        std::uint64_t max_memory = kDefaultMaxMemory; // as in StreamingOptions
        std::string colour_by{};                      // as choose_field_colours takes it; empty: none
        ColourChoice colours{};
        ClassChoice classes{};
        bool has_fields = true; // false: their bytes are missing, and the next picture may have them
        bool operator==(const Setup &) const = default;
    };
    // What the setup needs of the model's fields and of its coarsest levels.
    struct Fields {
        std::optional<FieldColours> colours{};
        std::shared_ptr<const HiddenClasses> hidden{};
        bool has_one_colour = false;
    };
    // `bytes` must outlive the result. Throws Pending.
    static Result<std::unique_ptr<Drawing>> open(const FileBytes &bytes, const Setup &setup, Fields fields);

    const Setup &setup() const { return setup_; } // as asked for
    const Grid &grid() const { return model_.reader().parameters().grid; }

    struct Request {
        DetailView view;
        RenderOptions render;
        bool fine = false;
        int samples = kDefaultSamples;
        std::optional<DepthCue> depth_cue{};              // default: that of unasked_look
        std::optional<LightsFollow> lights_follow{};      // default: as Appearance has them
        std::optional<std::array<double, 2>> headlight{}; // as set_headlight
        bool legend = true;
    };
    DepthCue cue_of(const Request &request) const { return request.depth_cue.value_or(unasked_.depth_cue); }
    // Draws what is there and fits. `target` has depths if the cue needs them.
    //
    // errors  io  a callback failed: nothing is drawn
    Status draw(const Request &request, Framebuffer &target);
    // Why the last picture may lack something that has arrived.
    //
    // errors  memory  it needs more than allowed
    //         as StreamedModel::load and read_images: the first damage that any picture has met
    Status shortfall() const { return lacks_memory_ ? *lacks_memory_ : damage_ ? *damage_ : Status(); }
    void add_damage(Error error) { damage_ = damage_.value_or(std::move(error)); }

  private:
    Drawing(const FileBytes &bytes, Reader reader, const Setup &setup, Fields fields,
            const std::shared_ptr<ThreadPool> &pool);

    Status open_surroundings();
    Result<Detail> load(const DetailView &view);
    Appearance appearance(const Request &request) const;
    void render(const Detail &detail, const Request &request, Framebuffer &target);
    void render_fine(const Detail &detail, const Request &request, Framebuffer &target);

    const FileBytes &bytes_;
    const Setup setup_;
    const std::shared_ptr<ThreadPool> pool_;
    const Fields fields_;
    StreamedModel model_;
    const UnaskedLook unasked_;
    const ModelParameters drawn_;                      // as the renderers take them
    bool has_surroundings_ = false;                    // or they are damaged
    std::shared_ptr<const Surroundings> surroundings_; // refers to the model; null until its directories have arrived
    std::optional<FastRenderer> fast_;                 // created on first use
    std::optional<FineRenderer> fine_;

    // The fine picture that was drawn last: one of more samples goes on from there.
    struct FinePicture {
        DetailView view;
        RenderOptions options;
        Appearance appearance;
        bool with_depths = false;
        std::vector<std::shared_ptr<const void>> chunks;
        bool operator==(const FinePicture &) const = default;
    };
    std::optional<FinePicture> fine_picture_;
    std::optional<Error> damage_, lacks_memory_;
};

} // namespace pbm::c_api
