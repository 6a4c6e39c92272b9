#include "point_stream.h"

#include "system/threads/parallel.h"

#include <algorithm>
#include <memory>
#include <optional>

namespace pbm {
namespace {

struct ChunkWithFields : Chunk {
    std::vector<Bytes> fields; // stored values
};

// A chunk of the wanted level, its parent chunk, and the codes of its points' parents.
struct Job {
    std::size_t chunk = 0;
    std::shared_ptr<const ChunkWithFields> parent;
    std::vector<MortonCode> parents;
    Result<Bytes> rows = Bytes();
};

std::vector<Bytes> root_values(const FieldReader *fields) {
    std::vector<Bytes> values;
    for (std::size_t f = 0; fields != nullptr && f < fields->fields().size(); ++f)
        values.push_back(fields->root_value(f));
    return values;
}

// Traverses the tree of chunks depth first, which is the Morton order of the points, and runs jobs in batches.
class ChunkWalk {
  public:
    // `fields`: of a file that has some, with the directories of the levels; or null.
    ChunkWalk(Reader &reader, const FieldReader *fields, const StreamOptions &options, std::size_t batch,
              const PointSink &sink)
        : reader_(reader), fields_(fields), options_(options), batch_(batch), sink_(sink) {
        for (int level = 1; level <= options.level; ++level)
            directories_.push_back(reader.directory(level).value());
        next_.resize(directories_.size(), 0);
    }

    Status run() {
        const std::vector<MortonCode> root{0};
        const auto root_chunk =
            std::make_shared<const ChunkWithFields>(ChunkWithFields{reader_.root_chunk(), root_values(fields_)});
        while (next_.front() < directories_[0]->chunks.size())
            if (Status status = visit(1, root_chunk, root, 0); !status)
                return status;
        return flush();
    }

  private:
    // Visits the next chunk of `level`; `parents` are the codes of the level above from its node `first` on.
    Status visit(int level, const std::shared_ptr<const ChunkWithFields> &parent, std::span<const MortonCode> parents,
                 std::uint64_t first) {
        const auto index = static_cast<std::size_t>(level) - 1;
        const std::size_t chunk = next_[index]++;
        const ChunkEntry &entry = directories_[index]->chunks[chunk];
        const auto own = parents.subspan(static_cast<std::size_t>(entry.first_node - first), entry.shape.nodes);
        if (level == options_.level) {
            jobs_.push_back({chunk, parent, {own.begin(), own.end()}});
            return jobs_.size() < batch_ ? Status() : flush();
        }
        const auto decoded = std::make_shared<ChunkWithFields>();
        if (Status status = load(level, chunk, *parent, *decoded); !status)
            return status;
        const Result<std::vector<MortonCode>> codes = expand_level(own, decoded->masks, entry.shape.points);
        if (!codes)
            return codes.error();
        const std::vector<ChunkEntry> &below = directories_[index + 1]->chunks;
        std::size_t &next = next_[index + 1];
        while (next < below.size() && below[next].shape.parent_chunk == chunk)
            if (Status status = visit(level + 1, decoded, *codes, entry.first_point); !status)
                return status;
        return {};
    }

    // Decodes a chunk and its fields.
    Status load(int level, std::size_t index, const ChunkWithFields &parent, ChunkWithFields &to) const {
        if (Status status = reader_.load_chunk(level, index, parent, to); !status || fields_ == nullptr)
            return status;
        const std::vector<ChunkEntry> &above = directories_[static_cast<std::size_t>(std::max(level, 2)) - 2]->chunks;
        const ChunkEntry &entry = directories_[static_cast<std::size_t>(level) - 1]->chunks[index];
        const std::uint64_t first = level == 1 ? 0 : above[entry.shape.parent_chunk].first_point;
        to.fields.resize(fields_->fields().size());
        for (std::size_t f = 0; f < to.fields.size(); ++f) {
            const std::uint64_t bytes = fields_->fields()[f].bytes;
            const ByteView nodes =
                slice(parent.fields[f], bytes * (entry.first_node - first), bytes * entry.shape.nodes);
            if (Status status = fields_->load(level, index, f, to.masks, nodes, to.fields[f]); !status)
                return status;
        }
        return {};
    }

    Result<Bytes> rows_of(const Job &job) const {
        ChunkWithFields chunk;
        if (const Status status = load(options_.level, job.chunk, *job.parent, chunk); !status)
            return status.error();
        const Result<std::vector<MortonCode>> codes = expand_level(job.parents, chunk.masks, chunk.points.size());
        if (!codes)
            return codes.error();
        return sink_.encode({*codes, chunk.points, chunk.fields});
    }

    Status flush() {
        parallel_for(jobs_.size(), options_.threads, [&](std::size_t i) { jobs_[i].rows = rows_of(jobs_[i]); });
        for (const Job &job : jobs_) {
            if (!job.rows)
                return job.rows.error();
            if (Status status = sink_.write(*job.rows); !status)
                return status;
        }
        if (sink_.progress && !jobs_.empty())
            sink_.progress(static_cast<double>(jobs_.back().chunk + 1) /
                           static_cast<double>(directories_.back()->chunks.size()));
        jobs_.clear();
        return {};
    }

    Reader &reader_;
    const FieldReader *fields_;
    const StreamOptions &options_;
    std::size_t batch_;
    const PointSink &sink_;
    std::vector<const LevelDirectory *> directories_; // [level - 1]
    std::vector<std::size_t> next_;                   // [level - 1]: next chunk
    std::vector<Job> jobs_;
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
    std::uint64_t fixed = 0;
    for (int level = 1; level <= options.level; ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        fixed += (*directory)->chunks.size() *
                 (sizeof(ChunkEntry) + streams_of(reader.parameters().attributes).size() * sizeof(StreamEntry));
        fixed += chunk_bytes(reader);
        if (Status read = fields ? fields->read_directory(**directory) : Status(); !read)
            return read;
    }
    // Codes of the parents, the points twice (stored and decoded), and the rows.
    const std::uint64_t per_job =
        2 * chunk_bytes(reader) + (sizeof(MortonCode) + sink.row_bytes) * reader.header().chunk_points;
    if (options.max_memory < fixed + per_job)
        return Error{ErrorCode::memory, 0,
                     "the level needs " + std::to_string((fixed + per_job) >> 20) +
                         " MiB of memory, more than allowed (" + std::to_string(options.max_memory >> 20) +
                         " MiB): export a coarser level or allow more"};
    if (options.level == 0) {
        const PointAttributes root = root_points(reader.header().root, reader.parameters().attributes);
        const std::vector<MortonCode> codes{0};
        return sink.write(sink.encode({codes, root, root_values(fields ? &*fields : nullptr)}));
    }
    const std::uint64_t useful = 2 * static_cast<std::uint64_t>(resolve_threads(options.threads));
    const auto batch = static_cast<std::size_t>(std::min(useful, (options.max_memory - fixed) / per_job));
    return ChunkWalk(reader, fields ? &*fields : nullptr, options, batch, sink).run();
}

} // namespace pbm
