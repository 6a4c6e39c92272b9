#include "pbm_build/parts/part_file.h"

#include "pbm_format/container/field_sections.h"
#include "pbm_format/container/section_encoder.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/model/octree.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <limits>

namespace pbm::build {
namespace {

constexpr std::string_view kMagic = "PBMPART\n";
constexpr std::size_t kHashBytes = sizeof(Hash128);

std::string string_of(ByteView bytes) { return {bytes.begin(), bytes.end()}; }

template <class T> ByteView bytes_of_values(const std::vector<T> &values) {
    return {reinterpret_cast<const std::uint8_t *>(values.data()), values.size() * sizeof(T)};
}

std::string head_of(const PartName &name, const Part &part) {
    return nlohmann::json{{"key", name.key},
                          {"index", name.number.index},
                          {"count", name.number.count},
                          {"depth", part.parameters.grid.depth},
                          {"points", part.voxels.codes.size()},
                          {"has_points", part.has_points},
                          {"closed", part.parameters.closed}}
        .dump();
}

std::string report_of(const BuildStatistics &statistics) {
    nlohmann::json attributes = nlohmann::json::array();
    for (const AttributeReport &line : statistics.attributes)
        attributes.push_back(
            {line.name, static_cast<int>(line.fate), line.note, line.input, static_cast<int>(line.warning)});
    return nlohmann::json{{"attributes", std::move(attributes)},   {"input_bytes", statistics.input_bytes},
                          {"vertices", statistics.vertices},       {"triangles", statistics.triangles},
                          {"made_points", statistics.made_points}, {"samples", statistics.samples}}
        .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Blocks of a file that is being written.
class PartWriter {
  public:
    explicit PartWriter(FileReplacement file) : file_(std::move(file)) { put(as_bytes(kMagic)); }

    void add(ByteView block) {
        ByteWriter length;
        length.u64(block.size());
        put(length.bytes());
        put(block);
    }
    Status finish() {
        const Hash128 hash = hash_.finish();
        put({reinterpret_cast<const std::uint8_t *>(hash.data()), kHashBytes});
        return status_ ? file_.finish() : status_;
    }

  private:
    void put(ByteView bytes) {
        hash_.add(bytes);
        if (status_)
            status_ = file_.write(bytes);
    }

    FileReplacement file_;
    StreamingHash hash_;
    Status status_;
};

// Blocks of a file whose hash is right. After the first that is missing all are empty.
class PartReader {
  public:
    explicit PartReader(ByteView bytes)
        : left_(bytes.subspan(kMagic.size(), bytes.size() - kMagic.size() - kHashBytes)) {}

    ByteView next() {
        ByteReader in(left_);
        const std::uint64_t length = in.u64();
        ok_ = ok_ && in.ok() && length <= left_.size() - in.offset();
        if (!ok_)
            return {};
        const ByteView block = slice(left_, in.offset(), length);
        left_ = left_.subspan(in.offset() + block.size());
        return block;
    }
    // A block of `count` values.
    template <class T> void next(std::vector<T> &values, std::uint64_t count) {
        const ByteView block = next();
        ok_ = ok_ && block.size() / sizeof(T) == count && block.size() % sizeof(T) == 0;
        if (!ok_)
            return;
        values.resize(static_cast<std::size_t>(count));
        std::copy(block.begin(), block.end(), reinterpret_cast<std::uint8_t *>(values.data()));
    }
    bool ok() const { return ok_; }
    bool is_at_end() const { return left_.empty(); }

  private:
    ByteView left_;
    bool ok_ = true;
};

bool is_whole(ByteView bytes) {
    if (bytes.size() < kMagic.size() + kHashBytes || string_of(bytes.first(kMagic.size())) != kMagic)
        return false;
    StreamingHash hash;
    hash.add(bytes.first(bytes.size() - kHashBytes));
    const Hash128 right = hash.finish();
    return std::memcmp(right.data(), bytes.data() + bytes.size() - kHashBytes, kHashBytes) == 0;
}

Error damaged() {
    return {ErrorCode::bad_input, 0, "this part is damaged, or was written by another version: build it again"};
}

nlohmann::json read_head(PartReader &in) {
    const ByteView text = in.next();
    return nlohmann::json::parse(text.begin(), text.end());
}

// Of a file whose hash is right.
Status check_name(const nlohmann::json &head, const PartName &name) {
    const auto is = [&](const char *key, const nlohmann::json &value) {
        return head.contains(key) && head[key] == value;
    };
    if (!is("key", name.key) || !is("count", name.number.count))
        return Error{ErrorCode::bad_input, 0,
                     "this part belongs to another build: other inputs, options, version or number of parts"};
    if (!is("index", name.number.index))
        return Error{ErrorCode::bad_input, 0, "this is another part than its name says"};
    return {};
}

Status read_parameters(PartReader &in, int depth, ModelParameters &parameters) {
    const auto grid = decode_grid(in.next(), depth);
    const auto set = decode_attributes(in.next(), depth);
    auto materials = decode_materials(in.next());
    if (materials)
        materials = decode_shapes(in.next(), std::move(*materials));
    const ByteView fields = in.next();
    if (!grid || !set || !materials)
        return damaged();
    parameters.grid = *grid;
    parameters.attributes = *set;
    parameters.materials = std::move(*materials);
    if (fields.empty())
        return {};
    auto table = decode_fields(fields);
    if (!table)
        return damaged();
    parameters.fields = std::move(table->fields);
    return {};
}

Status read_report(ByteView text, BuildStatistics &statistics) try {
    const nlohmann::json json = nlohmann::json::parse(text.begin(), text.end());
    for (const nlohmann::json &line : json.at("attributes")) {
        const int fate = line.at(1);
        const std::size_t warning = line.at(4);
        if (fate < 0 || fate > static_cast<int>(Fate::estimated) || warning >= kWarnings.size())
            return damaged();
        statistics.attributes.push_back(
            {line.at(0), static_cast<Fate>(fate), line.at(2), line.at(3), static_cast<Warning>(warning)});
    }
    json.at("input_bytes").get_to(statistics.input_bytes);
    json.at("vertices").get_to(statistics.vertices);
    json.at("triangles").get_to(statistics.triangles);
    json.at("made_points").get_to(statistics.made_points);
    json.at("samples").get_to(statistics.samples);
    return {};
} catch (const nlohmann::json::exception &) {
    return damaged();
}

Status read_voxels(PartReader &in, const ModelParameters &parameters, std::uint64_t points, Voxels &voxels) {
    voxels.codes = {0};
    for (int level = 1; level <= parameters.grid.depth; ++level) {
        const ByteView masks = in.next();
        if (points == 0)
            continue;
        auto codes = expand_level(voxels.codes, masks, std::numeric_limits<std::size_t>::max());
        if (!codes)
            return damaged();
        voxels.codes = std::move(*codes);
    }
    if (points == 0)
        voxels.codes = {};
    if (voxels.codes.size() != points)
        return damaged();
    for_columns(
        parameters.attributes,
        [&](const StreamInfo &, std::size_t width, auto &column) { in.next(column, points * width); }, voxels.points);
    for (const Field &field : parameters.fields)
        in.next(voxels.fields.emplace_back(), points * field.bytes);
    VoxelSides &sides = voxels.sides;
    const ByteView side_codes = in.next();
    sides.codes.resize(side_codes.size() / sizeof(MortonCode));
    std::copy_n(side_codes.begin(), sides.codes.size() * sizeof(MortonCode),
                reinterpret_cast<std::uint8_t *>(sides.codes.data()));
    for_columns(
        parameters.attributes,
        [&](const StreamInfo &stream, std::size_t width, auto &column) {
            if (stream.kind != StreamKind::radius)
                in.next(column, 2 * sides.codes.size() * width);
        },
        sides.values);
    const ByteView offsets = in.next();
    voxels.offsets.assign(offsets.begin(), offsets.end());
    const ByteView made = in.next();
    voxels.made.resize(made.size() / sizeof(MortonCode));
    std::copy_n(made.begin(), voxels.made.size() * sizeof(MortonCode),
                reinterpret_cast<std::uint8_t *>(voxels.made.data()));
    const auto have_materials = [&](const Bytes &materials) {
        return std::all_of(materials.begin(), materials.end(),
                           [&](std::uint8_t material) { return material < parameters.materials.size(); });
    };
    const bool is_right =
        have_materials(voxels.points.materials) && have_materials(sides.values.materials) &&
        (offsets.empty() || offsets.size() == points) &&
        std::all_of(voxels.offsets.begin(), voxels.offsets.end(),
                    [](std::int8_t offset) { return offset == kNoOffset || std::abs(offset) <= Offsets::kMost; }) &&
        std::includes(voxels.codes.begin(), voxels.codes.end(), sides.codes.begin(), sides.codes.end());
    return in.ok() && in.is_at_end() && is_right ? Status() : Status(damaged());
}

Result<MappedFile> open_part(const std::string &path) {
    Result<MappedFile> file = MappedFile::open(path);
    if (file && !is_whole(file->bytes()))
        return damaged();
    return file;
}

} // namespace

std::string part_file_name(const std::string &output, const PartNumber &number) {
    return output + ".part-" + std::to_string(number.index) + "-of-" + std::to_string(number.count);
}

Status write_part(const std::string &path, const PartName &name, const Part &part) {
    Result<FileReplacement> file = FileReplacement::begin(path);
    if (!file)
        return file.error();
    PartWriter out(std::move(*file));
    const ModelParameters &parameters = part.parameters;
    const int depth = parameters.grid.depth;
    out.add(as_bytes(head_of(name, part)));
    out.add(encode_grid(parameters.grid));
    out.add(encode_attributes(parameters.attributes, depth));
    out.add(encode_materials(parameters.materials));
    out.add(encode_shapes(parameters.materials));
    const std::vector<Field> &fields = parameters.fields;
    out.add(fields.empty() ? Bytes()
                           : encode_fields({.fields = fields, .roots = std::vector<std::uint16_t>(fields.size())}));
    out.add(as_bytes(part.metadata));
    out.add(as_bytes(report_of(part.statistics)));
    const Voxels &voxels = part.voxels;
    const LevelMasks masks =
        voxels.codes.empty() ? LevelMasks(static_cast<std::size_t>(depth) + 1) : encode_octree(voxels.codes, depth);
    for (std::size_t level = 1; level < masks.size(); ++level)
        out.add(masks[level]);
    for_columns(
        parameters.attributes,
        [&](const StreamInfo &, std::size_t, const auto &column) { out.add(bytes_of_values(column)); }, voxels.points);
    for (const Bytes &field : voxels.fields)
        out.add(field);
    out.add(bytes_of_values(voxels.sides.codes));
    for_columns(
        parameters.attributes,
        [&](const StreamInfo &stream, std::size_t, const auto &column) {
            if (stream.kind != StreamKind::radius)
                out.add(bytes_of_values(column));
        },
        voxels.sides.values);
    out.add(bytes_of_values(voxels.offsets));
    out.add(bytes_of_values(voxels.made));
    return out.finish();
}

Result<Part> read_part(const std::string &path, const PartName &name) try {
    const Result<MappedFile> file = open_part(path);
    if (!file)
        return file.error();
    PartReader in(file->bytes());
    const nlohmann::json head = read_head(in);
    if (const Status named = check_name(head, name); !named)
        return named.error();
    Part part;
    part.has_points = head.at("has_points");
    part.parameters.closed = head.at("closed");
    const int depth = head.at("depth");
    if (depth < kMinDepth || depth > kMaxDepth)
        return damaged();
    if (const Status read = read_parameters(in, depth, part.parameters); !read)
        return read.error();
    part.metadata = string_of(in.next());
    if (const Status read = read_report(in.next(), part.statistics); !read)
        return read.error();
    if (const Status read = read_voxels(in, part.parameters, head.at("points"), part.voxels); !read)
        return read.error();
    return part;
} catch (const nlohmann::json::exception &) {
    return damaged();
}

std::optional<PartFigures> find_part(const std::string &path, const PartName &name) try {
    const Result<MappedFile> file = open_part(path);
    if (!file)
        return std::nullopt;
    PartReader in(file->bytes());
    const nlohmann::json head = read_head(in);
    if (!check_name(head, name))
        return std::nullopt;
    const Result<Grid> grid = decode_grid(in.next(), head.at("depth"));
    if (!grid)
        return std::nullopt;
    return PartFigures{*grid, head.at("points")};
} catch (const nlohmann::json::exception &) {
    return std::nullopt;
}

} // namespace pbm::build
