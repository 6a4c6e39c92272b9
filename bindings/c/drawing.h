// Draws an open model, and keeps decoded chunks and renderers for its next picture.
#pragma once

#include "model.h"

#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/surroundings/surroundings.h"
#include "system/threads/thread_pool.h"

#include <memory>
#include <optional>

namespace pbm::c_api {

class Drawing {
  public:
    // `bytes` must outlive the result.
    static Result<std::unique_ptr<Drawing>> open(const FileBytes &bytes, int threads);

    int threads() const { return threads_; } // as asked for
    const Grid &grid() const { return model_.reader().parameters().grid; }

    // errors  as StreamedModel::bounds
    Result<Extent> bounds();

    struct Request {
        DetailView view;
        RenderOptions render;
        bool fine = false;
        int samples = kDefaultSamples;
        int depth_cue = PBM_NO_CUE;
    };
    // `target` has depths if the cue needs them.
    //
    // errors  as StreamedModel::load; a damaged tile of a raster
    Status draw(const Request &request, Framebuffer &target);

  private:
    Drawing(const FileBytes &bytes, Reader reader, TiledImages images, int threads,
            const std::shared_ptr<ThreadPool> &pool);

    Status fetch(std::span<const FileRange> ranges) const;
    Result<Detail> load(const DetailView &view);
    void render(const Detail &detail, const Request &request, Framebuffer &target);

    const FileBytes &bytes_;
    const int threads_;
    const std::shared_ptr<ThreadPool> pool_;
    StreamedModel model_;
    const std::shared_ptr<const Surroundings> surroundings_; // refers to the model
    std::optional<FastRenderer> fast_;                       // created on first use
    std::optional<FineRenderer> fine_;
};

} // namespace pbm::c_api
