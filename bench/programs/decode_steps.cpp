#include "decode_steps.h"

#include "pbm_format/hashes/hash.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/streams/mask_ranks.h"
#include "pbm_format/streams/unfilter.h"
#include "pbm_format/writing/stream_filter.h"

#include <atomic>
#include <barrier>
#include <thread>

#include <zstd.h>

namespace pbm::bench {

namespace {

// More than any stream of 65,536 points holds.
constexpr std::size_t kFrameBytes = 1 << 20;

// Calls `use(stored bytes)` for every zstd frame of stream `s` of every chunk.
template <class Use>
void for_each_frame(ByteView file, const std::vector<const LevelDirectory *> &directories, std::size_t s, Use &&use) {
    for (std::size_t level = 1; level < directories.size(); ++level)
        for (const ChunkEntry &chunk : directories[level]->chunks) {
            std::uint64_t offset = chunk.offset;
            for (std::size_t before = 0; before < s; ++before)
                offset += chunk.streams[before].stored_bytes;
            const ByteView stored = file.subspan(offset, chunk.streams[s].stored_bytes);
            if (chunk.streams[s].zstd)
                use(stored);
            const std::size_t planes = plane_count(chunk.streams[s].filter);
            std::size_t at = kPlaneEntryBytes * planes;
            for (std::size_t p = 0; p < planes; ++p) {
                std::uint32_t entry = 0;
                std::memcpy(&entry, stored.data() + kPlaneEntryBytes * p, kPlaneEntryBytes);
                if (entry >> 31 != 0)
                    use(stored.subspan(at, entry & 0xFFFFFF));
                at += entry & 0xFFFFFF;
            }
        }
}

void hash_chunks(ByteView file, const std::vector<const LevelDirectory *> &directories) {
    std::uint64_t wrong = 0;
    for (std::size_t level = 1; level < directories.size(); ++level)
        for (const ChunkEntry &chunk : directories[level]->chunks)
            wrong += hash64(file.subspan(chunk.offset, chunk.stored_bytes)) != chunk.hash ? 1 : 0;
    if (wrong != 0)
        throw std::runtime_error("chunks were changed while they were measured");
}

void decompress(ZSTD_DCtx *context, ByteView stored, Bytes &raw) {
    const std::size_t size = ZSTD_decompressDCtx(context, raw.data(), raw.size(), stored.data(), stored.size());
    if (ZSTD_isError(size) != 0)
        throw std::runtime_error("a frame does not decode");
}

// A filtered stream of a chunk with all inputs of its un-filtering.
struct FilteredStream {
    ByteView masks;
    ChunkNodes nodes;
    std::size_t points;
    std::vector<Bytes> planes; // followed by kSlack bytes
    std::vector<std::size_t> plane_bytes;

    ByteView plane(std::size_t p) const { return ByteView(planes[p]).first(plane_bytes[p]); }
};

// Filters the chunks of a loaded model again and measures un-filtering each stream.
class Unfiltering {
  public:
    Unfiltering(const Model &model, const std::vector<const LevelDirectory *> &directories, const StreamInfo &stream)
        : model_(model), filter_(filter_of(stream, model.parameters.attributes)) {
        const AttributeSet &set = model.parameters.attributes;
        for (std::size_t level = 1; level < directories.size(); ++level)
            for (const ChunkEntry &chunk : directories[level]->chunks) {
                const Level &here = model.levels[level], &above = model.levels[level - 1];
                FilteredStream job{.masks = ByteView(here.masks).subspan(chunk.first_node, chunk.shape.nodes),
                                   .nodes = chunk_nodes(chunk, above.masks, 0, above.points, 0, set),
                                   .points = chunk.shape.points,
                                   .planes = {},
                                   .plane_bytes = {}};
                auto planes =
                    filter_stream({.set = set,
                                   .stream = stream,
                                   .level = static_cast<int>(level),
                                   .finest = level + 1 == directories.size()},
                                  job.masks, view_points(here.points, chunk.first_point, job.points, set), job.nodes);
                if (!planes)
                    continue;
                for (Bytes &plane : *planes) {
                    job.plane_bytes.push_back(plane.size());
                    plane.resize(plane.size() + kSlack);
                }
                job.planes = std::move(*planes);
                jobs_.push_back(std::move(job));
            }
    }

    // Counts children and lays out siblings, without un-filtering.
    void lay_out() {
        for (const FilteredStream &job : jobs_)
            scratch_.layout.build(job.masks, summarise_masks(job.masks));
    }

    // Lays out siblings and un-filters.
    void run() {
        const AttributeSet &set = model_.parameters.attributes;
        for (const FilteredStream &job : jobs_) {
            points_.resize(job.points, set);
            masks_.resize(job.masks.size());
            if (filter_ == Filter::mask_rank) {
                unrank_masks(job.plane(0), {job.nodes.parent_masks, job.nodes.attributes.normals}, masks_);
                continue;
            }
            scratch_.layout.build(job.masks, summarise_masks(job.masks));
            const PointView &nodes = job.nodes.attributes;
            switch (filter_) {
            case Filter::normal:
                unfilter_normals(scratch_, nodes.normals, job.plane(0), job.plane(1), points_.normals);
                break;
            case Filter::colour565:
                unfilter_colours_565(scratch_, nodes.colours, job.plane(0), job.plane(1), job.plane(2),
                                     points_.colours);
                break;
            case Filter::colour888:
                unfilter_colours_888(scratch_, nodes.colours, job.plane(0), job.plane(1), job.plane(2),
                                     points_.colours);
                break;
            default: break; // one byte per point: negligible
            }
        }
    }

  private:
    const Model &model_;
    Filter filter_;
    std::vector<FilteredStream> jobs_;
    UnfilterScratch scratch_{};
    PointAttributes points_;
    Bytes masks_;
};

} // namespace

struct WholeDecoder::Shared {
    explicit Shared(std::ptrdiff_t threads) : level_done(threads) {}
    std::barrier<> level_done;
    std::array<std::atomic<std::size_t>, kMaxDepth + 1> next{}; // by level: the next chunk to take
    std::atomic<bool> failed{false};
    Error error; // of the thread that set `failed`
};

WholeDecoder::WholeDecoder(ByteView file, int threads)
    : file_(file), threads_(static_cast<std::size_t>(threads)), scratch_(threads_) {}

void WholeDecoder::work(Reader &reader, std::size_t thread) {
    Shared &shared = *shared_;
    const std::size_t depth = directories_.size() - 1;
    for (std::size_t level = 1; level <= depth; ++level) {
        const std::vector<ChunkEntry> &chunks = directories_[level]->chunks;
        for (std::size_t i = shared.next[level]++; i < chunks.size() && !shared.failed; i = shared.next[level]++) {
            const Chunk &parent = kept_[level - 1][chunks[i].shape.parent_chunk];
            Chunk &chunk = level == depth ? scratch_[thread] : kept_[level][i];
            Status status = reader.load_chunk(static_cast<int>(level), i, parent, chunk);
            if (!status && !shared.failed.exchange(true))
                shared.error = std::move(status).error();
        }
        shared.level_done.arrive_and_wait();
    }
}

Result<std::uint64_t> WholeDecoder::run() {
    Result<Reader> reader = Reader::open(file_);
    if (!reader)
        return std::move(reader).error();
    auto directories = open_directories(*reader);
    if (!directories)
        return std::move(directories).error();
    directories_ = std::move(directories).value();
    kept_.resize(directories_.size() - 1);
    kept_[0] = {reader->root_chunk()};
    for (std::size_t level = 1; level < kept_.size(); ++level)
        kept_[level].resize(directories_[level]->chunks.size());

    shared_ = std::make_shared<Shared>(static_cast<std::ptrdiff_t>(threads_));
    {
        std::vector<std::jthread> others;
        for (std::size_t thread = 1; thread < threads_; ++thread)
            others.emplace_back([this, &reader, thread] { work(*reader, thread); });
        work(*reader, 0);
    }
    if (shared_->failed)
        return shared_->error;
    return directories_.back()->points;
}

Result<std::vector<const LevelDirectory *>> open_directories(Reader &reader) {
    std::vector<const LevelDirectory *> directories{nullptr};
    for (int level = 1; level <= reader.depth(); ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        directories.push_back(*directory);
    }
    return directories;
}

std::vector<Step> decoding_steps(ByteView file, Reader &reader,
                                 const std::vector<const LevelDirectory *> &directories) {
    std::vector<Step> steps;
    steps.push_back({"open, directories", [file] {
                         Result<Reader> opened = Reader::open(file);
                         if (!opened || !open_directories(*opened))
                             throw std::runtime_error("the file was changed while it was measured");
                     }});
    steps.push_back({"hash", [file, &directories] { hash_chunks(file, directories); }});
    const std::shared_ptr<ZSTD_DCtx> context(ZSTD_createDCtx(), ZSTD_freeDCtx);
    const auto raw = std::make_shared<Bytes>(kFrameBytes);
    const StreamList streams = streams_of(reader.parameters().attributes);
    for (std::size_t s = 0; s < streams.size(); ++s) {
        std::string name = "zstd ";
        name += to_string(streams[s].kind);
        if (streams[s].kind == StreamKind::shadow)
            name += ' ' + std::to_string(streams[s].light);
        steps.push_back({std::move(name), [file, &directories, s, context, raw] {
                             for_each_frame(file, directories, s,
                                            [&](ByteView stored) { decompress(context.get(), stored, *raw); });
                         }});
    }
    const std::shared_ptr<const Model> model = std::make_shared<Model>(load_model(reader).value());
    for (const StreamInfo &stream : streams) {
        const auto work = std::make_shared<Unfiltering>(*model, directories, stream);
        const std::string name(to_string(stream.kind));
        if (stream.kind == StreamKind::radius)
            steps.push_back({"lay out siblings", [model, work] { work->lay_out(); }});
        if (stream.kind == StreamKind::masks || stream.kind == StreamKind::normal || stream.kind == StreamKind::colour)
            steps.push_back({"un-filter " + name, [model, work] { work->run(); }});
    }
    return steps;
}

} // namespace pbm::bench
