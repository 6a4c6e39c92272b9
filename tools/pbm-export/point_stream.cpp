#include "point_stream.h"

#include "pbm_format/chunks/chunk_walk.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <cassert>
#include <optional>

namespace pbm {
namespace {

struct ChunkWithFields : Chunk {
    std::vector<Bytes> fields; // stored values
};

// What is kept of a chunk: of the wanted level its rows, of those above what the chunks below need.
struct ChunkData {
    ChunkWithFields chunk;
    std::vector<MortonCode> codes; // of its points
    Status status;
    Bytes rows;
};
using Walked = WalkedChunk<ChunkData>;

std::vector<Bytes> root_values(const FieldReader *fields) {
    std::vector<Bytes> values;
    for (std::size_t f = 0; fields != nullptr && f < fields->fields().size(); ++f)
        values.push_back(fields->root_value(f));
    return values;
}

// Puts both sides of the points that have some in their place. Returns the codes of all points then.
std::vector<MortonCode> with_sides(const Sides &sides, const AttributeSet &set, std::span<const Field> fields,
                                   std::span<const MortonCode> codes, ChunkWithFields &chunk) {
    const auto spread = [&](std::size_t width, auto &column, const auto &of_sides) {
        auto from = std::move(column);
        column = {};
        std::size_t next = 0;
        for (std::size_t i = 0; i * width < from.size(); ++i) {
            const auto at = from.begin() + static_cast<std::ptrdiff_t>(i * width);
            const bool is_sided = next < sides.size() && sides.points[next] == i;
            if (is_sided && !of_sides.empty()) {
                const auto side = of_sides.begin() + static_cast<std::ptrdiff_t>(2 * width * next);
                column.insert(column.end(), side, side + static_cast<std::ptrdiff_t>(2 * width));
            } else {
                for (int times = is_sided ? 2 : 1; times > 0; --times)
                    column.insert(column.end(), at, at + static_cast<std::ptrdiff_t>(width));
            }
            next += is_sided ? 1 : 0;
        }
    };
    std::vector<MortonCode> all(codes.begin(), codes.end());
    spread(1, all, std::vector<MortonCode>());
    for_columns(
        set,
        [&](const StreamInfo &, std::size_t width, auto &column, const auto &of_sides) {
            if (width > 0)
                spread(width, column, of_sides);
        },
        chunk.points, sides.values);
    for (std::size_t f = 0; f < chunk.fields.size(); ++f)
        spread(fields[f].bytes, chunk.fields[f], Bytes());
    return all;
}

class LevelStream {
  public:
    // `fields`: of a file that has some, with the directories of the levels; or null. `sides`: with that of the wanted
    // level.
    LevelStream(Reader &reader, const FieldReader *fields, const PointStreamReader &sides, const StreamOptions &options,
                const PointSink &sink)
        : reader_(reader), fields_(fields), sides_(sides), options_(options), sink_(sink) {}

    Status run(std::vector<const LevelDirectory *> directories, const WalkLimits &limits) {
        const auto chunks = static_cast<double>(directories.back()->chunks.size());
        Walked root{.loaded = true};
        root.data.chunk = {reader_.root_chunk(), root_values(fields_)};
        root.data.codes = {0};
        Status status;
        ChunkWalk<ChunkData>(std::move(directories), limits)
            .run(
                root,
                [this](Walked &chunk) {
                    chunk.data.status = load(chunk);
                    return chunk.data.status.ok();
                },
                [&](std::span<Walked> batch) {
                    for (Walked &chunk : batch) {
                        status = std::move(chunk.data.status);
                        if (status && chunk.level == options_.level)
                            status = sink_.write(chunk.data.rows);
                        if (!status)
                            return false;
                    }
                    if (sink_.progress && batch.front().level == options_.level)
                        sink_.progress(static_cast<double>(batch.back().index + 1) / chunks);
                    return true;
                });
        return status;
    }

  private:
    Status load(Walked &walked) const {
        const ChunkEntry &entry = *walked.entry;
        const ChunkData &above = walked.above->data;
        const std::uint64_t first = walked.above->entry == nullptr ? 0 : walked.above->entry->first_point;
        const bool is_last = walked.level == options_.level;
        ChunkWithFields &chunk = is_last ? per_thread<ChunkWithFields>() : walked.data.chunk;
        if (Status status = load(walked, entry.first_node - first, chunk); !status)
            return status;
        Result<std::vector<MortonCode>> codes = expand_level(
            std::span(above.codes).subspan(static_cast<std::size_t>(entry.first_node - first), entry.shape.nodes),
            chunk.masks, entry.shape.points);
        if (!codes)
            return codes.error();
        if (is_last && sides_.entry(walked.level, walked.index).raw_bytes > 0) {
            const PointStreamEntry of_sides = sides_.entry(walked.level, walked.index);
            const Result<HeldBytes> stored = reader_.source().require(of_sides.range());
            if (!stored)
                return stored.error();
            Sides sides;
            if (Status status = sides_.load(walked.level, walked.index, entry, stored->bytes, sides); !status)
                return status;
            *codes = with_sides(sides, reader_.parameters().attributes, reader_.parameters().fields, *codes, chunk);
        }
        if (is_last)
            walked.data.rows = sink_.encode({*codes, chunk.points, chunk.fields});
        else
            walked.data.codes = std::move(*codes);
        return {};
    }

    // Loads the chunk and its fields. Its nodes are the points of its parent chunk from `first_node` on.
    Status load(const Walked &walked, std::uint64_t first_node, ChunkWithFields &to) const {
        const ChunkWithFields &above = walked.above->data.chunk;
        if (Status status = reader_.load_chunk(walked.level, walked.index, above, to); !status || fields_ == nullptr)
            return status;
        to.fields.resize(fields_->fields().size());
        for (std::size_t f = 0; f < to.fields.size(); ++f) {
            const std::uint64_t bytes = fields_->fields()[f].bytes;
            const ByteView nodes = slice(above.fields[f], bytes * first_node, bytes * walked.entry->shape.nodes);
            if (Status status = fields_->load(walked.level, walked.index, f, to.masks, nodes, to.fields[f]); !status)
                return status;
        }
        return {};
    }

    Reader &reader_;
    const FieldReader *fields_;
    const PointStreamReader &sides_;
    const StreamOptions &options_;
    const PointSink &sink_;
};

// Upper bound of the bytes of a decoded chunk with the codes of its points.
std::uint64_t chunk_bytes(const Reader &reader) {
    const AttributeSet &set = reader.parameters().attributes;
    std::uint64_t row = sizeof(MortonCode) + 1; // + 1: a mask
    for (const StreamInfo &stream : streams_of(set))
        row += bytes_per_point(stream, set);
    for (const Field &field : reader.parameters().fields)
        row += field.bytes;
    return row * reader.header().chunk_points;
}

} // namespace

Status stream_points(Reader &reader, const StreamOptions &options, const PointSink &sink) {
    assert(options.level >= 0 && options.level <= reader.depth());
    std::optional<FieldReader> fields;
    if (!reader.parameters().fields.empty()) {
        Result<FieldReader> opened = FieldReader::open(reader);
        if (!opened)
            return opened.error();
        fields = std::move(*opened);
    }
    if (options.level == 0) {
        const PointAttributes root = root_points(reader.header().root, reader.parameters().attributes);
        const std::vector<MortonCode> codes{0};
        return sink.write(sink.encode({codes, root, root_values(fields ? &*fields : nullptr)}));
    }
    PointStreamReader sides(reader, PointStream::sides);
    std::uint64_t fixed = 0;
    std::vector<const LevelDirectory *> directories{nullptr};
    for (int level = 1; level <= options.level; ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        directories.push_back(*directory);
        fixed += (*directory)->chunks.size() *
                 (sizeof(ChunkEntry) + streams_of(reader.parameters().attributes).size() * sizeof(StreamEntry));
        if (Status read = fields ? fields->read_directory(**directory) : Status(); !read)
            return read;
    }
    if (Status read = sides.read_directory(*directories.back()); !read)
        return read;
    // Rows of the wanted level and chunks of the levels above it, and for each thread the points twice (stored and
    // decoded) with their codes.
    const std::uint64_t twice = sides.has(options.level) ? 2 : 1; // points with sides are two rows
    const auto memory = [&](std::size_t batch, std::size_t threads) {
        std::uint64_t sum = fixed + 2 * twice * threads * chunk_bytes(reader);
        for (const LevelDirectory *directory : directories)
            if (directory != nullptr)
                sum += ChunkWalk<ChunkData>::batch_of(*directory, batch) *
                       (directory == directories.back() ? twice * sink.row_bytes * reader.header().chunk_points
                                                        : chunk_bytes(reader));
        return sum;
    };
    if (options.max_memory < memory(1, 1))
        return Error{ErrorCode::memory, 0,
                     "the level needs " + std::to_string(memory(1, 1) >> 20) + " MiB of memory, more than allowed (" +
                         std::to_string(options.max_memory >> 20) + " MiB): export a coarser level or allow more"};
    const auto threads = static_cast<std::size_t>(resolve_threads(options.threads));
    std::size_t batch = 2 * threads;
    while (batch > 1 && memory(batch, std::min(batch, threads)) > options.max_memory)
        --batch;
    return LevelStream(reader, fields ? &*fields : nullptr, sides, options, sink)
        .run(std::move(directories), {options.level, static_cast<int>(std::min(batch, threads)), batch});
}

} // namespace pbm
