#include "ply_points.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace pbm {
namespace {

// Shortest text that reads back as the same number.
std::string text_of(const Value &number) { return to_string(number); }

// Replaces control characters, so that a comment stays on one line.
std::string one_line(std::string text) {
    for (char &c : text)
        c = static_cast<unsigned char>(c) < ' ' || c == 0x7F ? ' ' : c;
    return text;
}

std::string credits(std::string_view metadata) {
    const nlohmann::json json = nlohmann::json::parse(metadata, nullptr, false);
    std::string lines;
    for (const char *const key : {"name", "licence", "credit"})
        if (const auto found = json.find(key); found != json.end() && found->is_string())
            lines += std::string("comment ") + key + " " + one_line(found->get<std::string>()) + "\n";
    return lines;
}

// Writes the numbers of a row, binary or as text.
class Row {
  public:
    Row(std::uint8_t *at, bool ascii) : begin_(at), at_(at), ascii_(ascii) {}

    template <class T> void add(T value) {
        if (!ascii_) {
            std::memcpy(at_, &value, sizeof value);
            at_ += sizeof value;
            return;
        }
        if (at_ != begin_)
            *at_++ = ' ';
        auto *const text = reinterpret_cast<char *>(at_);
        at_ += std::to_chars(text, text + kLongestNumber, value).ptr - text;
    }

    std::uint8_t *end() {
        if (ascii_)
            *at_++ = '\n';
        return at_;
    }

    static constexpr std::size_t kLongestNumber = 24; // -1.7976931348623157e+308

  private:
    std::uint8_t *begin_;
    std::uint8_t *at_;
    bool ascii_;
};

// Whether a voxel spans at least four steps of type T, so that its centre differs from its faces.
template <class T> bool resolves(double voxel, double farthest) {
    constexpr double kMinSteps = 4;
    const T size = static_cast<T>(farthest);
    const double step = static_cast<double>(std::nextafter(size, std::numeric_limits<T>::infinity()) - size);
    return voxel >= kMinSteps * step;
}

// "scalar_gps_time": the properties of fields, by the custom of CloudCompare. Equal ones are numbered.
std::vector<std::string> properties_of(std::span<const Field> fields) {
    std::vector<std::string> names;
    for (const Field &field : fields) {
        std::string name = "scalar_" + field.name;
        std::replace(name.begin(), name.end(), ' ', '_');
        std::string distinct = name;
        for (int number = 2; std::find(names.begin(), names.end(), distinct) != names.end(); ++number)
            distinct = name + "_" + std::to_string(number);
        names.push_back(std::move(distinct));
    }
    return names;
}

// Whether floats distinguish the values of a field.
bool fits_float(const Field &field) {
    const double farthest = std::max(std::fabs(field.value(1)), std::fabs(field.value(field.max_stored())));
    return farthest < static_cast<double>(std::numeric_limits<float>::max()) && resolves<float>(field.scale, farthest);
}

double farthest_coordinate(const Grid &grid) {
    double farthest = 0;
    for (const double corner : grid.origin)
        farthest = std::max({farthest, std::fabs(corner), std::fabs(corner + grid.edge())});
    return farthest;
}

} // namespace

Result<PlyPoints> PlyPoints::of(const Reader &reader, int level, std::uint64_t count, PlyFormat format) {
    const Grid &grid = reader.parameters().grid;
    const double voxel = grid.voxel_size_at(level), farthest = farthest_coordinate(grid);
    if (!resolves<double>(voxel, farthest))
        return Error{ErrorCode::unsupported_feature, 0,
                     "voxels of " + text_of(voxel) + " near " + text_of(farthest) +
                         " are finer than double precision: doubles cannot hold their centres"};
    if (format.single_precision &&
        !(farthest < static_cast<double>(std::numeric_limits<float>::max()) && resolves<float>(voxel, farthest)))
        return usage_error("voxels of " + text_of(voxel) + " near " + text_of(farthest) +
                           " are finer than single precision; leave --float out, or export a coarser level");
    return PlyPoints(reader, level, count, format);
}

bool PlyPoints::has_materials() const {
    const std::vector<Material> &materials = reader_->parameters().materials;
    return materials.size() > 1 || materials.front() != Material{};
}

bool PlyPoints::has_shapes() const {
    const std::vector<Material> &materials = reader_->parameters().materials;
    return std::any_of(materials.begin(), materials.end(), is_round);
}

bool PlyPoints::has_tints() const {
    const std::vector<Material> &materials = reader_->parameters().materials;
    return std::any_of(materials.begin(), materials.end(), [](const Material &m) { return m.tint > 0; });
}

StreamList PlyPoints::exported_bytes() const {
    StreamList streams;
    for (const StreamInfo &stream : streams_of(attributes()))
        if (!traits_of(stream.kind).ply_property.empty())
            streams.add(stream.kind, stream.light);
    return streams;
}

std::string PlyPoints::header() const {
    const Grid &grid = reader_->parameters().grid;
    std::string text = "ply\nformat ";
    text += format_.ascii ? "ascii" : "binary_little_endian";
    text += " 1.0\ncomment generator pbm-export " PBM_VERSION "\n";
    text += credits(reader_->metadata());
    text += "comment unit " + std::string(to_string(grid.unit)) + "\n";
    text += "comment up " + std::string(to_string(grid.up)) + "\n";
    text += "comment grid origin " + text_of(grid.origin[0]) + " " + text_of(grid.origin[1]) + " " +
            text_of(grid.origin[2]) + " voxel_size " + text_of(grid.voxel_size) + " depth " + text_of(grid.depth) +
            "\n";
    if (level_ != grid.depth)
        text += "comment level " + text_of(level_) + "\n";
    text += "element vertex " + text_of(count_) + "\n";
    const auto properties = [&](std::string_view type, std::initializer_list<std::string_view> names) {
        for (const std::string_view name : names)
            text.append("property ").append(type).append(" ").append(name).append("\n");
    };
    properties(format_.single_precision ? "float" : "double", {"x", "y", "z"});
    properties("float", {"nx", "ny", "nz", "radius"});
    if (attributes().colour != ColourFormat::none)
        properties("uchar", {"red", "green", "blue"});
    for (const StreamInfo &stream : exported_bytes())
        properties("uchar", {traits_of(stream.kind).ply_property});
    properties("uchar", {"two_sided"});
    const std::vector<Field> &fields = reader_->parameters().fields;
    const std::vector<std::string> names = properties_of(fields);
    for (std::size_t f = 0; f < fields.size(); ++f)
        properties(fits_float(fields[f]) ? "float" : "double", {names[f]});
    if (has_materials()) {
        text += "element material " + text_of(reader_->parameters().materials.size()) + "\n";
        properties("float", {"ka", "kd", "ks", "power"});
        properties("uchar", {"clr_r", "clr_g", "clr_b"});
        properties("float", {"envmapfactor"});
        if (has_shapes())
            properties("uchar", {"shape"});
        if (has_tints())
            properties("uchar", {"tint"});
    }
    return text + "end_header\n";
}

std::size_t PlyPoints::row_bytes() const {
    const std::size_t numbers = 3 + 3 + 1 + 3 + exported_bytes().size() + 1 + reader_->parameters().fields.size();
    return numbers * (format_.ascii ? Row::kLongestNumber + 1 : sizeof(double));
}

Bytes PlyPoints::rows(const PointBlock &block) const {
    const Grid &grid = reader_->parameters().grid;
    const double voxel = grid.voxel_size_at(level_);
    const ColourFormat colour = attributes().colour;
    const StreamList bytes_of_points = exported_bytes();
    std::array<float, 256> radii{};
    for (std::size_t i = 0; i < radii.size(); ++i)
        radii[i] =
            std::nextafter(static_cast<float>(radius_fraction(static_cast<std::uint8_t>(i)) * grid.edge()), 0.0F);

    const std::vector<Field> &fields = reader_->parameters().fields;
    std::array<bool, kMaxFields> are_floats{};
    std::transform(fields.begin(), fields.end(), are_floats.begin(), fits_float);

    Bytes bytes(block.codes.size() * row_bytes());
    std::uint8_t *at = bytes.data();
    for (std::size_t i = 0; i < block.codes.size(); ++i) {
        Row row(at, format_.ascii);
        const auto place = morton_decode(block.codes[i]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double centre = grid.origin[axis] + (static_cast<double>(place[axis]) + 0.5) * voxel;
            format_.single_precision ? row.add(static_cast<float>(centre)) : row.add(centre);
        }
        const std::uint16_t normal = block.points.normals[i];
        for (const double component : normal_table()[normal & kNormalIndexMask])
            row.add(static_cast<float>(component));
        row.add(radii[block.points.radii[i]]);
        if (colour != ColourFormat::none)
            for (const std::uint8_t channel : point_colour(block.points.colours, i, colour))
                row.add(channel);
        for (const StreamInfo &stream : bytes_of_points)
            row.add(block.points.values(stream)[i]);
        row.add(static_cast<std::uint8_t>((normal & kTwoSidedBit) != 0 ? 1 : 0));
        for (std::size_t f = 0; f < fields.size(); ++f) {
            const std::uint32_t stored = stored_value(block.fields[f], i, fields[f].bytes);
            const double value = stored == 0 ? std::numeric_limits<double>::quiet_NaN() : fields[f].value(stored);
            are_floats[f] ? row.add(static_cast<float>(value)) : row.add(value);
        }
        at = row.end();
    }
    bytes.resize(static_cast<std::size_t>(at - bytes.data()));
    return bytes;
}

std::string PlyPoints::materials() const {
    if (!has_materials())
        return {};
    std::string all;
    for (const Material &m : reader_->parameters().materials) {
        std::array<std::uint8_t, 10 * (Row::kLongestNumber + 1)> bytes{};
        Row row(bytes.data(), format_.ascii);
        for (const float factor : {m.ka, m.kd, m.ks, m.power})
            row.add(factor);
        for (const std::uint8_t channel : m.colour)
            row.add(channel);
        row.add(m.environment);
        if (has_shapes())
            row.add(static_cast<std::uint8_t>(m.shape));
        if (has_tints())
            row.add(m.tint);
        all.append(bytes.data(), row.end());
    }
    return all;
}

} // namespace pbm
