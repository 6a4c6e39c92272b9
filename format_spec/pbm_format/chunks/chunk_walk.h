// Visits the chunks of a file depth first, with memory for a few chunks of each level, however many points there are.
//
//   level 1   o                       a batch of chunks of one level is loaded by all threads, then taken in order;
//   level 2   o o o o                 then come the chunks below this batch, before the next one of its level.
//   level 3   o o o o|o o o o| ...    So each level is taken from its first chunk to its last one.
#pragma once

#include "pbm_format/container/layout.h"
#include "system/threads/parallel.h"
#include "system/threads/thread_pool.h"

#include <algorithm>
#include <span>
#include <vector>

namespace pbm {

// A chunk, and what the program keeps of it while it visits the chunks below it. Its place is used for other chunks
// later, with the data that are there.
template <class Data> struct WalkedChunk {
    int level = 0; // 0: the root, above the one chunk of level 1
    std::size_t index = 0;
    const ChunkEntry *entry = nullptr;
    const WalkedChunk *above = nullptr;
    bool loaded = false; // else no chunk below it is loaded either
    Data data{};
};

struct WalkLimits {
    int last_level = kMaxDepth;
    int threads = 1;
    std::size_t batch = 1; // chunks of one level that are in memory
};

template <class Data> class ChunkWalk {
  public:
    using Chunk = WalkedChunk<Data>;

    // `directories[level]` is that of the level, 1..last_level; they must outlive the walk.
    ChunkWalk(std::vector<const LevelDirectory *> directories, const WalkLimits &limits)
        : directories_(std::move(directories)), limits_(limits), pool_(threads()), batches_(directories_.size()),
          next_(directories_.size(), 0) {}

    // Visits all chunks below `root`, which has no entry. `load(chunk)` fills its data and returns whether the chunks
    // below it can be loaded; on any thread. `take(chunks)` gets the chunks of a batch, on the calling thread, and
    // returns whether to go on.
    template <class Load, class Take> void run(const Chunk &root, const Load &load, const Take &take) {
        std::fill(next_.begin(), next_.end(), std::size_t{0});
        visit(1, std::span(&root, 1), load, take);
    }

    // How many chunks of this level, whose directory is given, are in memory at once.
    static std::size_t batch_of(const LevelDirectory &directory, std::size_t batch) {
        return std::min(batch, directory.chunks.size());
    }

  private:
    int threads() const {
        std::size_t useful = 1;
        for (const LevelDirectory *directory : directories_)
            useful = directory == nullptr ? useful : std::max(useful, batch_of(*directory, limits_.batch));
        return static_cast<int>(
            std::min<std::size_t>(useful, static_cast<std::size_t>(resolve_threads(limits_.threads))));
    }

    // Visits the next chunks of `level`, those below `parents`. Returns whether to go on.
    template <class Load, class Take>
    bool visit(int level, std::span<const Chunk> parents, const Load &load, const Take &take) {
        const auto l = static_cast<std::size_t>(level);
        const std::vector<ChunkEntry> &entries = directories_[l]->chunks;
        std::vector<Chunk> &batch = batches_[l];
        batch.resize(batch_of(*directories_[l], limits_.batch));
        const std::size_t first = parents.front().index;
        while (true) {
            std::size_t count = 0;
            for (; count < batch.size() && next_[l] < entries.size(); ++count, ++next_[l]) {
                const ChunkEntry &entry = entries[next_[l]];
                if (entry.shape.parent_chunk - first >= parents.size())
                    break;
                Chunk &chunk = batch[count];
                chunk.level = level;
                chunk.index = next_[l];
                chunk.entry = &entry;
                chunk.above = &parents[entry.shape.parent_chunk - first];
            }
            if (count == 0)
                return true;
            pool_.run(count,
                      [&](std::size_t i, std::size_t) { batch[i].loaded = batch[i].above->loaded && load(batch[i]); });
            const std::span<Chunk> chunks(batch.data(), count);
            if (!take(chunks) || (level < limits_.last_level && !visit(level + 1, chunks, load, take)))
                return false;
        }
    }

    std::vector<const LevelDirectory *> directories_;
    WalkLimits limits_;
    ThreadPool pool_;
    std::vector<std::vector<Chunk>> batches_; // [level]
    std::vector<std::size_t> next_;           // [level]: next chunk
};

} // namespace pbm
