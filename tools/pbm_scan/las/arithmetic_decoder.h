// The arithmetic decoder of LAZ, and its adaptive models of symbols, bits and integers.
// Based on: Said. Introduction to Arithmetic Coding - Theory and Practice. HPL-2004-76, 2004 (FastAC)
//           Isenburg. LASzip: Lossless Compression of LiDAR Data. 2013
#pragma once

#include "system/bytes.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

namespace pbm::build {

// Adaptive frequencies of the symbols 0 to `symbols` - 1; 2 <= symbols <= Capacity.
template <unsigned Capacity> class SymbolModel {
  public:
    explicit SymbolModel(unsigned symbols = Capacity) : symbols_(symbols), cycle_(symbols) {
        unsigned bits = 1;
        while (bits < kMaxBucketBits && (1U << bits) < symbols)
            ++bits;
        shift_ = kScaleBits - bits;
        std::fill_n(counts_.begin(), symbols, std::uint16_t{1});
        update();
        left_ = cycle_ = (symbols + 6) >> 1;
    }

  private:
    friend class ArithmeticDecoder;
    static constexpr unsigned kScaleBits = 15, kMaxTotal = 1U << kScaleBits;
    static constexpr unsigned kMaxBucketBits = 6;
    static constexpr std::uint16_t kNoBound = 0xFFFF;

    // The symbol whose interval holds `scaled`, which is less than kMaxTotal + 64: the decoder divides by a rounded
    // length of at least 512. The first step is without a branch, since nothing predicts it.
    unsigned find(std::uint32_t scaled) const {
        unsigned symbol = buckets_[scaled >> shift_];
        symbol += bounds_[symbol + 1] <= scaled ? 1 : 0;
        while (bounds_[symbol + 1] <= scaled)
            ++symbol;
        return symbol;
    }

    void count(unsigned symbol) {
        ++counts_[symbol];
        if (--left_ == 0)
            update();
    }

    // Computes the bounds from the counts. The counts are halved when their sum passes kMaxTotal.
    [[gnu::noinline]] void update() {
        total_ += cycle_;
        if (total_ > kMaxTotal) {
            total_ = 0;
            for (unsigned i = 0; i < symbols_; ++i)
                total_ += counts_[i] = static_cast<std::uint16_t>((counts_[i] + 1U) >> 1);
        }
        const std::uint32_t scale = (1U << 31) / total_;
        std::uint32_t sum = 0;
        unsigned bucket = 0;
        for (unsigned i = 0; i < symbols_; ++i) {
            bounds_[i] = static_cast<std::uint16_t>((scale * sum) >> (31 - kScaleBits));
            sum += counts_[i];
            for (; bucket << shift_ < bounds_[i]; ++bucket)
                buckets_[bucket] = static_cast<std::uint16_t>(i - 1);
        }
        for (; bucket <= (kMaxTotal >> shift_) + 1; ++bucket)
            buckets_[bucket] = static_cast<std::uint16_t>(symbols_ - 1);
        bounds_[symbols_] = kNoBound;
        cycle_ = std::min((5 * cycle_) >> 2, (symbols_ + 6) << 3);
        left_ = cycle_;
    }

    std::uint32_t symbols_, cycle_, left_ = 0, total_ = 0, shift_ = 0;
    std::array<std::uint16_t, Capacity + 1> bounds_; // where the interval of each symbol begins, of 2^15; ascending
    std::array<std::uint16_t, Capacity> counts_;     // >= 1
    std::array<std::uint16_t, std::min(2 * Capacity, 1U << kMaxBucketBits) + 2> buckets_; // symbol at bucket << shift_
};

class BitModel {
    friend class ArithmeticDecoder;
    static constexpr unsigned kScaleBits = 13, kMaxTotal = 1U << kScaleBits;

    void update() {
        total_ += cycle_;
        if (total_ > kMaxTotal) {
            total_ = (total_ + 1) >> 1;
            zeros_ = (zeros_ + 1) >> 1;
            total_ += zeros_ == total_ ? 1 : 0;
        }
        bound_ = (zeros_ * ((1U << 31) / total_)) >> (31 - kScaleBits);
        cycle_ = std::min((5 * cycle_) >> 2, 64U);
        left_ = cycle_;
    }

    std::uint32_t zeros_ = 1, total_ = 2, cycle_ = 4, left_ = 4;
    std::uint32_t bound_ = 1U << (kScaleBits - 1); // of 2^13: where the interval of 1 begins
};

// Reads symbols from `bytes`, which are untrusted: whatever they hold, symbols are those of the model and no byte
// outside is read. Damage shows in is_damaged() and bytes_left() afterwards.
class ArithmeticDecoder {
  public:
    ArithmeticDecoder() = default;
    explicit ArithmeticDecoder(ByteView bytes) : at_(bytes.data()), end_(bytes.data() + bytes.size()) {
        for (int i = 0; i < 4; ++i)
            value_ = value_ << 8 | next_byte();
        if (value_ >= length_) // an interval never holds its end; all else relies on value_ < length_
            damage();
    }

    template <unsigned Capacity> [[gnu::always_inline]] unsigned symbol(SymbolModel<Capacity> &model) {
        const std::uint32_t unit = length_ >> SymbolModel<Capacity>::kScaleBits;
        const unsigned symbol = model.find(value_ / unit);
        const std::uint32_t begin = model.bounds_[symbol] * unit;
        length_ = (symbol + 1 < model.symbols_ ? model.bounds_[symbol + 1] * unit : length_) - begin;
        value_ -= begin;
        refill();
        model.count(symbol);
        return symbol;
    }

    unsigned bit(BitModel &model) {
        const std::uint32_t bound = model.bound_ * (length_ >> BitModel::kScaleBits);
        const unsigned bit = value_ >= bound ? 1 : 0;
        if (bit == 0) {
            length_ = bound;
            ++model.zeros_;
        } else {
            value_ -= bound;
            length_ -= bound;
        }
        refill();
        if (--model.left_ == 0)
            model.update();
        return bit;
    }

    // `count` bits that are equally likely; 1 <= count <= 32.
    std::uint32_t bits(unsigned count) {
        constexpr unsigned kMax = 19;
        if (count > kMax) {
            const std::uint32_t low = bits(16);
            return bits(count - 16) << 16 | low;
        }
        length_ >>= count;
        const std::uint32_t bits = value_ / length_;
        value_ -= length_ * bits;
        if (bits >> count != 0)
            is_damaged_ = true;
        refill();
        return bits;
    }
    std::uint64_t bits64() {
        const std::uint64_t low = bits(32);
        return std::uint64_t{bits(32)} << 32 | low;
    }

    void damage() {
        is_damaged_ = true;
        value_ = 0;
    }
    // More was read than there is, or what no encoder writes.
    bool is_damaged() const { return is_damaged_; }
    std::size_t bytes_left() const { return static_cast<std::size_t>(end_ - at_); }

  private:
    static constexpr std::uint32_t kMinLength = 1U << 24;

    std::uint32_t next_byte() {
        if (at_ != end_)
            return *at_++;
        is_damaged_ = true;
        return 0;
    }
    void refill() {
        while (length_ < kMinLength) {
            value_ = value_ << 8 | next_byte();
            length_ <<= 8;
        }
    }

    const std::uint8_t *at_ = nullptr, *end_ = nullptr;
    std::uint32_t value_ = 0, length_ = 0xFFFFFFFFU; // value_ < length_
    bool is_damaged_ = false;
};

// Integers of `Bits` bits, as corrections of predictions. `Contexts`: of the magnitude of the corrections.
template <unsigned Bits, unsigned Contexts = 1> class IntegerDecoder {
  public:
    using Magnitudes = SymbolModel<Bits + 1>;

    // Modulo 2^Bits.
    std::uint32_t next(ArithmeticDecoder &in, std::uint32_t prediction, Magnitudes &context) {
        constexpr std::uint32_t kMask = 0xFFFFFFFFU >> (32 - Bits);
        return (prediction + correction(in, context)) & kMask;
    }
    std::uint32_t next(ArithmeticDecoder &in, std::uint32_t prediction, unsigned context = 0) {
        return next(in, prediction, magnitudes_[context]);
    }
    // Bits of the last correction: 0 to Bits.
    unsigned magnitude() const { return magnitude_; }

  private:
    static constexpr unsigned kHighBits = 8; // bits below these are equally likely

    // Of magnitude m: one of -(2^m - 1) to -2^(m-1), or of 2^(m-1) + 1 to 2^m. Of magnitude 0: 0 or 1.
    std::uint32_t correction(ArithmeticDecoder &in, Magnitudes &context) {
        const unsigned m = magnitude_ = in.symbol(context);
        if (m == 0)
            return in.bit(zero_or_one_);
        if (m == 32)
            return 1U << 31;
        std::unique_ptr<SymbolModel<256>> &model = corrections_[m - 1];
        if (!model)
            model = std::make_unique<SymbolModel<256>>(1U << std::min(m, kHighBits));
        std::uint32_t c = in.symbol(*model);
        if (m > kHighBits) {
            const unsigned low = m - kHighBits;
            c = c << low | in.bits(low);
        }
        return c >= 1U << (m - 1) ? c + 1 : c - ((1U << m) - 1);
    }

    std::array<Magnitudes, Contexts> magnitudes_;
    std::array<std::unique_ptr<SymbolModel<256>>, std::min(Bits, 31U)>
        corrections_; // [magnitude - 1]; made on first use
    BitModel zero_or_one_;
    unsigned magnitude_ = 0;
};

} // namespace pbm::build
