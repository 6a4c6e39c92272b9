// Fields of LAZ points that both generations of records share: times, colours, waveforms; their models and predictions.
// Based on: Isenburg. LASzip: Lossless Compression of LiDAR Data. 2013
#pragma once

#include "pbm_scan/las/arithmetic_decoder.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>

namespace pbm::build {

// Models that are made when they are first used: most contexts never are.
template <unsigned Symbols, unsigned Contexts> class ModelsOnDemand {
  public:
    SymbolModel<Symbols> &operator[](unsigned context) {
        std::unique_ptr<SymbolModel<Symbols>> &model = models_[context];
        if (!model)
            model = std::make_unique<SymbolModel<Symbols>>();
        return *model;
    }

  private:
    std::array<std::unique_ptr<SymbolModel<Symbols>>, Contexts> models_;
};

// A running median: of five values in order, in turn the highest and the lowest make room for the next one.
class MedianOfFive {
  public:
    std::uint32_t get() const { return static_cast<std::uint32_t>(values_[2]); }
    void add(std::uint32_t difference) {
        const auto value = static_cast<std::int32_t>(difference);
        const std::int32_t median = values_[2];
        const std::size_t first = drops_highest_ ? 0 : 1; // of the four that stay
        const std::int32_t a = values_[first], b = values_[first + 1], c = values_[first + 2], d = values_[first + 3];
        values_ = {std::min(a, value), std::max(a, std::min(b, value)), std::max(b, std::min(c, value)),
                   std::max(c, std::min(d, value)), std::max(d, value)};
        drops_highest_ = drops_highest_ ? value < median : value <= median;
    }

  private:
    std::array<std::int32_t, 5> values_{}; // ascending
    bool drops_highest_ = true;
};

// The context of a magnitude among `contexts`, which must be even: pairs of magnitudes, and whether the pulse has one
// return.
inline unsigned magnitude_context(unsigned magnitude, unsigned contexts, bool is_single) {
    return std::min(magnitude & ~1U, contexts - 2) + (is_single ? 1 : 0);
}

// GPS times as 64-bit patterns, of up to four interleaved sequences with steps of their own.
class GpsTimes {
  public:
    // `may_repeat`: whether a code says that the time is the last one. In layered chunks another layer says so.
    GpsTimes(std::uint64_t first, bool may_repeat)
        : starts_(may_repeat ? 6 : 5), multiples_(kCodeNew + (may_repeat ? 5 : 4)), may_repeat_(may_repeat) {
        sequences_[0].time = first;
    }
    std::uint64_t next(ArithmeticDecoder &in);

  private:
    // Multiples of the last step: 0 to 500 for themselves, 501 to 510 for -1 to -10. Beyond: a repetition, if there may
    // be one; a new sequence; one of the three others.
    static constexpr unsigned kMaxMultiple = 500, kMaxNegative = 10, kCodeNew = kMaxMultiple + kMaxNegative + 1;

    struct Sequence {
        std::uint64_t time = 0;
        std::int32_t step = 0;
        int extremes = 0; // since the step was set: steps for which it is no help
    };
    void add_step(ArithmeticDecoder &in, unsigned code);
    void start_sequence(ArithmeticDecoder &in);

    std::array<Sequence, 4> sequences_;
    unsigned last_ = 0, newest_ = 0;
    SymbolModel<6> starts_; // of sequences whose step is 0
    SymbolModel<kCodeNew + 5> multiples_;
    IntegerDecoder<32, 9> steps_;
    bool may_repeat_;
};

using LazColour = std::array<std::uint16_t, 3>;

class ColourModels {
  public:
    LazColour next(ArithmeticDecoder &in, const LazColour &last);

  private:
    SymbolModel<128> changed_;
    std::array<SymbolModel<256>, 6> differences_; // low and high byte of red, green, blue
};

class InfraredModels {
  public:
    std::uint16_t next(ArithmeticDecoder &in, std::uint16_t last);

  private:
    SymbolModel<4> changed_;
    std::array<SymbolModel<256>, 2> differences_; // low and high byte
};

using LazWave = std::array<std::uint8_t, 29>;

class WaveModels {
  public:
    LazWave next(ArithmeticDecoder &in, const LazWave &last);

  private:
    SymbolModel<256> indices_;
    std::array<SymbolModel<4>, 4> offset_codes_; // [last code]
    IntegerDecoder<32> offset_steps_, sizes_, return_points_;
    IntegerDecoder<32, 3> directions_;
    std::uint32_t last_step_ = 0;
    unsigned last_code_ = 0;
};

} // namespace pbm::build
