#include "pbm_scan/las/laz_fields.h"

namespace pbm::build {
namespace {

unsigned low_byte(unsigned value) { return value & 0xFF; }
unsigned high_byte(unsigned value) { return value >> 8 & 0xFF; }

unsigned clamped(int value) { return static_cast<unsigned>(std::clamp(value, 0, 255)); }

} // namespace

std::uint64_t GpsTimes::next(ArithmeticDecoder &in) {
    for (bool has_switched = false;; has_switched = true) {
        Sequence &now = sequences_[last_];
        const bool is_start = now.step == 0;
        unsigned code = is_start ? in.symbol(starts_) : in.symbol(multiples_);
        const unsigned first = is_start ? 0 : kCodeNew; // code of a repetition, if there may be one
        if (may_repeat_ && code >= first && code-- == first)
            return now.time;
        if (is_start && code-- == 0) {
            now.step = static_cast<std::int32_t>(steps_.next(in, 0, 0));
            now.time += static_cast<std::uint64_t>(std::int64_t{now.step});
            now.extremes = 0;
            return now.time;
        }
        if (code < first) {
            add_step(in, code);
            return now.time;
        }
        if (code == first) {
            start_sequence(in);
            return sequences_[last_].time;
        }
        if (has_switched) // encoders code a time in the sequence that they switch to
            in.damage();
        if (in.is_damaged())
            return now.time;
        last_ = (last_ + code - first) & 3;
    }
}

void GpsTimes::add_step(ArithmeticDecoder &in, unsigned code) {
    Sequence &now = sequences_[last_];
    constexpr std::uint32_t kMax = kMaxMultiple;
    const auto step = static_cast<std::uint32_t>(now.step);
    unsigned context = 0;
    std::uint32_t multiple = code;
    if (code > kMax)
        multiple = kMax - code; // -1 to -10
    if (code == 0)
        context = 7;
    else if (code == 1)
        context = 1;
    else if (code < kMax)
        context = code < 10 ? 2 : 3;
    else if (code == kMax)
        context = 4;
    else
        context = code - kMax < kMaxNegative ? 5 : 6;
    const auto real = static_cast<std::int32_t>(steps_.next(in, multiple * step, context));
    now.time += static_cast<std::uint64_t>(std::int64_t{real});
    if (code == 1) {
        now.extremes = 0;
    } else if (context == 7 || context == 4 || context == 6) {
        constexpr int kMaxExtremes = 3;
        if (++now.extremes > kMaxExtremes) {
            now.step = real;
            now.extremes = 0;
        }
    }
}

void GpsTimes::start_sequence(ArithmeticDecoder &in) {
    const auto last_high = static_cast<std::uint32_t>(sequences_[last_].time >> 32);
    const std::uint64_t high = steps_.next(in, last_high, 8);
    newest_ = (newest_ + 1) & 3;
    last_ = newest_;
    sequences_[last_] = {.time = high << 32 | in.bits(32)};
}

LazColour ColourModels::next(ArithmeticDecoder &in, const LazColour &last) {
    const unsigned changed = in.symbol(changed_);
    const auto correction = [&](unsigned channel, unsigned is_high) -> unsigned {
        const unsigned i = 2 * channel + is_high;
        return (changed >> i & 1) != 0 ? in.symbol(differences_[i]) : 0;
    };
    const auto byte = [](unsigned value, unsigned is_high) {
        return is_high != 0 ? high_byte(value) : low_byte(value);
    };
    const unsigned low = low_byte(low_byte(last[0]) + correction(0, 0));
    const unsigned red = low | low_byte(high_byte(last[0]) + correction(0, 1)) << 8;
    constexpr unsigned kIsNotGrey = 1 << 6;
    if ((changed & kIsNotGrey) == 0)
        return {static_cast<std::uint16_t>(red), static_cast<std::uint16_t>(red), static_cast<std::uint16_t>(red)};
    unsigned green = 0, blue = 0;
    for (const unsigned is_high : {0U, 1U}) { // green follows red, blue both
        const unsigned last_green = byte(last[1], is_high), last_blue = byte(last[2], is_high);
        int step = static_cast<int>(byte(red, is_high)) - static_cast<int>(byte(last[0], is_high));
        unsigned new_green = last_green, new_blue = last_blue;
        if ((changed >> (2 + is_high) & 1) != 0)
            new_green = low_byte(clamped(step + static_cast<int>(last_green)) + correction(1, is_high));
        if ((changed >> (4 + is_high) & 1) != 0) {
            step = (step + static_cast<int>(new_green) - static_cast<int>(last_green)) / 2;
            new_blue = low_byte(clamped(step + static_cast<int>(last_blue)) + correction(2, is_high));
        }
        green |= new_green << (8 * is_high);
        blue |= new_blue << (8 * is_high);
    }
    return {static_cast<std::uint16_t>(red), static_cast<std::uint16_t>(green), static_cast<std::uint16_t>(blue)};
}

std::uint16_t InfraredModels::next(ArithmeticDecoder &in, std::uint16_t last) {
    const unsigned changed = in.symbol(changed_);
    unsigned low = low_byte(last), high = high_byte(last);
    if ((changed & 1) != 0)
        low = low_byte(low + in.symbol(differences_[0]));
    if ((changed & 2) != 0)
        high = low_byte(high + in.symbol(differences_[1]));
    return static_cast<std::uint16_t>(high << 8 | low);
}

LazWave WaveModels::next(ArithmeticDecoder &in, const LazWave &last) {
    constexpr std::size_t kOffset = 1, kSize = 9, kReturnPoint = 13, kDirection = 17;
    LazWave wave{};
    wave[0] = static_cast<std::uint8_t>(in.symbol(indices_));
    const auto u32 = [&](std::size_t at) { return load<std::uint32_t>(last.data() + at); };
    auto offset = load<std::uint64_t>(last.data() + kOffset);
    last_code_ = in.symbol(offset_codes_[last_code_]);
    if (last_code_ == 1) {
        offset += u32(kSize);
    } else if (last_code_ == 2) {
        last_step_ = offset_steps_.next(in, last_step_);
        offset += static_cast<std::uint64_t>(std::int64_t{static_cast<std::int32_t>(last_step_)});
    } else if (last_code_ == 3) {
        offset = in.bits64();
    }
    store(wave.data() + kOffset, offset);
    store(wave.data() + kSize, sizes_.next(in, u32(kSize)));
    store(wave.data() + kReturnPoint, return_points_.next(in, u32(kReturnPoint)));
    for (unsigned axis = 0; axis < 3; ++axis) {
        const std::size_t at = kDirection + 4 * std::size_t{axis};
        store(wave.data() + at, directions_.next(in, u32(at), axis));
    }
    return wave;
}

} // namespace pbm::build
