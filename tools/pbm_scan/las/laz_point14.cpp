#include "pbm_scan/las/laz_point14.h"

#include "pbm_scan/las/laz_fields.h"
#include "pbm_scan/surface/refusal.h"

#include <cassert>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>

namespace pbm::build {
namespace {

// Bytes of a record of formats 6 to 10.
constexpr std::size_t kX = 0, kY = 4, kZ = 8, kIntensity = 12, kReturns = 14, kFlags = 15, kClass = 16, kUser = 17,
                      kAngle = 18, kSource = 20, kTime = 22, kPointSize = 30;
constexpr unsigned kChannels = 4; // of the scanner; each has a context of its own

using Point = std::array<std::uint8_t, kPointSize>;

// The context of an item beside the point, as the point's scanner channel chooses it.
struct ContextUse {
    unsigned models = 0, last = 0;       // channels
    std::optional<unsigned> copied_from; // the context `models` begins, with the last value of this one
};

// Version 3 of the items, as LASzip writes it, has two oddities that decoders must follow. Where the channel does not
// change from one point to the next, items beside the point use channel 0. And where they come back to a channel, they
// predict from the last value of the channel that they leave. Version 4 has neither.
class ContextSwitch {
  public:
    ContextSwitch(unsigned channel, bool is_odd) : now_(channel), is_odd_(is_odd) { is_used_[channel] = true; }

    ContextUse to(unsigned channel) {
        ContextUse use{channel, now_, {}};
        if (!is_used_[channel]) {
            use.copied_from = now_;
            use.last = channel;
            is_used_[channel] = true;
        } else if (!is_odd_) {
            use.last = channel;
        }
        now_ = channel;
        return use;
    }

  private:
    unsigned now_;
    bool is_odd_;
    std::array<bool, kChannels> is_used_{};
};

class PointLayers {
  public:
    static constexpr std::size_t kCount = 9;
    enum Layer : std::uint8_t { xy, z, classes, flags, intensities, angles, users, sources, times };

    PointLayers(const std::uint8_t *first, std::span<const ByteView> layers) {
        for (std::size_t i = 0; i < kCount; ++i) {
            has_[i] = !layers[i].empty();
            if (has_[i])
                in_[i] = ArithmeticDecoder(layers[i]);
        }
        channel_ = first[kFlags] >> 4 & 3U;
        contexts_[channel_] = std::make_unique<Context>(load<Point>(first));
    }

    // Returns the scanner channel if it is another than the last point's.
    std::optional<unsigned> next(std::uint8_t *to);
    unsigned channel() const { return channel_; }
    bool is_damaged() const { return in_[xy].is_damaged(); }
    std::span<const ArithmeticDecoder> decoders() const { return in_; }

  private:
    struct Context {
        explicit Context(const Point &point) : last(point), times(load<std::uint64_t>(point.data() + kTime), false) {
            last_z.fill(load<std::uint32_t>(point.data() + kZ));
            last_intensity.fill(load<std::uint16_t>(point.data() + kIntensity));
        }

        Point last;
        bool time_changed = false;                                   // with the last point
        std::array<std::array<MedianOfFive, 2>, 6> steps_x, steps_y; // [kind][time changed]
        std::array<std::uint32_t, 8> last_z;                         // [returns before or behind, at most 7]
        std::array<std::uint16_t, 8> last_intensity;                 // [place of the return, time changed]
        std::array<SymbolModel<128>, 8> changes;                     // [place of the last return, time changed]
        SymbolModel<3> channel_steps;
        std::array<SymbolModel<16>, 16> counts, numbers; // [last one]
        SymbolModel<13> number_steps;
        IntegerDecoder<32, 2> dx;
        IntegerDecoder<32, 22> dy;
        IntegerDecoder<32, 20> heights;
        ModelsOnDemand<256, 64> classes, users;
        ModelsOnDemand<64, 64> flags;
        IntegerDecoder<16, 4> intensities;
        IntegerDecoder<16, 2> angles;
        IntegerDecoder<16> sources;
        GpsTimes times;
    };

    // First and last of the returns of a pulse: 1, 2, both 3, none 0.
    static unsigned place(unsigned number, unsigned count) {
        return (number == 1 ? 1U : 0U) + (number >= count ? 2U : 0U);
    }
    std::uint8_t next_returns(Context &c, unsigned changes, bool time_changed);
    void next_place(Context &c, bool time_changed);
    void next_marks(Context &c, unsigned place);

    std::array<ArithmeticDecoder, kCount> in_; // [Layer]
    std::array<bool, kCount> has_{};           // [Layer] without it the field is the first point's everywhere
    std::array<std::unique_ptr<Context>, kChannels> contexts_;
    unsigned channel_ = 0;
};

// [number of returns][number of this return], also of values that contradict each other: kinds of returns, 0 to 5.
constexpr std::array<std::string_view, 16> kReturnKinds{
    "0123453445555555", "1013333333333333", "2124444444433333", "3345444444444444",
    "4344544444444444", "5344454444444444", "3344445444444444", "4344444544444444",
    "4344444454444444", "5344444445444444", "5344444444544444", "5334444444455444",
    "5334444444455544", "5334444444445554", "5334444444444555", "5334444444444455"};

std::uint8_t PointLayers::next_returns(Context &c, unsigned changes, bool time_changed) {
    const unsigned last_count = c.last[kReturns] >> 4, last_number = c.last[kReturns] & 15U;
    const unsigned count = (changes & 4) != 0 ? in_[xy].symbol(c.counts[last_count]) : last_count;
    unsigned number = last_number;
    if ((changes & 3) == 1)
        number = last_number + 1;
    else if ((changes & 3) == 2)
        number = last_number + 15;
    else if ((changes & 3) == 3)
        number =
            time_changed ? in_[xy].symbol(c.numbers[last_number]) : last_number + 2 + in_[xy].symbol(c.number_steps);
    return static_cast<std::uint8_t>(count << 4 | (number & 15));
}

void PointLayers::next_place(Context &c, bool time_changed) {
    const unsigned count = c.last[kReturns] >> 4, number = c.last[kReturns] & 15U;
    const bool is_single = count == 1;
    const auto kind = static_cast<std::size_t>(kReturnKinds[count][number] - '0');
    const auto step = [&](std::size_t at, std::uint32_t by) {
        store(c.last.data() + at, load<std::uint32_t>(c.last.data() + at) + by);
    };
    MedianOfFive &steps_x = c.steps_x[kind][time_changed ? 1 : 0];
    const std::uint32_t dx = c.dx.next(in_[xy], steps_x.get(), is_single ? 1 : 0);
    steps_x.add(dx);
    step(kX, dx);
    MedianOfFive &steps_y = c.steps_y[kind][time_changed ? 1 : 0];
    const std::uint32_t dy = c.dy.next(in_[xy], steps_y.get(), magnitude_context(c.dx.magnitude(), 22, is_single));
    steps_y.add(dy);
    step(kY, dy);
    if (!has_[z])
        return;
    const unsigned magnitude = (c.dx.magnitude() + c.dy.magnitude()) / 2;
    std::uint32_t &height = c.last_z[std::min(count < number ? number - count : count - number, 7U)];
    height = c.heights.next(in_[z], height, magnitude_context(magnitude, 20, is_single));
    store(c.last.data() + kZ, height);
}

// Classification, flags, intensity and user data.
void PointLayers::next_marks(Context &c, unsigned place) {
    Point &p = c.last;
    if (has_[classes])
        p[kClass] = static_cast<std::uint8_t>(
            in_[classes].symbol(c.classes[(p[kClass] & 31U) << 1 | (place >> 1 == 3 ? 1U : 0U)]));
    if (has_[flags]) { // the scanner channel stands between them
        const unsigned last = (p[kFlags] & 15U) | unsigned{p[kFlags]} >> 6 << 4;
        const unsigned now = in_[flags].symbol(c.flags[last]);
        p[kFlags] = static_cast<std::uint8_t>((now & 15U) | (p[kFlags] & 0x30U) | (now >> 4) << 6);
    }
    if (has_[intensities]) {
        std::uint16_t &intensity = c.last_intensity[place];
        intensity = static_cast<std::uint16_t>(c.intensities.next(in_[intensities], intensity, place >> 1));
        store(p.data() + kIntensity, intensity);
    }
    if (has_[users])
        p[kUser] = static_cast<std::uint8_t>(in_[users].symbol(c.users[p[kUser] / 4U]));
}

std::optional<unsigned> PointLayers::next(std::uint8_t *to) {
    enum Changed : unsigned { angle = 1 << 3, time = 1 << 4, source = 1 << 5, scanner_channel = 1 << 6 };
    Context *c = contexts_[channel_].get();
    const unsigned last_place = place(c->last[kReturns] & 15U, c->last[kReturns] >> 4);
    const unsigned changes = in_[xy].symbol(c->changes[last_place + (c->time_changed ? 4U : 0U)]);
    std::optional<unsigned> changed_channel;
    if ((changes & scanner_channel) != 0) {
        channel_ = (channel_ + in_[xy].symbol(c->channel_steps) + 1) % kChannels;
        changed_channel = channel_;
        if (!contexts_[channel_])
            contexts_[channel_] = std::make_unique<Context>(c->last);
        c = contexts_[channel_].get();
        c->last[kFlags] = static_cast<std::uint8_t>((c->last[kFlags] & 0xCFU) | channel_ << 4);
    }
    const bool time_changed = (changes & time) != 0;
    c->last[kReturns] = next_returns(*c, changes, time_changed);
    next_place(*c, time_changed);
    next_marks(*c, place(c->last[kReturns] & 15U, c->last[kReturns] >> 4) << 1 | (time_changed ? 1U : 0U));
    const auto follow = [&](std::size_t at, auto &decoder, Layer layer, unsigned context) {
        const std::uint32_t value = decoder.next(in_[layer], load<std::uint16_t>(c->last.data() + at), context);
        store(c->last.data() + at, static_cast<std::uint16_t>(value));
    };
    if (has_[angles] && (changes & angle) != 0)
        follow(kAngle, c->angles, angles, time_changed ? 1 : 0);
    if (has_[sources] && (changes & source) != 0)
        follow(kSource, c->sources, sources, 0);
    if (has_[times] && time_changed)
        store(c->last.data() + kTime, c->times.next(in_[times]));
    c->time_changed = time_changed;
    store(to, c->last);
    return changed_channel;
}

// A field with models and a last value for each channel. Decode(models, last) returns the next value.
template <class Models, class Value> class PerChannel {
  public:
    PerChannel(unsigned channel, const Value &first) {
        models_[channel] = std::make_unique<Models>();
        last_[channel] = first;
    }
    template <class Decode> const Value &next(const ContextUse &use, const Decode &decode) {
        if (use.copied_from) {
            models_[use.models] = std::make_unique<Models>();
            last_[use.models] = last_[*use.copied_from];
        }
        Value &last = last_[use.last];
        last = decode(*models_[use.models], last);
        return last;
    }

  private:
    std::array<std::unique_ptr<Models>, kChannels> models_;
    std::array<Value, kChannels> last_{};
};

// Items beside the point. Without bytes in its layer a field is that of the first point everywhere.

template <class Models, class Value> class OneLayer {
  public:
    static constexpr std::size_t kCount = 1;
    OneLayer(unsigned channel, const std::uint8_t *first, ByteView layer)
        : has_(!layer.empty()), in_{has_ ? ArithmeticDecoder(layer) : ArithmeticDecoder()},
          field_(channel, load<Value>(first)) {}
    void next(const ContextUse &use, std::uint8_t *to) {
        store(to, field_.next(
                      use, [&](Models &models, const Value &last) { return has_ ? models.next(in_[0], last) : last; }));
    }
    std::span<const ArithmeticDecoder> decoders() const { return in_; }

  private:
    bool has_;
    std::array<ArithmeticDecoder, 1> in_;
    PerChannel<Models, Value> field_;
};
using ColourLayer = OneLayer<ColourModels, LazColour>;
using InfraredLayer = OneLayer<InfraredModels, std::uint16_t>;
using WaveLayer = OneLayer<WaveModels, LazWave>;

struct ByteModels {
    SymbolModel<256> differences;
    std::uint8_t next(ArithmeticDecoder &in, std::uint8_t last) {
        return static_cast<std::uint8_t>(last + in.symbol(differences));
    }
};
using ByteLayer = OneLayer<ByteModels, std::uint8_t>;

using AnyLayer = std::variant<std::unique_ptr<ColourLayer>, std::unique_ptr<InfraredLayer>, std::unique_ptr<WaveLayer>,
                              std::unique_ptr<ByteLayer>>;

std::size_t layers_of(const LazItem &item) {
    switch (item.field) {
    case LazField::point14: return PointLayers::kCount;
    case LazField::colour_infrared14: return 2;
    case LazField::bytes14: return item.size;
    default: return 1;
    }
}

struct LayerTable {
    std::uint32_t points = 0;
    std::vector<std::uint32_t> sizes;
    std::size_t begin = 0; // of the first layer
};

Result<LayerTable> read_layer_table(ByteView chunk, const LazLayout &layout) {
    std::size_t count = 0;
    for (const LazItem &item : layout.items)
        count += layers_of(item);
    LayerTable table;
    table.begin = layout.stride + 4 + 4 * count;
    if (chunk.size() < table.begin)
        return bad_input("the chunk is shorter than the sizes of its layers", chunk.size());
    ByteReader in(chunk.subspan(layout.stride));
    table.points = in.u32();
    table.sizes.resize(count);
    for (std::uint32_t &size : table.sizes)
        size = in.u32();
    return table;
}

bool ends_well(std::span<const ArithmeticDecoder> layers) {
    return std::all_of(layers.begin(), layers.end(),
                       [](const ArithmeticDecoder &in) { return !in.is_damaged() && in.bytes_left() == 0; });
}

// The layers of an item that is no point, at their offsets in the record.
void add_layers(const LazItem &item, unsigned channel, const std::uint8_t *record, std::span<const ByteView> layers,
                std::vector<std::pair<std::size_t, AnyLayer>> &to) {
    const std::uint8_t *const first = record + item.offset;
    switch (item.field) {
    case LazField::colour_infrared14:
        to.emplace_back(item.offset, std::make_unique<ColourLayer>(channel, first, layers[0]));
        to.emplace_back(item.offset + 6, std::make_unique<InfraredLayer>(channel, first + 6, layers[1]));
        return;
    case LazField::colour14:
        to.emplace_back(item.offset, std::make_unique<ColourLayer>(channel, first, layers[0]));
        return;
    case LazField::wave14: to.emplace_back(item.offset, std::make_unique<WaveLayer>(channel, first, layers[0])); return;
    default: break;
    }
    assert(item.field == LazField::bytes14);
    for (std::size_t i = 0; i < item.size; ++i)
        to.emplace_back(item.offset + i, std::make_unique<ByteLayer>(channel, first + i, layers[i]));
}

} // namespace

Result<LayeredChunk> measure_layered(ByteView chunk, const LazLayout &layout) {
    const Result<LayerTable> table = read_layer_table(chunk, layout);
    if (!table)
        return table.error();
    LayeredChunk measured{.bytes = table->begin, .points = table->points};
    for (const std::uint32_t size : table->sizes)
        measured.bytes += size;
    if (measured.points == 0)
        return bad_input("the chunk says that it has no points", layout.stride);
    if (measured.bytes > chunk.size())
        return bad_input("the layers of the chunk have " + std::to_string(measured.bytes) + " bytes, but there are " +
                             std::to_string(chunk.size()),
                         layout.stride);
    return measured;
}

Status decode_layered(ByteView chunk, const LazLayout &layout, std::span<std::uint8_t> records) {
    const Result<LayerTable> table = read_layer_table(chunk, layout);
    if (!table)
        return table.error();
    std::vector<ByteView> layers;
    std::size_t at = table->begin;
    for (const std::uint32_t size : table->sizes) {
        layers.push_back(chunk.subspan(at, size));
        at += size;
    }
    assert(at == chunk.size() && records.size() == table->points * layout.stride);
    std::copy_n(chunk.begin(), layout.stride, records.begin()); // not compressed
    std::span<const ByteView> left = layers;
    PointLayers point(chunk.data(), left);
    std::vector<std::pair<std::size_t, AnyLayer>> others;
    bool is_odd = false;
    for (const LazItem &item : layout.items) {
        if (item.field != LazField::point14)
            add_layers(item, point.channel(), chunk.data(), left, others);
        left = left.subspan(layers_of(item));
        is_odd = is_odd || item.version < 4;
    }
    ContextSwitch contexts(point.channel(), is_odd);
    for (std::size_t i = layout.stride; i < records.size() && !point.is_damaged(); i += layout.stride) {
        const std::optional<unsigned> changed = point.next(records.data() + i);
        const ContextUse use = contexts.to(changed || !is_odd ? point.channel() : 0);
        for (const auto &[offset, layer] : others)
            std::visit([&, to = records.data() + i + offset](const auto &next) { next->next(use, to); }, layer);
    }
    if (!ends_well(point.decoders()))
        return bad_input("a layer of the points is damaged: its bytes do not end where its points do", at);
    for (const auto &[offset, layer] : others)
        if (!std::visit([](const auto &next) { return ends_well(next->decoders()); }, layer))
            return bad_input("a layer of colours or other fields is damaged: its bytes do not end where its points do",
                             at);
    return {};
}

} // namespace pbm::build
