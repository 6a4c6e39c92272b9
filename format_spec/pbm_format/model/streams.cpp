#include "pbm_format/model/streams.h"

#include <algorithm>

namespace pbm {

const StreamTraits &traits_of(StreamKind kind) {
    const auto *const found =
        std::find_if(kStreams.begin(), kStreams.end(), [&](const StreamTraits &traits) { return traits.kind == kind; });
    assert(found != kStreams.end());
    return *found;
}

std::string name_of(const StreamInfo &stream) {
    std::string name(to_string(stream.kind));
    return stream.kind == StreamKind::shadow ? name + " " + std::to_string(stream.light) : name;
}

StreamList streams_of(const AttributeSet &set) {
    StreamList streams;
    streams.add(StreamKind::masks);
    for (const StreamInfo &stream : point_streams())
        if (bytes_per_point(stream, set) != 0)
            streams.add(stream.kind, stream.light);
    return streams;
}

const StreamList &point_streams() {
    static constexpr StreamList kAll = [] {
        StreamList all;
        for (const StreamTraits &traits : kStreams)
            for (int light = 0; light < (traits.kind == StreamKind::shadow ? kMaxLights : 1); ++light)
                if (traits.kind != StreamKind::masks)
                    all.add(traits.kind, static_cast<std::uint8_t>(light));
        return all;
    }();
    return kAll;
}

Filter filter_of(const StreamInfo &stream, const AttributeSet &set) {
    const bool wide = stream.kind == StreamKind::colour && set.colour == ColourFormat::rgb888;
    return wide ? Filter::colour888 : traits_of(stream.kind).filter;
}

std::size_t plane_count(Filter filter) {
    constexpr std::array<std::uint8_t, 11> kPlanes{0, 1, 2, 1, 3, 3, 1, 1, 1, 0, 2}; // by filter
    return kPlanes.at(static_cast<std::size_t>(filter));
}

std::size_t bytes_per_point(const StreamInfo &stream, const AttributeSet &set) {
    switch (stream.kind) {
    case StreamKind::masks: return 0;
    case StreamKind::normal: return 2;
    case StreamKind::radius: return 1;
    case StreamKind::colour: return static_cast<std::size_t>(set.colour_bytes());
    case StreamKind::shadow: return stream.light < set.lights ? 1 : 0;
    default: return set.*traits_of(stream.kind).flag ? 1 : 0;
    }
}

unsigned bits_per_point(const StreamInfo &stream, const AttributeSet &set, int level) {
    return stream.kind == StreamKind::shadow ? set.shadow_bits[stream.light][static_cast<std::size_t>(level)]
                                             : static_cast<unsigned>(8 * bytes_per_point(stream, set));
}

std::uint64_t raw_stream_bytes(const StreamInfo &stream, const AttributeSet &set, int level, std::uint64_t nodes,
                               std::uint64_t points) {
    return stream.kind == StreamKind::masks ? nodes : (points * bits_per_point(stream, set, level) + 7) / 8;
}

void PointAttributes::resize(std::size_t points, const AttributeSet &set) {
    for_columns(
        set, [&](const StreamInfo &, std::size_t width, auto &column) { column.resize(points * width); }, *this);
}

void PointAttributes::append(const PointAttributes &more, const AttributeSet &set) {
    for_columns(
        set,
        [](const StreamInfo &, std::size_t, auto &to, const auto &from) {
            to.insert(to.end(), from.begin(), from.end());
        },
        *this, more);
}

PointView view_points(const PointAttributes &points, std::size_t first, std::size_t count, const AttributeSet &set) {
    PointView view;
    for_columns(
        set,
        [&](const StreamInfo &, std::size_t width, auto &to, const auto &from) {
            to = std::span(from).subspan(width * first, width * count);
        },
        view, points);
    return view;
}

std::span<std::uint8_t> bytes_of(PointAttributes &points, const StreamInfo &stream) {
    if (stream.kind == StreamKind::normal)
        return {reinterpret_cast<std::uint8_t *>(points.normals.data()), 2 * points.normals.size()};
    return points.values(stream);
}

ByteView bytes_of(const PointView &points, const StreamInfo &stream) {
    if (stream.kind == StreamKind::normal)
        return {reinterpret_cast<const std::uint8_t *>(points.normals.data()), points.normals.size_bytes()};
    return points.values(stream);
}

Bytes pack_bits(ByteView values, unsigned bits) {
    Bytes packed((values.size() * bits + 7) / 8, 0);
    for (std::size_t i = 0; i < values.size(); ++i)
        packed[i * bits / 8] = static_cast<std::uint8_t>(packed[i * bits / 8] | values[i] << i * bits % 8);
    return packed;
}

void unpack_bits(ByteView packed, unsigned bits, std::span<std::uint8_t> values) {
    const unsigned mask = (1U << bits) - 1;
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = static_cast<std::uint8_t>(packed[i * bits / 8] >> i * bits % 8 & mask);
}

void set_point_colour(PointAttributes &points, std::size_t i, ColourFormat format, Rgb8 colour) {
    assert(format != ColourFormat::none);
    if (format == ColourFormat::rgb565) {
        const std::uint16_t packed = pack_565(colour);
        points.colours[2 * i] = static_cast<std::uint8_t>(packed);
        points.colours[2 * i + 1] = static_cast<std::uint8_t>(packed >> 8);
    } else {
        std::copy(colour.begin(), colour.end(), points.colours.begin() + static_cast<std::ptrdiff_t>(3 * i));
    }
}

PointAttributes root_points(const RootRecord &root, const AttributeSet &set) {
    PointAttributes points;
    points.resize(1, set);
    points.normals[0] = root.normal();
    for (const StreamInfo &stream : streams_of(set))
        if (stream.kind == StreamKind::colour)
            set_point_colour(points, 0, set.colour, root.colour());
        else if (stream.kind > StreamKind::normal)
            points.values(stream)[0] = root.value(stream);
    return points;
}

RootRecord root_record(const PointAttributes &points, const AttributeSet &set) {
    RootRecord root;
    const auto put = [&](const StreamInfo &stream, const auto &bytes) {
        std::copy(bytes.begin(), bytes.end(), &root.bytes[traits_of(stream.kind).root_at] + stream.light);
    };
    for (const StreamInfo &stream : streams_of(set))
        if (stream.kind == StreamKind::colour)
            put(stream, point_colour(points.colours, 0, set.colour));
        else if (stream.kind != StreamKind::masks)
            put(stream, bytes_of(view_points(points, 0, 1, set), stream));
    return root;
}

} // namespace pbm
