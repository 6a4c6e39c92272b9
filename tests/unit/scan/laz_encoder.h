// An encoder of LAZ for tests. It shares no code with the decoder: models, predictions and contexts are written anew.
// Where several codes say the same (times), it takes one at random, so that every code occurs.
// Based on: Isenburg. LASzip: Lossless Compression of LiDAR Data. 2013
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace pbm::test {

class LazModel {
  public:
    explicit LazModel(unsigned symbols) : counts_(symbols, 1), cycle_(symbols) {
        update();
        left_ = cycle_ = (symbols + 6) / 2;
    }
    // Of 2^15; the interval of the last symbol ends where the whole one does.
    std::uint32_t bound(unsigned symbol) const { return bounds_[symbol]; }
    bool is_last(unsigned symbol) const { return symbol + 1 == counts_.size(); }
    void count(unsigned symbol) {
        ++counts_.at(symbol);
        if (--left_ == 0)
            update();
    }

  private:
    void update() {
        if ((total_ += cycle_) > 32768) {
            total_ = 0;
            for (std::uint32_t &count : counts_)
                total_ += count = (count + 1) / 2;
        }
        const std::uint32_t scale = 0x80000000U / total_;
        std::uint32_t sum = 0;
        bounds_.clear();
        for (const std::uint32_t count : counts_) {
            bounds_.push_back(scale * sum >> 16);
            sum += count;
        }
        const auto size = static_cast<std::uint32_t>(counts_.size());
        left_ = cycle_ = std::min(cycle_ * 5 / 4, 8 * (size + 6));
    }

    std::vector<std::uint32_t> counts_, bounds_;
    std::uint32_t total_ = 0, cycle_, left_ = 0;
};

struct LazBitModel {
    std::uint32_t zeros = 1, total = 2, bound = 4096, cycle = 4, left = 4;
    void count(unsigned bit) {
        zeros += bit == 0 ? 1 : 0;
        if (--left != 0)
            return;
        if ((total += cycle) > 8192) {
            total = (total + 1) / 2;
            zeros = (zeros + 1) / 2;
            total += zeros == total ? 1 : 0;
        }
        bound = 0x80000000U / total * zeros >> 18;
        left = cycle = std::min(cycle * 5 / 4, 64U);
    }
};

class LazEncoder {
  public:
    void symbol(LazModel &model, unsigned symbol) {
        const std::uint32_t unit = length_ >> 15, begin = model.bound(symbol) * unit;
        const std::uint32_t length = model.is_last(symbol) ? length_ - begin : model.bound(symbol + 1) * unit - begin;
        narrow(begin, length);
        model.count(symbol);
    }
    void bit(LazBitModel &model, unsigned bit) {
        const std::uint32_t bound = model.bound * (length_ >> 13);
        bit == 0 ? narrow(0, bound) : narrow(bound, length_ - bound);
        model.count(bit);
    }
    void bits(unsigned count, std::uint32_t value) {
        if (count > 19) {
            bits(16, value & 0xFFFF);
            return bits(count - 16, value >> 16);
        }
        narrow(value * (length_ >> count), length_ >> count);
    }
    std::string finish() {
        const bool is_wide = length_ > 1U << 25;
        is_wide ? narrow(1U << 24, 1U << 23) : narrow(1U << 23, 1U << 15);
        return bytes_ + std::string(is_wide ? 3 : 2, '\0');
    }

  private:
    void narrow(std::uint32_t begin, std::uint32_t length) {
        const std::uint64_t base = std::uint64_t{base_} + begin;
        if (base >> 32 != 0)
            for (std::size_t i = bytes_.size(); i-- > 0 && static_cast<std::uint8_t>(++bytes_[i]) == 0;) {
            }
        base_ = static_cast<std::uint32_t>(base);
        for (length_ = length; length_ < 1U << 24; length_ <<= 8, base_ <<= 8)
            bytes_ += static_cast<char>(base_ >> 24);
    }

    std::string bytes_;
    std::uint32_t base_ = 0, length_ = 0xFFFFFFFFU;
};

class LazIntegers {
  public:
    explicit LazIntegers(unsigned bits, unsigned contexts = 1)
        : bits_(bits), magnitudes_(contexts, LazModel(bits + 1)) {}

    void next(LazEncoder &out, std::uint32_t prediction, std::uint32_t value, unsigned context = 0) {
        auto c = static_cast<std::int64_t>(value) - static_cast<std::int64_t>(prediction);
        const std::int64_t range = std::int64_t{1} << bits_;
        c = ((c % range) + range) % range;
        c = c >= range / 2 ? c - range : c;
        magnitude = 0;
        while (c < 1 - (std::int64_t{1} << magnitude) || c > std::int64_t{1} << magnitude)
            ++magnitude;
        out.symbol(magnitudes_.at(context), magnitude);
        if (magnitude == 0)
            return out.bit(zero_or_one_, static_cast<unsigned>(c));
        if (magnitude == 32)
            return;
        const auto code = static_cast<std::uint32_t>(c < 0 ? c + (std::int64_t{1} << magnitude) - 1 : c - 1);
        const unsigned low = magnitude > 8 ? magnitude - 8 : 0;
        LazModel &model = corrections_.try_emplace(magnitude, 1U << (magnitude - low)).first->second;
        out.symbol(model, code >> low);
        if (low != 0)
            out.bits(low, code & ((1U << low) - 1));
    }
    unsigned magnitude = 0; // of the last correction

  private:
    unsigned bits_;
    std::vector<LazModel> magnitudes_;
    std::map<unsigned, LazModel> corrections_;
    LazBitModel zero_or_one_;
};

// Models that are made on first use.
class LazModels {
  public:
    explicit LazModels(unsigned symbols) : symbols_(symbols) {}
    LazModel &operator[](unsigned context) { return models_.try_emplace(context, symbols_).first->second; }

  private:
    unsigned symbols_;
    std::map<unsigned, LazModel> models_;
};

// Of five values: in turn the highest and the lowest make room.
class LazMedian {
  public:
    std::uint32_t get() const { return static_cast<std::uint32_t>(values_[2]); }
    void add(std::uint32_t difference) {
        const auto value = static_cast<std::int32_t>(difference);
        const std::int32_t median = values_[2];
        values_.erase(drops_highest_ ? values_.end() - 1 : values_.begin());
        values_.insert(std::upper_bound(values_.begin(), values_.end(), value), value);
        drops_highest_ = drops_highest_ ? value < median : value <= median;
    }

  private:
    std::vector<std::int32_t> values_ = std::vector<std::int32_t>(5);
    bool drops_highest_ = true;
};

template <class T> T field(const std::string &record, std::size_t at) {
    T value{};
    std::memcpy(&value, record.data() + at, sizeof value);
    return value;
}
inline unsigned byte(const std::string &record, std::size_t at) { return static_cast<std::uint8_t>(record[at]); }

inline unsigned laz_context(unsigned magnitude, unsigned largest, bool is_single) {
    return (magnitude < largest ? magnitude / 2 * 2 : largest) + (is_single ? 1 : 0);
}

// Times of the second and third generation.
class LazTimes {
  public:
    LazTimes(std::uint64_t first, bool may_repeat)
        : repeats_(may_repeat ? 1 : 0), starts_(5 + repeats_), multiples_(515 + repeats_) {
        times_[0] = first;
    }
    void next(LazEncoder &out, std::uint64_t time) {
        if (repeats_ != 0 && time == times_[now_])
            return code(out, 0, 511);
        if (!fits(now_, time)) {
            for (unsigned i = 1; i < 4; ++i)
                if (fits((now_ + i) % 4, time)) {
                    code(out, 1 + i + repeats_, 511 + i + repeats_);
                    now_ = (now_ + i) % 4;
                    return repeats_ != 0 && time == times_[now_] ? code(out, 0, 511) : step_to(out, time);
                }
            code(out, 1 + repeats_, 511 + repeats_);
            steps_.next(out, static_cast<std::uint32_t>(times_[now_] >> 32), static_cast<std::uint32_t>(time >> 32), 8);
            out.bits(32, static_cast<std::uint32_t>(time));
            now_ = newest_ = (newest_ + 1) % 4;
            step_[now_] = 0;
            extremes_[now_] = 0;
            times_[now_] = time;
            return;
        }
        step_to(out, time);
    }

  private:
    bool fits(unsigned sequence, std::uint64_t time) const {
        const auto step = static_cast<std::int64_t>(time - times_[sequence]);
        return step == static_cast<std::int32_t>(step);
    }
    void code(LazEncoder &out, unsigned at_start, unsigned later) {
        step_[now_] == 0 ? out.symbol(starts_, at_start) : out.symbol(multiples_, later);
    }
    void step_to(LazEncoder &out, std::uint64_t time) {
        const auto step = static_cast<std::uint32_t>(time - times_[now_]);
        times_[now_] = time;
        auto &last = step_[now_];
        auto &extremes = extremes_[now_];
        if (last == 0) {
            out.symbol(starts_, repeats_);
            steps_.next(out, 0, step, 0);
            last = static_cast<std::int32_t>(step);
            extremes = 0;
            return;
        }
        const std::array<unsigned, 9> some{0, 1, 2, 9, 10, 499, 500, 501, 510};
        const unsigned multiple = random_() % 2 == 0 ? 1 : some[random_() % some.size()];
        out.symbol(multiples_, multiple);
        const int factor = multiple <= 500 ? static_cast<int>(multiple) : 500 - static_cast<int>(multiple);
        const unsigned context = factor == 0     ? 7
                                 : factor == 1   ? 1
                                 : factor == 500 ? 4
                                 : factor == -10 ? 6
                                 : factor < 0    ? 5
                                 : factor < 10   ? 2
                                                 : 3;
        steps_.next(out, static_cast<std::uint32_t>(factor) * static_cast<std::uint32_t>(last), step, context);
        if (factor == 1)
            extremes = 0;
        else if ((factor == 0 || factor == 500 || factor == -10) && ++extremes > 3) {
            last = static_cast<std::int32_t>(step);
            extremes = 0;
        }
    }

    unsigned repeats_;
    LazModel starts_, multiples_;
    LazIntegers steps_{32, 9};
    std::array<std::uint64_t, 4> times_{};
    std::array<std::int32_t, 4> step_{};
    std::array<int, 4> extremes_{};
    unsigned now_ = 0, newest_ = 0;
    std::mt19937 random_{7};
};

// Colours of the second and third generation: R, G, B of 16 bits at `at`.
class LazColours {
  public:
    void next(LazEncoder &out, const std::string &last, const std::string &now, std::size_t at) {
        const auto part = [&](const std::string &record, unsigned i) { return static_cast<int>(byte(record, at + i)); };
        unsigned changed =
            now.substr(at, 2) != now.substr(at + 2, 2) || now.substr(at, 2) != now.substr(at + 4, 2) ? 64U : 0U;
        for (unsigned i = 0; i < 6; ++i)
            changed |= part(last, i) != part(now, i) ? 1U << i : 0U;
        out.symbol(changed_, changed);
        const auto write = [&](unsigned i, int prediction) {
            if ((changed >> i & 1) != 0)
                out.symbol(models_[i], static_cast<std::uint8_t>(part(now, i) - prediction));
        };
        write(0, part(last, 0));
        write(1, part(last, 1));
        for (unsigned high = 0; high < 2 && changed >= 64; ++high) {
            const int red = part(now, high) - part(last, high), green = part(now, 2 + high) - part(last, 2 + high);
            write(2 + high, std::clamp(red + part(last, 2 + high), 0, 255));
            write(4 + high, std::clamp((red + green) / 2 + part(last, 4 + high), 0, 255));
        }
    }

  private:
    LazModel changed_{128};
    LazModels models_{256};
};

class LazInfrared {
  public:
    void next(LazEncoder &out, const std::string &last, const std::string &now, std::size_t at) {
        const unsigned changed = (last[at] != now[at] ? 1U : 0U) | (last[at + 1] != now[at + 1] ? 2U : 0U);
        out.symbol(changed_, changed);
        for (unsigned i = 0; i < 2; ++i)
            if ((changed >> i & 1) != 0)
                out.symbol(models_[i], static_cast<std::uint8_t>(now[at + i] - last[at + i]));
    }

  private:
    LazModel changed_{4};
    LazModels models_{256};
};

class LazWaves {
  public:
    void next(LazEncoder &out, const std::string &last, const std::string &now, std::size_t at) {
        out.symbol(indices_, byte(now, at));
        const auto step =
            static_cast<std::int64_t>(field<std::uint64_t>(now, at + 1) - field<std::uint64_t>(last, at + 1));
        const auto size = field<std::uint32_t>(last, at + 9);
        const unsigned code = step == 0 ? 0 : step == size ? 1 : step == static_cast<std::int32_t>(step) ? 2 : 3;
        out.symbol(codes_[code_], code);
        code_ = code;
        if (code == 2) {
            steps_.next(out, last_step_, static_cast<std::uint32_t>(step));
            last_step_ = static_cast<std::uint32_t>(step);
        } else if (code == 3) {
            out.bits(32, field<std::uint32_t>(now, at + 1));
            out.bits(32, field<std::uint32_t>(now, at + 5));
        }
        const auto write = [&](LazIntegers &integers, std::size_t offset, unsigned context) {
            integers.next(out, field<std::uint32_t>(last, at + offset), field<std::uint32_t>(now, at + offset),
                          context);
        };
        write(sizes_, 9, 0);
        write(returns_, 13, 0);
        for (unsigned axis = 0; axis < 3; ++axis)
            write(directions_, 17 + 4 * axis, axis);
    }

  private:
    LazModel indices_{256};
    LazModels codes_{4};
    LazIntegers steps_{32}, sizes_{32}, returns_{32}, directions_{32, 3};
    std::uint32_t last_step_ = 0;
    unsigned code_ = 0;
};

class LazBytes {
  public:
    void next(LazEncoder &out, const std::string &last, const std::string &now, std::size_t at) {
        out.symbol(model_, static_cast<std::uint8_t>(now[at] - last[at]));
    }

  private:
    LazModel model_{256};
};

} // namespace pbm::test
