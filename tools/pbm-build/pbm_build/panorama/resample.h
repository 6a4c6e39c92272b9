// Resamples equirectangular rasters: a tent filter in linear light, in integers.
#pragma once

#include "pbm_format/model/model.h"

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

namespace pbm::build {

// Resamples an equirectangular raster row by row. A texel is the mean of the source under a tent that extends to the
// centres of its neighbours in the coarser of the two rasters: downsampling does not alias, upsampling interpolates,
// equal sizes stay unchanged. Columns wrap around; the first and last rows are repeated. Integers only: the same bytes
// everywhere.
class PanoramaResampler {
  public:
    // All sides 1..65,536.
    PanoramaResampler(std::uint32_t from_width, std::uint32_t from_height, std::uint32_t width, std::uint32_t height);

    // The next row: [from_width][3], linear light 0..65,535.
    void add_row(std::span<const std::uint16_t> row);
    // When all rows have come: sRGB.
    Image finish();

  private:
    // Weights of source texels first, first + 1, ..., for one texel along one axis; their sum is 2^16.
    struct Taps {
        std::int64_t first = 0;
        std::vector<std::uint32_t> weights;
    };
    static std::vector<Taps> tent(std::uint32_t from, std::uint32_t to);
    void resample_row(std::span<const std::uint16_t> row);
    void emit_row(std::span<const std::uint64_t> sums);

    std::uint32_t from_width_, from_height_;
    std::vector<Taps> columns_, rows_;
    std::uint32_t next_row_ = 0;                  // of the source
    std::size_t first_open_ = 0;                  // row of the result
    std::deque<std::vector<std::uint64_t>> open_; // sums of rows first_open_, first_open_ + 1, ...
    std::vector<std::uint32_t> narrow_;           // the current row, [width][3]
    std::vector<std::uint8_t> srgb_;              // [65536]
    Image image_;
};

} // namespace pbm::build
