#include "pbm_scan/las/laz_point10.h"

#include "pbm_scan/las/laz_fields.h"
#include "pbm_scan/surface/refusal.h"

#include <cassert>
#include <memory>
#include <utility>
#include <variant>

namespace pbm::build {
namespace {

// Bytes of a record of formats 0 to 5.
constexpr std::size_t kX = 0, kY = 4, kZ = 8, kIntensity = 12, kReturns = 14, kClass = 15, kAngle = 16, kUser = 17,
                      kSource = 18, kPointSize = 20;

using Point = std::array<std::uint8_t, kPointSize>;

template <std::size_t Size> std::array<std::uint8_t, Size> first_bytes(const std::uint8_t *record) {
    return load<std::array<std::uint8_t, Size>>(record);
}

std::uint32_t u32(const Point &point, std::size_t at) { return load<std::uint32_t>(point.data() + at); }
std::uint16_t u16(const Point &point, std::size_t at) { return load<std::uint16_t>(point.data() + at); }

// Each field has a class: the first record makes it, next() writes the field of the next record to `to`.

class PointV1 {
  public:
    explicit PointV1(const std::uint8_t *first) : last_(first_bytes<kPointSize>(first)) {}

    void next(ArithmeticDecoder &in, std::uint8_t *to) {
        constexpr unsigned kMax = 19;
        const std::uint32_t dx = dx_.next(in, median(steps_x_));
        const std::uint32_t dy = dy_.next(in, median(steps_y_), std::min(dx_.magnitude(), kMax));
        const unsigned magnitude = (dx_.magnitude() + dy_.magnitude()) / 2;
        store(last_.data() + kX, u32(last_, kX) + dx);
        store(last_.data() + kY, u32(last_, kY) + dy);
        store(last_.data() + kZ, z_.next(in, u32(last_, kZ), std::min(magnitude, kMax)));
        steps_x_[next_step_] = static_cast<std::int32_t>(dx);
        steps_y_[next_step_] = static_cast<std::int32_t>(dy);
        next_step_ = (next_step_ + 1) % 3;
        const unsigned changed = in.symbol(changed_);
        if ((changed & 32) != 0)
            store(last_.data() + kIntensity, static_cast<std::uint16_t>(intensities_.next(in, u16(last_, kIntensity))));
        if ((changed & 16) != 0)
            follow(in, returns_, last_[kReturns]);
        if ((changed & 8) != 0)
            follow(in, classes_, last_[kClass]);
        if ((changed & 4) != 0)
            last_[kAngle] = static_cast<std::uint8_t>(angles_.next(in, last_[kAngle], magnitude < 3 ? 1 : 0));
        if ((changed & 2) != 0)
            follow(in, users_, last_[kUser]);
        if ((changed & 1) != 0)
            store(last_.data() + kSource, static_cast<std::uint16_t>(sources_.next(in, u16(last_, kSource))));
        store(to, last_);
    }

  private:
    using Steps = std::array<std::int32_t, 3>;
    static std::uint32_t median(const Steps &s) {
        return static_cast<std::uint32_t>(std::max(std::min(s[0], s[1]), std::min(std::max(s[0], s[1]), s[2])));
    }
    static void follow(ArithmeticDecoder &in, ModelsOnDemand<256, 256> &models, std::uint8_t &value) {
        value = static_cast<std::uint8_t>(in.symbol(models[value]));
    }

    Point last_;
    Steps steps_x_{}, steps_y_{}; // the last three
    std::size_t next_step_ = 0;
    SymbolModel<64> changed_;
    IntegerDecoder<32> dx_;
    IntegerDecoder<32, 20> dy_, z_;
    IntegerDecoder<16> intensities_, sources_;
    IntegerDecoder<8, 2> angles_;
    ModelsOnDemand<256, 256> returns_, classes_, users_;
};

class PointV2 {
  public:
    explicit PointV2(const std::uint8_t *first) : last_(first_bytes<kPointSize>(first)) {}

    void next(ArithmeticDecoder &in, std::uint8_t *to) {
        const unsigned changed = in.symbol(changed_);
        if ((changed & 32) != 0)
            follow(in, returns_, last_[kReturns]);
        const unsigned number = last_[kReturns] & 7U, count = last_[kReturns] >> 3 & 7U;
        const bool is_single = count == 1;
        const unsigned kind = kReturnKinds[count][number];
        if ((changed & 16) != 0)
            last_intensity_[kind] =
                static_cast<std::uint16_t>(intensities_.next(in, last_intensity_[kind], std::min(kind, 3U)));
        store(last_.data() + kIntensity, last_intensity_[kind]);
        if ((changed & 8) != 0)
            follow(in, classes_, last_[kClass]);
        if ((changed & 4) != 0)
            last_[kAngle] = static_cast<std::uint8_t>(last_[kAngle] + in.symbol(angles_[last_[kReturns] >> 6 & 1U]));
        if ((changed & 2) != 0)
            follow(in, users_, last_[kUser]);
        if ((changed & 1) != 0)
            store(last_.data() + kSource, static_cast<std::uint16_t>(sources_.next(in, u16(last_, kSource))));

        const std::uint32_t dx = dx_.next(in, steps_x_[kind].get(), is_single ? 1 : 0);
        steps_x_[kind].add(dx);
        store(last_.data() + kX, u32(last_, kX) + dx);
        const std::uint32_t dy = dy_.next(in, steps_y_[kind].get(), magnitude_context(dx_.magnitude(), 22, is_single));
        steps_y_[kind].add(dy);
        store(last_.data() + kY, u32(last_, kY) + dy);
        const unsigned magnitude = (dx_.magnitude() + dy_.magnitude()) / 2;
        std::uint32_t &height = last_z_[number < count ? count - number : number - count];
        height = z_.next(in, height, magnitude_context(magnitude, 20, is_single));
        store(last_.data() + kZ, height);
        store(to, last_);
    }

  private:
    // [number of returns][number of this return], also of values that contradict each other.
    static constexpr std::uint8_t kReturnKinds[8][8] = {
        {15, 14, 13, 12, 11, 10, 9, 8},  {14, 0, 1, 3, 6, 10, 10, 9},   {13, 1, 2, 4, 7, 11, 11, 10},
        {12, 3, 4, 5, 8, 12, 12, 11},    {11, 6, 7, 8, 9, 13, 13, 12},  {10, 10, 11, 12, 13, 14, 14, 13},
        {9, 10, 11, 12, 13, 14, 15, 14}, {8, 9, 10, 11, 12, 13, 14, 15}};

    static void follow(ArithmeticDecoder &in, ModelsOnDemand<256, 256> &models, std::uint8_t &value) {
        value = static_cast<std::uint8_t>(in.symbol(models[value]));
    }

    Point last_;
    std::array<std::uint16_t, 16> last_intensity_{}; // [kind]
    std::array<MedianOfFive, 16> steps_x_, steps_y_; // [kind]
    std::array<std::uint32_t, 8> last_z_{};          // [returns before or behind]
    SymbolModel<64> changed_;
    IntegerDecoder<32, 2> dx_;
    IntegerDecoder<32, 22> dy_;
    IntegerDecoder<32, 20> z_;
    IntegerDecoder<16, 4> intensities_;
    IntegerDecoder<16> sources_;
    std::array<SymbolModel<256>, 2> angles_; // [scan direction]
    ModelsOnDemand<256, 256> returns_, classes_, users_;
};

class TimeV1 {
  public:
    explicit TimeV1(const std::uint8_t *first) : time_(load<std::uint64_t>(first)) {}

    void next(ArithmeticDecoder &in, std::uint8_t *to) {
        constexpr unsigned kMaxMultiple = kMultiples - 3, kNew = kMultiples - 2;
        if (step_ == 0) {
            const unsigned code = in.symbol(starts_);
            if (code == 1)
                move(step_ = static_cast<std::int32_t>(steps_.next(in, 0, 0)));
            else if (code == 2)
                time_ = in.bits64();
        } else if (const unsigned multiple = in.symbol(multiples_); multiple <= kMaxMultiple) {
            const std::uint32_t prediction =
                multiple == 0 ? static_cast<std::uint32_t>(step_ / 4) : multiple * static_cast<std::uint32_t>(step_);
            const unsigned context = multiple == 0 ? 2 : multiple == 1 ? 1 : multiple < 10 ? 3 : multiple < 50 ? 4 : 5;
            const auto step = static_cast<std::int32_t>(steps_.next(in, prediction, context));
            constexpr int kMaxExtremes = 3;
            if (multiple == 1 || ((multiple == 0 || multiple == kMaxMultiple) && ++extremes_ > kMaxExtremes)) {
                step_ = step;
                extremes_ = 0;
            }
            move(step);
        } else if (multiple == kNew) {
            time_ = in.bits64();
        }
        store(to, time_);
    }

  private:
    static constexpr unsigned kMultiples = 512;
    void move(std::int32_t step) { time_ += static_cast<std::uint64_t>(std::int64_t{step}); }

    std::uint64_t time_;
    std::int32_t step_ = 0;
    int extremes_ = 0;
    SymbolModel<3> starts_;
    SymbolModel<kMultiples> multiples_;
    IntegerDecoder<32, 6> steps_;
};

class TimeV2 {
  public:
    explicit TimeV2(const std::uint8_t *first) : times_(load<std::uint64_t>(first), true) {}
    void next(ArithmeticDecoder &in, std::uint8_t *to) { store(to, times_.next(in)); }

  private:
    GpsTimes times_;
};

class ColourV1 {
  public:
    explicit ColourV1(const std::uint8_t *first) : last_(first_bytes<6>(first)) {}
    void next(ArithmeticDecoder &in, std::uint8_t *to) {
        const unsigned changed = in.symbol(changed_);
        for (unsigned i = 0; i < 6; ++i)
            if ((changed >> i & 1) != 0)
                last_[i] = static_cast<std::uint8_t>(bytes_.next(in, last_[i], i));
        store(to, last_);
    }

  private:
    std::array<std::uint8_t, 6> last_;
    SymbolModel<64> changed_;
    IntegerDecoder<8, 6> bytes_;
};

class ColourV2 {
  public:
    explicit ColourV2(const std::uint8_t *first) : last_(load<LazColour>(first)) {}
    void next(ArithmeticDecoder &in, std::uint8_t *to) { store(to, last_ = models_.next(in, last_)); }

  private:
    LazColour last_;
    ColourModels models_;
};

class Wave {
  public:
    explicit Wave(const std::uint8_t *first) : last_(load<LazWave>(first)) {}
    void next(ArithmeticDecoder &in, std::uint8_t *to) { store(to, last_ = models_.next(in, last_)); }

  private:
    LazWave last_;
    WaveModels models_;
};

class BytesV1 {
  public:
    BytesV1(const std::uint8_t *first, std::size_t size) : last_(first, first + size), magnitudes_(size) {}
    void next(ArithmeticDecoder &in, std::uint8_t *to) {
        for (std::size_t i = 0; i < last_.size(); ++i)
            last_[i] = static_cast<std::uint8_t>(bytes_.next(in, last_[i], magnitudes_[i]));
        std::copy(last_.begin(), last_.end(), to);
    }

  private:
    Bytes last_;
    std::vector<IntegerDecoder<8>::Magnitudes> magnitudes_;
    IntegerDecoder<8> bytes_;
};

class BytesV2 {
  public:
    BytesV2(const std::uint8_t *first, std::size_t size) : last_(first, first + size), differences_(size) {}
    void next(ArithmeticDecoder &in, std::uint8_t *to) {
        for (std::size_t i = 0; i < last_.size(); ++i)
            last_[i] = static_cast<std::uint8_t>(last_[i] + in.symbol(differences_[i]));
        std::copy(last_.begin(), last_.end(), to);
    }

  private:
    Bytes last_;
    std::vector<SymbolModel<256>> differences_;
};

template <class... Fields> using AnyOf = std::variant<std::unique_ptr<Fields>...>;
using AnyField = AnyOf<PointV1, PointV2, TimeV1, TimeV2, ColourV1, ColourV2, Wave, BytesV1, BytesV2>;

AnyField make_field(const LazItem &item, const std::uint8_t *first) {
    const bool is_v1 = item.version == 1;
    switch (item.field) {
    case LazField::point10:
        return is_v1 ? AnyField(std::make_unique<PointV1>(first)) : AnyField(std::make_unique<PointV2>(first));
    case LazField::time11:
        return is_v1 ? AnyField(std::make_unique<TimeV1>(first)) : AnyField(std::make_unique<TimeV2>(first));
    case LazField::colour12:
        return is_v1 ? AnyField(std::make_unique<ColourV1>(first)) : AnyField(std::make_unique<ColourV2>(first));
    case LazField::wave13: return std::make_unique<Wave>(first);
    default: break;
    }
    assert(item.field == LazField::bytes);
    return is_v1 ? AnyField(std::make_unique<BytesV1>(first, item.size))
                 : AnyField(std::make_unique<BytesV2>(first, item.size));
}

} // namespace

Result<std::size_t> decode_pointwise(ByteView chunk, const LazLayout &layout, std::span<std::uint8_t> records) {
    const std::size_t stride = layout.stride;
    assert(!records.empty() && records.size() % stride == 0);
    if (chunk.size() < stride)
        return bad_input("the chunk is shorter than its first point", chunk.size());
    std::copy_n(chunk.begin(), stride, records.begin()); // not compressed
    ArithmeticDecoder in(chunk.subspan(stride));
    std::vector<std::pair<std::size_t, AnyField>> fields;
    if (records.size() > stride)
        for (const LazItem &item : layout.items)
            fields.emplace_back(item.offset, make_field(item, chunk.data() + item.offset));
    std::size_t at = stride;
    for (; at < records.size() && !in.is_damaged(); at += stride)
        for (const auto &[offset, field] : fields)
            std::visit([&, to = records.data() + at + offset](const auto &next) { next->next(in, to); }, field);
    const std::size_t used = chunk.size() - in.bytes_left();
    if (in.is_damaged())
        return bad_input("the compressed points end or are damaged at point " + std::to_string(at / stride - 1) +
                             " of " + std::to_string(records.size() / stride),
                         used);
    return used;
}

} // namespace pbm::build
