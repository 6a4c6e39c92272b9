// LAZ files made of the records of LAS files, for tests.
#pragma once

#include "unit/scan/laz_encoder.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace pbm::test {

struct LazKind {
    unsigned format = 0, version = 2;  // of all items: 1 or 2; 3 or 4 from format 6 on
    std::vector<unsigned> chunks = {}; // points of each; empty: one code without chunks (formats 0 to 5)
    bool are_equal = false;            // chunks but the last have chunks[0] points, and the table does not say them
    std::size_t extra = 0;             // bytes of a record behind those of the format
    std::uint32_t options = 0;         // kNoTable, kTableAtEnd
    static constexpr std::uint32_t kNoTable = 1, kTableAtEnd = 2;
};

inline std::size_t las_record_size(unsigned format) {
    constexpr std::array<std::size_t, 11> kSizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
    return kSizes.at(format);
}
inline bool has_time11(unsigned format) { return format == 1 || (format >= 3 && format <= 5); }
inline bool has_colour(unsigned format) {
    return format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10;
}
inline bool has_infrared(unsigned format) { return format == 8 || format == 10; }
inline bool has_wave(unsigned format) { return format == 4 || format == 5 || format == 9 || format == 10; }

struct LazItemText {
    std::uint16_t type, size;
};
inline std::vector<LazItemText> laz_items(const LazKind &kind) {
    const bool is_new = kind.format >= 6;
    std::vector<LazItemText> items{is_new ? LazItemText{10, 30} : LazItemText{6, 20}};
    if (has_time11(kind.format))
        items.push_back({7, 8});
    if (has_infrared(kind.format))
        items.push_back({12, 8});
    else if (has_colour(kind.format))
        items.push_back({static_cast<std::uint16_t>(is_new ? 11 : 8), 6});
    if (has_wave(kind.format))
        items.push_back({static_cast<std::uint16_t>(is_new ? 13 : 9), 29});
    if (kind.extra != 0)
        items.push_back({static_cast<std::uint16_t>(is_new ? 14 : 0), static_cast<std::uint16_t>(kind.extra)});
    return items;
}

// Formats 0 to 5.
class LazPoint10 {
  public:
    LazPoint10(const LazKind &kind, const std::string &first)
        : kind_(kind), time_(field<std::uint64_t>(first + std::string(8, '\0'), 20)), times_(time_, true) {}

    void next(LazEncoder &out, const std::string &last, const std::string &now) {
        kind_.version == 1 ? point_v1(out, last, now) : point_v2(out, last, now);
        std::size_t at = 20;
        if (has_time11(kind_.format)) {
            kind_.version == 1 ? time_v1(out, field<std::uint64_t>(now, at))
                               : times_.next(out, field<std::uint64_t>(now, at));
            at += 8;
        }
        if (has_colour(kind_.format)) {
            kind_.version == 1 ? colour_v1(out, last, now, at) : colours_.next(out, last, now, at);
            at += 6;
        }
        if (has_wave(kind_.format)) {
            waves_.next(out, last, now, at);
            at += 29;
        }
        for (std::size_t i = 0; i < kind_.extra; ++i)
            if (kind_.version == 1)
                byte_v1_.next(out, byte(last, at + i), byte(now, at + i), static_cast<unsigned>(i));
            else
                bytes_[i].next(out, last, now, at + i);
    }

  private:
    static std::uint32_t median(const std::array<std::int32_t, 3> &steps) {
        auto sorted = steps;
        std::sort(sorted.begin(), sorted.end());
        return static_cast<std::uint32_t>(sorted[1]);
    }
    static std::uint32_t difference(const std::string &last, const std::string &now, std::size_t at) {
        return field<std::uint32_t>(now, at) - field<std::uint32_t>(last, at);
    }

    void point_v1(LazEncoder &out, const std::string &last, const std::string &now) {
        const std::uint32_t dx = difference(last, now, 0), dy = difference(last, now, 4);
        dx_.next(out, median(steps_x_), dx);
        dy_.next(out, median(steps_y_), dy, std::min(dx_.magnitude, 19U));
        const unsigned magnitude = (dx_.magnitude + dy_.magnitude) / 2;
        z_.next(out, field<std::uint32_t>(last, 8), field<std::uint32_t>(now, 8), std::min(magnitude, 19U));
        steps_x_[step_ % 3] = static_cast<std::int32_t>(dx);
        steps_y_[step_++ % 3] = static_cast<std::int32_t>(dy);
        const auto differs = [&](std::size_t at, std::size_t size) {
            return last.substr(at, size) != now.substr(at, size);
        };
        out.symbol(changed_, (differs(12, 2) ? 32U : 0U) | (differs(14, 1) ? 16U : 0U) | (differs(15, 1) ? 8U : 0U) |
                                 (differs(16, 1) ? 4U : 0U) | (differs(17, 1) ? 2U : 0U) | (differs(18, 2) ? 1U : 0U));
        if (differs(12, 2))
            intensities_.next(out, field<std::uint16_t>(last, 12), field<std::uint16_t>(now, 12));
        if (differs(14, 1))
            out.symbol(returns_[byte(last, 14)], byte(now, 14));
        if (differs(15, 1))
            out.symbol(classes_[byte(last, 15)], byte(now, 15));
        if (differs(16, 1))
            angle_v1_.next(out, byte(last, 16), byte(now, 16), magnitude < 3 ? 1 : 0);
        if (differs(17, 1))
            out.symbol(users_[byte(last, 17)], byte(now, 17));
        if (differs(18, 2))
            sources_.next(out, field<std::uint16_t>(last, 18), field<std::uint16_t>(now, 18));
    }

    void point_v2(LazEncoder &out, const std::string &last, const std::string &now) {
        static constexpr std::array<const char *, 8> kKinds{"FEDCBA98", "E0136AA9", "D1247BBA", "C3458CCB",
                                                            "B6789DDC", "AABCDEED", "9ABCDEFE", "89ABCDEF"};
        const unsigned number = byte(now, 14) & 7U, count = byte(now, 14) >> 3 & 7U;
        const char letter = kKinds.at(count)[number];
        const auto kind = static_cast<std::size_t>(letter <= '9' ? letter - '0' : letter - 'A' + 10);
        const auto intensity = field<std::uint16_t>(now, 12);
        const auto differs = [&](std::size_t at, std::size_t size) {
            return last.substr(at, size) != now.substr(at, size);
        };
        const bool is_bright = intensity != last_intensity_.at(kind);
        out.symbol(changed_, (differs(14, 1) ? 32U : 0U) | (is_bright ? 16U : 0U) | (differs(15, 1) ? 8U : 0U) |
                                 (differs(16, 1) ? 4U : 0U) | (differs(17, 1) ? 2U : 0U) | (differs(18, 2) ? 1U : 0U));
        if (differs(14, 1))
            out.symbol(returns_[byte(last, 14)], byte(now, 14));
        if (is_bright)
            intensities_.next(out, last_intensity_[kind], intensity,
                              static_cast<unsigned>(std::min<std::size_t>(kind, 3)));
        last_intensity_[kind] = intensity;
        if (differs(15, 1))
            out.symbol(classes_[byte(last, 15)], byte(now, 15));
        if (differs(16, 1))
            out.symbol(angles_[byte(now, 14) >> 6 & 1U], static_cast<std::uint8_t>(now[16] - last[16]));
        if (differs(17, 1))
            out.symbol(users_[byte(last, 17)], byte(now, 17));
        if (differs(18, 2))
            sources_.next(out, field<std::uint16_t>(last, 18), field<std::uint16_t>(now, 18));
        const bool is_single = count == 1;
        const std::uint32_t dx = difference(last, now, 0), dy = difference(last, now, 4);
        dx_.next(out, medians_x_.at(kind).get(), dx, is_single ? 1 : 0);
        medians_x_.at(kind).add(dx);
        dy_.next(out, medians_y_.at(kind).get(), dy, laz_context(dx_.magnitude, 20, is_single));
        medians_y_.at(kind).add(dy);
        std::uint32_t &height = heights_.at(number > count ? number - count : count - number);
        z_.next(out, height, field<std::uint32_t>(now, 8),
                laz_context((dx_.magnitude + dy_.magnitude) / 2, 18, is_single));
        height = field<std::uint32_t>(now, 8);
    }

    void time_v1(LazEncoder &out, std::uint64_t time) {
        const auto step = static_cast<std::int64_t>(time - time_);
        const bool fits = step == static_cast<std::int32_t>(step);
        time_ = time;
        const bool is_start = step_v1_ == 0;
        if (step == 0 || !fits) {
            is_start ? out.symbol(starts_v1_, step == 0 ? 0 : 2) : out.symbol(multiples_v1_, step == 0 ? 511 : 510);
            for (const unsigned shift : {0U, 32U})
                if (!fits)
                    out.bits(32, static_cast<std::uint32_t>(time >> shift));
            return;
        }
        const auto value = static_cast<std::uint32_t>(step);
        if (is_start) {
            out.symbol(starts_v1_, 1);
            steps_v1_.next(out, 0, value, 0);
            step_v1_ = static_cast<std::int32_t>(value);
            return;
        }
        const std::array<unsigned, 8> some{0, 1, 1, 2, 10, 49, 50, 509};
        const unsigned multiple = some[random_() % some.size()];
        out.symbol(multiples_v1_, multiple);
        const std::uint32_t prediction =
            multiple == 0 ? static_cast<std::uint32_t>(step_v1_ / 4) : multiple * static_cast<std::uint32_t>(step_v1_);
        steps_v1_.next(out, prediction, value,
                       multiple == 0   ? 2
                       : multiple == 1 ? 1
                       : multiple < 10 ? 3
                       : multiple < 50 ? 4
                                       : 5);
        if (multiple == 1 || ((multiple == 0 || multiple == 509) && ++extremes_v1_ > 3)) {
            step_v1_ = static_cast<std::int32_t>(value);
            extremes_v1_ = 0;
        }
    }

    void colour_v1(LazEncoder &out, const std::string &last, const std::string &now, std::size_t at) {
        unsigned changed = 0;
        for (unsigned i = 0; i < 6; ++i)
            changed |= last[at + i] != now[at + i] ? 1U << i : 0U;
        out.symbol(changed_colour_v1_, changed);
        for (unsigned i = 0; i < 6; ++i)
            if ((changed >> i & 1) != 0)
                colour_v1_.next(out, byte(last, at + i), byte(now, at + i), i);
    }

    LazKind kind_;
    std::uint64_t time_;
    LazTimes times_;
    LazModel changed_{64};
    LazModels returns_{256}, classes_{256}, users_{256}, angles_{256};
    LazIntegers dx_{32, 2}, dy_{32, 22}, z_{32, 20}, intensities_{16, 4}, sources_{16};
    std::array<LazMedian, 16> medians_x_, medians_y_;
    std::array<std::uint16_t, 16> last_intensity_{};
    std::array<std::uint32_t, 8> heights_{};
    LazColours colours_;
    LazWaves waves_;
    std::map<std::size_t, LazBytes> bytes_;
    // The first generation.
    std::array<std::int32_t, 3> steps_x_{}, steps_y_{};
    std::size_t step_ = 0;
    LazIntegers angle_v1_{8, 2}, colour_v1_{8, 6}, byte_v1_{8, 64}, steps_v1_{32, 6};
    LazModel starts_v1_{3}, multiples_v1_{512}, changed_colour_v1_{64};
    std::int32_t step_v1_ = 0;
    int extremes_v1_ = 0;
    std::mt19937 random_{3};
};

// A layer and whether it says more than that nothing changes.
struct LazLayer {
    LazEncoder out;
    bool is_needed = false;
};

// Formats 6 to 10.
class LazPoint14 {
  public:
    LazPoint14(const LazKind &kind, const std::string &first) : kind_(kind), channel_(byte(first, 15) >> 4 & 3U) {
        contexts_.emplace(channel_, Context(first));
        now_ = channel_;
        others_.emplace(channel_, Others{});
        last_other_[channel_] = first;
        layers_.resize(9 +
                       (has_infrared(kind.format) ? 2U
                        : has_colour(kind.format) ? 1U
                                                  : 0U) +
                       (has_wave(kind.format) ? 1U : 0U) + kind.extra);
        layers_[0].is_needed = layers_[1].is_needed = true;
    }

    void next(const std::string &now) {
        const unsigned channel = byte(now, 15) >> 4 & 3U;
        const bool switches = channel != channel_;
        point(now, channel);
        beside(now, switches || kind_.version >= 4 ? channel : 0);
    }

    std::string finish(std::uint32_t points) {
        std::string sizes(reinterpret_cast<const char *>(&points), 4), all;
        for (LazLayer &layer : layers_) {
            const std::string bytes = layer.is_needed ? layer.out.finish() : "";
            const auto size = static_cast<std::uint32_t>(bytes.size());
            sizes.append(reinterpret_cast<const char *>(&size), 4);
            all += bytes;
        }
        return sizes + all;
    }

  private:
    struct Context {
        explicit Context(const std::string &point) : last(point), times(field<std::uint64_t>(point, 22), false) {
            heights.fill(field<std::uint32_t>(point, 8));
            intensity.fill(field<std::uint16_t>(point, 12));
        }
        std::string last;
        bool time_changed = false;
        LazTimes times;
        std::array<std::uint32_t, 8> heights{};
        std::array<std::uint16_t, 8> intensity{};
        LazModels changes{128}, counts{16}, numbers{16}, classes{256}, flags{64}, users{256};
        LazModel channels{3}, number_steps{13};
        LazIntegers dx{32, 2}, dy{32, 22}, z{32, 20}, intensities{16, 4}, angles{16, 2}, sources{16};
        std::array<LazMedian, 12> medians_x, medians_y;
    };
    struct Others {
        LazColours colours;
        LazInfrared infrared;
        LazWaves waves;
        std::map<std::size_t, LazBytes> bytes;
    };

    static unsigned place(unsigned number, unsigned count) {
        return (number == 1 ? 2U : 0U) + (number >= count ? 1U : 0U);
    }
    static unsigned flags(const std::string &point) { return (byte(point, 15) & 15U) | byte(point, 15) >> 6 << 4; }

    // Six kinds of returns, also of values that contradict each other.
    static unsigned kind_of(unsigned count, unsigned number) {
        if (count == 0 || number == 0) {
            const unsigned other = count + number;
            return other < 6 ? other : other == 6 ? 3 : other < 9 ? 4 : 5;
        }
        const unsigned low = std::min(count, number), high = std::max(count, number);
        if (low == high)
            return low == 1 ? 0 : low == 2 ? 2 : 5;
        if (low == 1)
            return high == 2 ? 1 : 3;
        if (low == 2)
            return high >= 11 ? 3 : 4;
        return low >= 11 && high - low == 1 ? 5 : 4;
    }

    void point(const std::string &now, unsigned channel) {
        Context &before = contexts_.at(channel_);
        const bool is_new = contexts_.find(channel) == contexts_.end();
        const std::string last = is_new ? before.last : contexts_.at(channel).last;
        const unsigned count = byte(now, 14) >> 4, number = byte(now, 14) & 15U;
        const unsigned last_count = byte(last, 14) >> 4, last_number = byte(last, 14) & 15U;
        const auto differs = [&](std::size_t at, std::size_t size) {
            return last.substr(at, size) != now.substr(at, size);
        };
        const bool time = differs(22, 8);
        const unsigned step = (number + 16 - last_number) % 16;
        const unsigned step_code = step == 0 ? 0 : step == 1 ? 1 : step == 15 ? 2 : 3;
        LazEncoder &xy = layers_[0].out;
        xy.symbol(before.changes[place(byte(before.last, 14) & 15U, byte(before.last, 14) >> 4) +
                                 (before.time_changed ? 4U : 0U)],
                  (channel != channel_ ? 64U : 0U) | (differs(20, 2) ? 32U : 0U) | (time ? 16U : 0U) |
                      (differs(18, 2) ? 8U : 0U) | (count != last_count ? 4U : 0U) | step_code);
        if (channel != channel_)
            xy.symbol(before.channels, (channel + 3 - channel_) % 4);
        if (is_new)
            contexts_.emplace(channel, Context(before.last));
        channel_ = channel;
        Context &c = contexts_.at(channel);
        if (count != last_count)
            xy.symbol(c.counts[last_count], count);
        if (step_code == 3)
            time ? xy.symbol(c.numbers[last_number], number) : xy.symbol(c.number_steps, step - 2);
        const bool is_single = count == 1;
        const std::size_t median = 2 * kind_of(count, number) + (time ? 1 : 0);
        const auto difference = [&](std::size_t at) {
            return field<std::uint32_t>(now, at) - field<std::uint32_t>(last, at);
        };
        c.dx.next(xy, c.medians_x.at(median).get(), difference(0), is_single ? 1 : 0);
        c.medians_x.at(median).add(difference(0));
        c.dy.next(xy, c.medians_y.at(median).get(), difference(4), laz_context(c.dx.magnitude, 20, is_single));
        c.medians_y.at(median).add(difference(4));
        std::uint32_t &height = c.heights.at(std::min(number > count ? number - count : count - number, 7U));
        c.z.next(layers_[1].out, height, field<std::uint32_t>(now, 8),
                 laz_context((c.dx.magnitude + c.dy.magnitude) / 2, 18, is_single));
        height = field<std::uint32_t>(now, 8);
        const unsigned here = place(number, count);
        need(2, differs(16, 1)).symbol(c.classes[(byte(last, 16) & 31U) * 2 + (here == 3 ? 1 : 0)], byte(now, 16));
        need(3, flags(last) != flags(now)).symbol(c.flags[flags(last)], flags(now));
        std::uint16_t &intensity = c.intensity.at(2 * here + (time ? 1 : 0));
        c.intensities.next(need(4, differs(12, 2)), intensity, field<std::uint16_t>(now, 12), here);
        intensity = field<std::uint16_t>(now, 12);
        if (differs(18, 2))
            c.angles.next(need(5, true), field<std::uint16_t>(last, 18), field<std::uint16_t>(now, 18), time ? 1 : 0);
        need(6, differs(17, 1)).symbol(c.users[byte(last, 17) / 4], byte(now, 17));
        if (differs(20, 2))
            c.sources.next(need(7, true), field<std::uint16_t>(last, 20), field<std::uint16_t>(now, 20));
        if (time)
            c.times.next(need(8, true), field<std::uint64_t>(now, 22));
        c.last = now;
        c.time_changed = time;
    }

    void beside(const std::string &now, unsigned context) {
        std::size_t layer = 9, at = 30;
        unsigned from = kind_.version >= 4 ? context : now_;
        if (others_.try_emplace(context).second) {
            last_other_[context] = last_other_.at(now_);
            from = context;
        }
        now_ = context;
        std::string &last = last_other_.at(from);
        Others &models = others_.at(context);
        const auto differs = [&](std::size_t size) { return last.substr(at, size) != now.substr(at, size); };
        if (has_colour(kind_.format)) {
            models.colours.next(need(layer++, differs(6)), last, now, at);
            at += 6;
        }
        if (has_infrared(kind_.format)) {
            models.infrared.next(need(layer++, differs(2)), last, now, at);
            at += 2;
        }
        if (has_wave(kind_.format)) {
            models.waves.next(need(layer++, differs(29)), last, now, at);
            at += 29;
        }
        for (std::size_t i = 0; i < kind_.extra; ++i, ++at)
            models.bytes[i].next(need(layer++, differs(1)), last, now, at);
        last = now;
    }

    LazEncoder &need(std::size_t layer, bool is_needed) {
        layers_.at(layer).is_needed = layers_.at(layer).is_needed || is_needed;
        return layers_.at(layer).out;
    }

    LazKind kind_;
    unsigned channel_;
    std::map<unsigned, Context> contexts_;
    std::map<unsigned, Others> others_; // models
    std::map<unsigned, std::string> last_other_;
    unsigned now_ = 0; // context of the items beside the point
    std::vector<LazLayer> layers_;
};

inline std::string laz_chunk(const LazKind &kind, const std::vector<std::string> &points) {
    const auto count = static_cast<std::uint32_t>(points.size());
    if (kind.format >= 6) {
        LazPoint14 layers(kind, points.at(0));
        for (std::size_t i = 1; i < points.size(); ++i)
            layers.next(points[i]);
        return points[0] + layers.finish(count);
    }
    LazEncoder out;
    LazPoint10 encoder(kind, points.at(0));
    for (std::size_t i = 1; i < points.size(); ++i)
        encoder.next(out, points[i - 1], points[i]);
    return points[0] + out.finish();
}

template <class T> void put_at(std::string &file, std::size_t at, T value) {
    std::memcpy(file.data() + at, &value, sizeof value);
}

// The header of a LAS file of these records.
inline std::string las_header(unsigned format, std::size_t stride, std::uint32_t points) {
    std::string file(375, '\0');
    file.replace(0, 4, "LASF");
    file[24] = 1;
    file[25] = 4;
    put_at<std::uint16_t>(file, 94, 375);
    put_at<std::uint32_t>(file, 96, 375);
    file[104] = static_cast<char>(format);
    put_at<std::uint16_t>(file, 105, static_cast<std::uint16_t>(stride));
    put_at<std::uint32_t>(file, 107, points);
    for (std::size_t axis = 0; axis < 3; ++axis)
        put_at<double>(file, 131 + 8 * axis, 0.01);
    return file;
}

// The LAZ file of these records.
inline std::string laz_file(const LazKind &kind, const std::vector<std::string> &points) {
    const auto items = laz_items(kind);
    std::string file =
        las_header(kind.format, las_record_size(kind.format) + kind.extra, static_cast<std::uint32_t>(points.size()));
    file[104] = static_cast<char>(kind.format | 0x80U);
    std::string record(54 + 34 + 6 * items.size(), '\0');
    record.replace(2, 14, "laszip encoded");
    put_at<std::uint16_t>(record, 18, 22204);
    put_at<std::uint16_t>(record, 20, static_cast<std::uint16_t>(34 + 6 * items.size()));
    put_at<std::uint16_t>(record, 54, kind.chunks.empty() ? 1 : kind.format >= 6 ? 3 : 2);
    put_at<std::uint32_t>(record, 54 + 12, kind.are_equal && !kind.chunks.empty() ? kind.chunks[0] : 0xFFFFFFFFU);
    put_at<std::uint16_t>(record, 54 + 32, static_cast<std::uint16_t>(items.size()));
    for (std::size_t i = 0; i < items.size(); ++i) {
        put_at(record, 54 + 34 + 6 * i, items[i]);
        put_at<std::uint16_t>(record, 54 + 38 + 6 * i,
                              static_cast<std::uint16_t>(items[i].type == 9 ? 1 : kind.version));
    }
    put_at<std::uint32_t>(file, 96, static_cast<std::uint32_t>(file.size() + record.size()));
    put_at<std::uint32_t>(file, 100, 1);
    file += record;
    if (kind.chunks.empty())
        return file + laz_chunk(kind, points);
    const std::size_t offset_at = file.size();
    file += std::string(8, '\0');
    LazEncoder table;
    LazIntegers numbers(32, 2);
    std::uint32_t last_points = 0, last_bytes = 0;
    auto from = points.begin();
    for (const unsigned size : kind.chunks) {
        const std::string chunk = laz_chunk(kind, {from, from + size});
        from += size;
        file += chunk;
        if (!kind.are_equal)
            numbers.next(table, last_points, size, 0);
        numbers.next(table, last_bytes, static_cast<std::uint32_t>(chunk.size()), 1);
        last_points = size;
        last_bytes = static_cast<std::uint32_t>(chunk.size());
    }
    if (kind.options == LazKind::kNoTable) {
        put_at<std::uint64_t>(file, offset_at, offset_at);
        return file;
    }
    const std::uint64_t table_at = file.size();
    const bool is_at_end = kind.options == LazKind::kTableAtEnd;
    put_at<std::uint64_t>(file, offset_at, is_at_end ? ~std::uint64_t{0} : table_at);
    std::string counts(8, '\0');
    put_at<std::uint32_t>(counts, 4, static_cast<std::uint32_t>(kind.chunks.size()));
    file += counts + table.finish();
    return is_at_end ? file + std::string(reinterpret_cast<const char *>(&table_at), 8) : file;
}

} // namespace pbm::test
