#include "model.h"

#include "drawing.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/model/octree.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/reading/point_stream_reader.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

namespace pbm::c_api {
namespace {

constexpr std::uint64_t kMaxPiece = std::uint64_t{8} << 20; // bytes that one call of a callback reads

const char *c_string(std::string_view literal) {
    return literal.data(); // NOLINT(bugprone-suspicious-stringview-data-usage): literals end with a zero byte
}

std::uint32_t attributes_of(const Reader &reader) {
    const ModelParameters &parameters = reader.parameters();
    const AttributeSet &set = parameters.attributes;
    std::uint32_t bits = 0;
    const auto add = [&](bool has, std::uint32_t bit) { bits |= has ? bit : 0; };
    add(set.colour != ColourFormat::none, PBM_HAS_COLOURS);
    add(set.material, PBM_HAS_MATERIALS);
    add(set.texture, PBM_HAS_TEXTURE);
    add(set.lights > 0, PBM_HAS_SHADOWS);
    add(parameters.ground.has_value(), PBM_HAS_GROUND);
    add(reader.section(SectionType::panorama) != nullptr, PBM_HAS_PANORAMA);
    add(parameters.closed, PBM_IS_CLOSED);
    add(std::any_of(parameters.materials.begin(), parameters.materials.end(), is_round), PBM_HAS_ROUND_POINTS);
    add(PointStreamReader(reader, PointStream::sides).has(reader.depth()), PBM_HAS_SIDES);
    add(PointStreamReader(reader, PointStream::offsets).has(reader.depth()), PBM_HAS_OFFSETS);
    return bits;
}

constexpr std::size_t kMaxCoarsePoints = std::size_t{1} << 3 * kCoarseLevel;

// Fills the box around the voxels of a coarse level.
Status find_box(OpenModel &model, pbm_info &info) {
    const Grid &grid = model.reader.parameters().grid;
    const Result<std::span<const Level>> levels = model.coarse_levels();
    if (!levels)
        return levels.error();
    std::vector<MortonCode> codes{0};
    for (const Level &next : levels->subspan(1)) {
        Result<std::vector<MortonCode>> below = expand_level(codes, next.masks, kMaxCoarsePoints);
        if (!below)
            return below.error();
        codes = std::move(*below);
    }
    std::array<std::uint32_t, 3> lowest{UINT32_MAX, UINT32_MAX, UINT32_MAX}, highest{};
    for (const MortonCode code : codes) {
        const std::array<std::uint32_t, 3> at = morton_decode(code);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            lowest[axis] = std::min(lowest[axis], at[axis]);
            highest[axis] = std::max(highest[axis], at[axis] + 1);
        }
    }
    const double edge = grid.voxel_size_at(static_cast<int>(levels->size()) - 1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        info.lowest[axis] = grid.origin[axis] + lowest[axis] * edge;
        info.highest[axis] = grid.origin[axis] + highest[axis] * edge;
    }
    return {};
}

Status fill_info(OpenModel &model, pbm_info &info) {
    const Reader &reader = model.reader;
    const ModelParameters &parameters = reader.parameters();
    info.file_bytes = reader.header().file_size;
    info.points = reader.header().point_count;
    info.depth = reader.depth();
    info.attributes = attributes_of(reader);
    std::copy(parameters.grid.origin.begin(), parameters.grid.origin.end(), info.origin);
    info.voxel_size = parameters.grid.voxel_size;
    info.unit = c_string(to_string(parameters.grid.unit));
    info.up = c_string(to_string(parameters.grid.up));
    info.metadata = model.metadata.c_str();
    const std::string id = hexadecimal(reader.header().content_id);
    std::copy_n(id.c_str(), std::min(id.size() + 1, sizeof info.content_id), info.content_id);
    info.content_id[sizeof info.content_id - 1] = 0;
    info.fields = static_cast<std::int32_t>(parameters.fields.size());
    info.materials = static_cast<std::int32_t>(parameters.materials.size());
    info.lights = static_cast<std::int32_t>(parameters.lights.size());
    return find_box(model, info);
}

Status fill_field(const OpenModel &model, std::int32_t index, pbm_field &to) {
    const std::vector<Field> &fields = model.reader.parameters().fields;
    if (index < 0 || static_cast<std::size_t>(index) >= fields.size())
        return usage_error("field " + std::to_string(index) + " is not there: the model has " +
                           std::to_string(fields.size()));
    const Field &field = fields[static_cast<std::size_t>(index)];
    to.name = field.name.c_str();
    to.unit = field.unit.c_str();
    to.lowest = field.offset;
    to.step = field.scale;
    to.bits = 8 * field.bytes;
    to.average = c_string(to_string(field.average));
    return {};
}

} // namespace

FileBytes FileBytes::held(HeldBytes whole, void (*start_reading)(ByteView)) {
    FileBytes bytes;
    bytes.whole_ = std::move(whole);
    bytes.source_.emplace(bytes.whole_.bytes, start_reading);
    return bytes;
}

FileBytes FileBytes::ranged(pbm_read_range read, void *context, std::uint64_t size) {
    FileBytes bytes;
    bytes.read_ = read;
    bytes.context_ = context;
    bytes.sparse_ = std::make_shared<SparseFile>(size);
    bytes.source_.emplace(bytes.sparse_);
    return bytes;
}

Status FileBytes::fetch_piece(FileRange piece, Fetched &fetched) const {
    if (source_->has(piece))
        return {};
    Bytes bytes(static_cast<std::size_t>(piece.bytes));
    const CallbackScope scope(handle_);
    const int answer = read_(context_, piece.offset, piece.bytes, bytes.data());
    if (answer == 0) {
        sparse_->fill(piece.offset, bytes);
        fetched.any_arrived = true;
    } else if (answer == PBM_LATER) {
        fetched.pending = fetched.pending.value_or(piece);
    } else {
        return Error{ErrorCode::io, piece.offset,
                     "the callback did not read " + std::to_string(piece.bytes) + " bytes from byte " +
                         std::to_string(piece.offset) + " on"};
    }
    return {};
}

Result<FileBytes::Fetched> FileBytes::fetch(std::span<const FileRange> ranges) const {
    Fetched fetched;
    if (is_whole())
        return fetched;
    const std::uint64_t size = sparse_->size();
    for (const FileRange &range : ranges) {
        if (range.offset > size || range.bytes > size - range.offset)
            return Error{ErrorCode::truncated, size, "the file ends before byte " + std::to_string(range.offset)};
        for (std::uint64_t done = 0; done < range.bytes; done += kMaxPiece)
            if (Status status = fetch_piece({range.offset + done, std::min(kMaxPiece, range.bytes - done)}, fetched);
                !status)
                return status.error();
    }
    return fetched;
}

Status FileBytes::require(std::span<const FileRange> ranges) const {
    const Result<Fetched> fetched = fetch(ranges);
    if (!fetched)
        return fetched.error();
    if (fetched->pending)
        throw Pending{*fetched->pending};
    return {};
}

Result<ByteView> FileBytes::whole() {
    if (!is_whole() && whole_.owner == nullptr) {
        const FileRange all{0, sparse_->size()};
        if (Status status = require({&all, 1}); !status)
            return status.error();
        Result<HeldBytes> bytes = source_->require(all);
        if (!bytes)
            return bytes.error();
        whole_ = std::move(*bytes);
        source_->drop(all);
    }
    return whole_.bytes;
}

void FileBytes::limit_memory(std::uint64_t max_memory) const {
    if (!is_whole() && sparse_->memory() > max_memory)
        source_->drop({0, sparse_->size()});
}

Result<Reader> open_reader(const FileBytes &bytes) {
    for (FileRange range; (range = Reader::opening_range(bytes.source())).bytes > 0;)
        if (const Status fetched = bytes.require({&range, 1}); !fetched)
            return fetched.error();
    return Reader::open(bytes.source());
}

OpenModel::OpenModel(FileBytes of, Reader opened)
    : bytes(std::move(of)), reader(std::move(opened)), metadata(reader.metadata()) {}
OpenModel::~OpenModel() = default;

Result<std::span<const Level>> OpenModel::coarse_levels() {
    if (coarse_levels_.empty()) {
        const int level = std::min(kCoarseLevel, reader.depth());
        if (const Status fetched = fetch_levels(*this, level); !fetched)
            return fetched.error();
        Result<Model> coarse = load_levels(reader, {.max_level = level, .threads = 1});
        if (!coarse)
            return coarse.error();
        coarse_levels_ = std::move(coarse->levels);
    }
    return std::span<const Level>(coarse_levels_);
}

Result<const LevelDirectory *> OpenModel::directory(int level) {
    std::vector<FileRange> ranges;
    for (int l = 1; l <= level; ++l)
        ranges.push_back(reader.directory_range(l));
    if (const Status fetched = bytes.require(ranges); !fetched)
        return fetched.error();
    for (int l = 1; l < level; ++l)
        if (Result<const LevelDirectory *> above = reader.directory(l); !above)
            return above;
    return reader.directory(level);
}

namespace {

// Appends the ranges of the file that hold the chunks of a level, and the streams of their points.
void list_chunks(const Reader &reader, int level, std::vector<FileRange> &ranges) {
    for (const PointStream kind : kPointStreams) {
        const PointStreamReader stream(reader, kind);
        for (const FileRange range : {stream.directory_range(level), stream.values_range(level)})
            if (range.bytes > 0)
                ranges.push_back(range);
    }
    for (const SectionType type : {SectionType::level_chunks, SectionType::level_bricks})
        if (const SectionEntry *section = reader.section(type, static_cast<std::uint32_t>(level)))
            ranges.push_back(section->range());
}

} // namespace

Status check_level(const OpenModel &model, int level) {
    if (level >= 0 && level <= model.reader.depth())
        return {};
    return usage_error("level " + std::to_string(level) + " is not there: the model has levels 0 .. " +
                       std::to_string(model.reader.depth()));
}

Error no_room(std::uint64_t capacity, std::uint64_t points) {
    return usage_error("the arrays have room for " + std::to_string(capacity) + " points, the level has " +
                       std::to_string(points));
}

Status fetch_levels(OpenModel &model, int level) {
    if (level == 0)
        return {};
    std::vector<FileRange> ranges;
    for (int l = 1; l <= level; ++l) {
        ranges.push_back(model.reader.directory_range(l));
        list_chunks(model.reader, l, ranges);
    }
    if (Status fetched = model.bytes.require(ranges); !fetched)
        return fetched;
    const Result<const LevelDirectory *> directory = model.directory(level);
    return directory ? Status() : Status(directory.error());
}

void drop_levels(const OpenModel &model, int level) {
    std::vector<FileRange> ranges;
    for (int l = 1; l <= level; ++l)
        list_chunks(model.reader, l, ranges);
    for (const FileRange &range : ranges)
        model.bytes.source().drop(range);
}

Handles<pbm_model, OpenModel> &models() {
    static auto &all = *new Handles<pbm_model, OpenModel>; // never destroyed: threads may outlive main
    return all;
}

Status add_model(FileBytes bytes, pbm_model **model) {
    Result<Reader> reader = open_reader(bytes);
    if (!reader)
        return reader.error();
    auto open = std::make_unique<OpenModel>(std::move(bytes), std::move(*reader));
    OpenModel &opened = *open;
    pbm_model *const handle = models().add(std::move(open));
    opened.bytes.belongs_to(handle);
    *model = handle;
    return {};
}

HeldBytes aligned(ByteView bytes) {
    constexpr std::uintptr_t kAlignment = 8;
    if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kAlignment == 0)
        return {bytes, nullptr};
    const auto copy = std::make_shared<const Bytes>(bytes.begin(), bytes.end());
    return {*copy, copy};
}

} // namespace pbm::c_api

using namespace pbm;
using namespace pbm::c_api;

namespace {

// Opens what `make` returns. On failure the handle is null.
template <class Make> pbm_code open_model(pbm_model **model, pbm_error *error, const Make &make) {
    return guarded(error, [&]() -> Status {
        if (model == nullptr)
            return usage_error("model is null");
        *model = nullptr;
        Result<FileBytes> bytes = make();
        return bytes ? add_model(std::move(*bytes), model) : Status(bytes.error());
    });
}

} // namespace

pbm_code pbm_open_memory(const void *bytes, uint64_t size, pbm_model **model, pbm_error *error) {
    return open_model(model, error, [&]() -> Result<FileBytes> {
        if (bytes == nullptr)
            return usage_error("bytes is null");
        return FileBytes::held(aligned({static_cast<const std::uint8_t *>(bytes), static_cast<std::size_t>(size)}));
    });
}

pbm_code pbm_open_ranges(pbm_read_range read, void *context, uint64_t size, pbm_model **model, pbm_error *error) {
    return open_model(model, error, [&]() -> Result<FileBytes> {
        if (read == nullptr)
            return usage_error("read is null");
        return FileBytes::ranged(read, context, size);
    });
}

pbm_code pbm_close(pbm_model *model) {
    return guarded(nullptr, [&] { return models().remove(model, "model"); });
}

pbm_code pbm_get_info(pbm_model *model, pbm_info *info, pbm_error *error) {
    return guarded(error, [&] {
        return models().use(model, "model", [&](OpenModel &open) {
            return fill_structure(info, "info", [&](pbm_info &to) { return fill_info(open, to); });
        });
    });
}

pbm_code pbm_get_field(pbm_model *model, int32_t index, pbm_field *field, pbm_error *error) {
    return guarded(error, [&] {
        return models().use(model, "model", [&](OpenModel &open) {
            return fill_structure(field, "field", [&](pbm_field &to) { return fill_field(open, index, to); });
        });
    });
}
