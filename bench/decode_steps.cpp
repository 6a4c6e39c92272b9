#include "decode_steps.h"

#include "pbm_format/hash.h"

#include <atomic>
#include <barrier>
#include <thread>

#include <zstd.h>

namespace pbm::bench {

namespace {

// The one place that decodes a chunk. `parent` is the chunk of the level above that holds its nodes, null at level 1.
Status decode(const Reader &reader, int level, std::size_t index, const Chunk * /*parent*/, Chunk &chunk) {
    Result<Chunk> loaded = reader.load_chunk(level, index);
    if (!loaded)
        return std::move(loaded).error();
    chunk = std::move(loaded).value();
    return {};
}

// More than any stream of 65,536 points holds.
constexpr std::size_t kFrameBytes = 1 << 20;

// Calls `use(stored bytes)` for stream `s` of every chunk that zstd has compressed.
template <class Use>
void for_each_frame(ByteView file, const std::vector<const LevelDirectory *> &directories, std::size_t s, Use &&use) {
    for (std::size_t level = 1; level < directories.size(); ++level)
        for (const ChunkEntry &chunk : directories[level]->chunks) {
            std::uint64_t offset = chunk.offset;
            for (std::size_t before = 0; before < s; ++before)
                offset += chunk.streams[before].stored_bytes;
            if (chunk.streams[s].zstd)
                use(file.subspan(offset, chunk.streams[s].stored_bytes));
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

} // namespace

struct WholeDecoder::Shared {
    explicit Shared(std::ptrdiff_t threads) : level_done(threads) {}
    std::barrier<> level_done;
    std::array<std::atomic<std::size_t>, kMaxDepth + 1> next{}; // chunk that nobody has taken yet, by level
    std::atomic<bool> failed{false};
    Error error; // of the one who set `failed`
};

WholeDecoder::WholeDecoder(ByteView file, int threads)
    : file_(file), threads_(static_cast<std::size_t>(threads)), scratch_(threads_) {}

void WholeDecoder::work(Reader &reader, std::size_t thread) {
    Shared &shared = *shared_;
    const std::size_t depth = directories_.size() - 1;
    for (std::size_t level = 1; level <= depth; ++level) {
        const std::vector<ChunkEntry> &chunks = directories_[level]->chunks;
        for (std::size_t i = shared.next[level]++; i < chunks.size() && !shared.failed; i = shared.next[level]++) {
            const Chunk *parent = level == 1 ? nullptr : &kept_[level - 1][chunks[i].shape.parent_chunk];
            Chunk &chunk = level == depth ? scratch_[thread] : kept_[level][i];
            Status status = decode(reader, static_cast<int>(level), i, parent, chunk);
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

std::vector<Step> decoding_steps(ByteView file, const Reader &reader,
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
    const std::vector<StreamInfo> streams = streams_of(reader.parameters().attributes);
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
    return steps;
}

} // namespace pbm::bench
