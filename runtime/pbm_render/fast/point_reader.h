// Reads the attributes that shading needs, for the points that a row of pixels shows, from the streams of their chunks.
#pragma once

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/bricks/drawn_runs.h"
#include "pbm_render/bricks/frame_geometry.h"
#include "pbm_render/bricks/shadow_stream.h"
#include "pbm_render/fast/strip_pixels.h"
#include "pbm_render/shading/point_shader.h"
#include "pbm_render/shading/surface_shader.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pbm {

// How the points of a frame are shaded.
struct ShadedFrame {
    const FrameGeometry &geometry;
    const Appearance &appearance;
    const PointShader &shader;
    const PointLighting &lighting;
};

class PointReader {
  public:
    // Lists the streams of a frame's runs. Their chunks must stay resident while the frame is drawn.
    void begin(const ModelParameters &parameters, const Appearance &appearance, const DrawnRuns &runs);

    // Reads the points of row `y` of the picture. If their colours depend on their normals alone, `row` gets the
    // colours of the pixels. Several threads may call this at once.
    void read(const CoveredPixels &pixels, int y, const ShadedFrame &frame, PointRow &row) const;

  private:
    // Streams of a run's chunk, in one struct since every pixel reads them.
    struct Streams {
        const std::uint16_t *normals;
        const std::uint8_t *colours, *materials, *indices; // null: the model lacks the stream
        std::array<ShadowStream, kMaxLights> shadows;
    };

    // Addresses of adjacent points of a row. Batches are small, so that data which one loop prefetches is still cached
    // in the next loop.
    struct Batch {
        static constexpr std::size_t kPoints = 32;
        std::size_t first = 0, count = 0; // in the row
        std::array<const Streams *, kPoints> from;
        std::array<std::uint32_t, kPoints> point; // of the chunk
        const std::int32_t *ids;

        // Stored normal of the visible side.
        std::uint16_t normal(std::size_t i) const {
            const std::size_t turn = PointIds::is_back(static_cast<std::uint32_t>(ids[i])) ? kOppositeNormal : 0;
            return static_cast<std::uint16_t>(from[i]->normals[point[i]] ^ turn);
        }
    };

    void locate(const CoveredPixels &pixels, std::size_t first, std::size_t shadowed, Batch &to) const;
    void read_batch(const Batch &batch, const ShadedFrame &frame, PointRow &row) const;
    void read_colours(const Batch &batch, const ShadedFrame &frame, std::uint32_t *to) const;
    void read_by_normal(const Batch &batch, const CoveredPixels &pixels, int y, const ShadedFrame &frame,
                        PointRow &row) const;
    std::size_t material(const Streams &from, std::uint32_t point) const {
        return from.materials != nullptr ? std::min<std::size_t>(from.materials[point], last_material_) : 0;
    }

    PointIds ids_{};
    std::size_t colour_bytes_ = 0, last_material_ = 0;
    std::vector<Streams> streams_; // [runs]
};

} // namespace pbm
