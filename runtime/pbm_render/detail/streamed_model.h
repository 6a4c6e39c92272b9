// A model of which only those chunks are in memory that its pictures need.
//
//   StreamedModel model(reader)    nothing is read beyond what the reader has
//   model.bounds()                 the coarsest levels, for a first camera
//   model.load(view)               all that a picture needs, on several threads: for pictures without a window
//   model.choose(view)             what there is of a picture, at once, and what it lacks
//   model.request(missing)         reads that in the background, most urgent first: for a window
//
// Directories are proven level by level when a view comes near enough, chunks before they are first drawn. Those of
// packed files are decoded after the chunk they nest in, which stays in memory as long as they do; those of mapped
// files are drawn where they lie. A chunk that is damaged is named once and, with those below it, never asked for
// again.
//
// Of a source that is not whole (system/byte_source.h), what is not there yet is told as ranges of the file:
//
//   model.bounds_wanted()          until it is empty, fetch that
//   model.choose(view).wanted      what the picture lacks: fill the source with it and choose anew
//
// A chunk's bytes are dropped from that source when the chunk is loaded. If the chunk is evicted and needed again, they
// are wanted again.
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_render/detail/detail_selection.h"

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

namespace pbm {

struct StreamingOptions {
    int threads = 0;                              // that decode; 0: one per processor
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes of decoded chunks and of what is known of their surface
    std::function<void()> arrived = {};           // called by those threads after each chunk that was requested
};

struct StreamingStatistics {
    std::uint64_t bytes_read = 0;     // of the file: header, table, small sections, directories, bricks, chunks
    std::uint64_t points_decoded = 0; // 0 for mapped files
    std::uint64_t memory = 0;         // bytes that count towards max_memory now
};

// What there is of a picture. Keeps its chunks in memory; the model must outlive it.
struct Detail {
    std::vector<FileRange> wanted; // what the picture lacks and is not there yet, most urgent first; no range twice
    std::vector<PointRun> runs;
    std::vector<MissingChunk> missing; // for `request`
    std::vector<std::shared_ptr<const void>> chunks;
};

// The public functions are for one thread at a time.
class StreamedModel {
  public:
    // The file that `reader` reads must outlive the model.
    explicit StreamedModel(Reader reader, StreamingOptions options = {});
    // Waits for the chunks that are being decoded.
    ~StreamedModel();
    StreamedModel(const StreamedModel &) = delete;
    StreamedModel &operator=(const StreamedModel &) = delete;

    const Reader &reader() const { return reader_; }

    // As bounding_sphere of the whole model. Loads its levels up to kBoundsLevel.
    //
    // errors  as Reader::directory and Reader::load_chunk; memory; usage if bounds_wanted() is not empty
    Result<Sphere> bounds();
    // What `bounds` reads of the file and is not there yet.
    std::vector<FileRange> bounds_wanted() const;

    // What there is of a picture. Reads directories where needed, and no chunk.
    Detail choose(const DetailView &view);

    // The whole picture: nothing is missing but what is `wanted`. After an error of a chunk all others were tried.
    //
    // errors  as Reader::directory and Reader::load_chunk, the one with the lowest offset; memory
    Result<Detail> load(const DetailView &view);

    // Reads these chunks, instead of those of former requests that were not begun, until all are there or no more fit
    // into the memory allowed beside what the last view needs.
    void request(std::vector<MissingChunk> missing);
    // Whether something that was requested is still to come.
    bool is_loading() const;

    // What was found damaged since the last call: directories, chunks.
    std::vector<Error> take_errors();

    StreamingStatistics statistics() const;

  private:
    struct LoadedChunk;
    using ChunkPointer = std::shared_ptr<const LoadedChunk>;
    struct Slot {
        ChunkPointer chunk;
        std::uint64_t last_view = 0; // that had a use for it
        std::uint32_t children = 0;  // at hand or being loaded
        bool busy = false;           // being loaded
    };
    struct Level {
        const LevelDirectory *directory = nullptr;
        std::vector<Slot> slots;
        std::vector<ChunkState> states;
    };
    // Bytes that count as in use, as long as it lives.
    class Claim {
      public:
        Claim() = default;
        Claim(std::atomic<std::uint64_t> &total, std::uint64_t bytes) : total_(&total), bytes_(bytes) {
            total += bytes;
        }
        Claim(Claim &&other) noexcept : total_(std::exchange(other.total_, nullptr)), bytes_(other.bytes_) {}
        Claim &operator=(Claim &&other) noexcept {
            std::swap(total_, other.total_);
            std::swap(bytes_, other.bytes_);
            return *this;
        }
        ~Claim() {
            if (total_ != nullptr)
                *total_ -= bytes_;
        }

      private:
        std::atomic<std::uint64_t> *total_ = nullptr;
        std::uint64_t bytes_ = 0;
    };
    // One chunk to load.
    struct Task {
        ChunkPlace place;
        const ChunkEntry *entry, *above; // above: of the parent chunk; null for level 1
        ChunkPointer parent;             // the same
        ChunkBytes bytes;
        Claim memory;
    };

    Status read_directory(int level);
    Status load_all(std::vector<MissingChunk> missing);
    void work(const std::stop_token &stop, bool until_done);
    Result<ChunkPointer> load_chunk(Task &task) const;

    // With mutex_ held:
    DetailSelection select(const DetailView &view) const;
    void use(ChunkPlace place);
    Level &level_of(ChunkPlace place) { return levels_[static_cast<std::size_t>(place.level)]; }
    const Level &level_of(ChunkPlace place) const { return levels_[static_cast<std::size_t>(place.level)]; }
    const ChunkEntry &entry_of(ChunkPlace place) const { return level_of(place).directory->chunks[place.index]; }
    std::uint64_t place_in_directory(ChunkPlace place) const;
    ChunkPlace parent_of(ChunkPlace place) const { return {place.level - 1, entry_of(place).shape.parent_chunk}; }
    bool has_parent(ChunkPlace place) const; // at hand, or none
    bool has_bytes(ChunkPlace place) const;
    void add_wanted(ChunkPlace place, std::vector<FileRange> &wanted) const; // what a chunk to be loaded lacks
    bool can_be_loaded(ChunkPlace place) const { return has_parent(place) && has_bytes(place); }
    bool is_settled(ChunkPlace place) const;
    std::size_t find_task() const;
    std::optional<Task> take_task();
    void queue(std::vector<MissingChunk> missing);
    void finish(const Task &task, Result<ChunkPointer> loaded);
    bool make_room(std::uint64_t memory);
    std::uint64_t memory_of(const ChunkEntry &entry, int level) const;

    Reader reader_;
    const StreamingOptions options_;
    const Chunk root_; // the parent of level 1
    std::atomic<std::uint64_t> memory_{0};

    mutable std::mutex mutex_; // of all below but the threads
    std::condition_variable_any changed_;
    std::vector<Level> levels_; // [depth + 1]; [0] unused
    int known_levels_ = 0;      // whose directories are there
    int finest_;                // none below it: its directory is damaged
    std::uint64_t view_ = 0;    // number of the last one
    std::vector<MissingChunk> queue_;
    std::size_t queue_start_ = 0; // those before it are settled
    int busy_ = 0;                // chunks being loaded
    bool full_ = false;           // what is queued does not fit
    std::vector<Error> errors_;
    StreamingStatistics statistics_;

    std::vector<std::jthread> threads_; // last: they end before all else does
};

} // namespace pbm
