// The samples of a picture, summed. Its first sample lies at the centres of the pixels. More of them are needed only
// where the picture changes from pixel to pixel by more than a plane does; elsewhere the mean over a pixel is what its
// centre shows, corrected by the curvature of the light there.
// Based on: Whitted. An Improved Illumination Model for Shaded Display. 1980 (more samples where neighbours differ)
#pragma once

#include "pbm_render/fine/sampled_pixels.h"
#include "pbm_render/picture/framebuffer.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace pbm {

// Largest second difference, of the square roots of linear light 0..1, between pixels that one sample suffices for.
inline constexpr float kMaxCurvature = 1 / 20.0F;

class SampleSums {
  public:
    void begin(int width, int height) {
        width_ = width;
        height_ = height;
        sums_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
        chosen_.clear();
    }
    // Sums of light x alpha, and of alpha. A plain background is not part of them.
    std::span<Float4> row(int y) {
        return std::span(sums_).subspan(static_cast<std::size_t>(y) * static_cast<std::size_t>(width_),
                                        static_cast<std::size_t>(width_));
    }

    // Chooses the pixels that need more than their first sample, once all have it: begin_choice, and then `choose` for
    // all rows; threads may do so for different rows. behind(y): what a sample adds that meets nothing.
    bool has_choice() const { return !chosen_.empty(); }
    // `beside`: pixels beside them in a row are chosen, too.
    void begin_choice(bool beside) {
        chooses_beside_ = beside;
        chosen_.resize(width_, height_);
    }
    template <class Behind> void choose(int first, int end, const Behind &behind) {
        Rows rows(width_);
        const auto look = [&](int y) { look_at(y, behind(std::clamp(y, 0, height_ - 1)), rows); };
        look(first - 1);
        look(first);
        for (int y = first; y < end; ++y) {
            look(y + 1);
            choose_row(rows, y);
        }
    }
    const PixelBits &chosen() const { return chosen_; }

    // Calls visit(y, means) for rows first .. end - 1: the mean of `samples` samples of each pixel.
    template <class Visit> void for_each_row(int first, int end, int samples, const Visit &visit) const {
        Rows rows(width_);
        std::vector<Float4> means(static_cast<std::size_t>(width_));
        find_means(first - 1, samples, rows);
        find_means(first, samples, rows);
        for (int y = first; y < end; ++y) {
            find_means(y + 1, samples, rows);
            smooth_row(rows, y, means);
            visit(y, std::span<const Float4>(means));
        }
    }

  private:
    // Columns first .. end - 1.
    struct Columns {
        int first, end;
    };
    // Three rows around one; a pixel more on either side.
    struct Rows {
        explicit Rows(int of_width) : width(of_width) {
            for (std::vector<Float4> &row : rows)
                row.resize(static_cast<std::size_t>(width) + 2);
        }
        static std::size_t index(int y) { return static_cast<std::size_t>(y + 3) % 3; }
        const Float4 *pixels(int y) const { return rows[index(y)].data() + 1; }
        Float4 *pixels(int y) { return rows[index(y)].data() + 1; }
        // Columns beside which no pixel of the three rows has light, nor a pixel beside it.
        Columns lit_around() const;

        int width;
        std::array<std::vector<Float4>, 3> rows;
        std::array<Columns, 3> lit{}; // columns beside which a row has no light
    };
    const Float4 *sums_at(int y) const {
        return sums_.data() + static_cast<std::ptrdiff_t>(std::clamp(y, 0, height_ - 1)) * width_;
    }
    Columns lit_columns(int y) const;
    void look_at(int y, Float4 behind, Rows &to) const;
    void choose_row(const Rows &rows, int y);
    void find_means(int y, int samples, Rows &to) const;
    void smooth_row(const Rows &rows, int y, std::vector<Float4> &to) const;

    int width_ = 0, height_ = 0;
    PixelArray<Float4> sums_; // [height][width]
    bool chooses_beside_ = false;
    PixelBits chosen_; // empty: all pixels have all samples
};

} // namespace pbm
