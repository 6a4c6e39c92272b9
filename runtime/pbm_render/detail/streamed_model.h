// A model with only those chunks in memory that its pictures need.
//
//   StreamedModel model(reader)    reads nothing beyond what the reader has read
//   model.bounds()                 loads the coarsest levels, for a first camera
//   model.load(view)               loads all that a picture needs, on several threads: for programs without a window
//   model.choose(view)             returns at once what a picture can show now, and what it lacks
//   model.request(missing)         loads missing chunks in the background, most urgent first: for a window
//
// The model reads the directory of a level when a view comes near enough, and verifies a chunk before its first use. It
// decodes a chunk of a packed file after its parent, which then stays in memory, and draws a chunk of a mapped file in
// place. It reports a damaged chunk once, and requests neither that chunk nor the chunks below it again.
//
// If the source is not whole (system/byte_source.h), missing bytes are reported as ranges of the file:
//
//   model.bounds_wanted()          fetch these ranges until it is empty
//   model.choose(view).wanted      ranges that the picture lacks: fill the source with them and choose again
//
// Loading a chunk drops its bytes from that source. They are wanted again if the chunk is evicted and needed again.
//
//   ChunkLoader      assembles a resident chunk from the file
//   ChunkCache       holds the resident chunks and evicts those that no view needs
//   ChunkScheduler   decides which thread loads which chunk when
// Stability: stable.
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_render/appearance/field_colours.h"
#include "pbm_render/bricks/point_run.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/detail_view.h"
#include "system/threads/thread_pool.h"

#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace pbm {

struct HiddenClasses; // pbm_render/appearance/hidden_classes.h

struct StreamingOptions {
    int threads = 0;                              // decoding threads; 0: one per processor
    std::shared_ptr<ThreadPool> pool = nullptr;   // of `load`; null: one of its own
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes of decoded chunks and of surface offsets
    std::function<void()> arrived = {};           // called by those threads after each chunk that was requested
    // The colours that points are drawn in: renderers take with_field_colours(parameters). The file must have the
    // field, and the source the ranges of colour_sample_ranges.
    std::optional<FieldColours> field = {};
    std::shared_ptr<const HiddenClasses> hidden = nullptr; // points that are left out; likewise
};

struct StreamingStatistics {
    std::uint64_t bytes_read = 0;     // of the file: header, table, small sections, directories, bricks, chunks
    std::uint64_t points_decoded = 0; // 0 for mapped files
    std::uint64_t memory = 0;         // bytes that count towards max_memory now
};

// What a picture can show now. It keeps its chunks in memory; the model must outlive it.
struct Detail {
    std::vector<FileRange> wanted; // ranges that the picture lacks and the source has not, most urgent first
    std::vector<PointRun> runs;
    std::vector<MissingChunk> missing; // for `request`
    std::vector<std::shared_ptr<const void>> chunks;
};

// Only one thread at a time may call the functions.
class StreamedModel {
  public:
    // The file that `reader` reads must outlive the model.
    explicit StreamedModel(Reader reader, StreamingOptions options = {});
    // Waits for the chunks that are being loaded.
    ~StreamedModel();
    StreamedModel(const StreamedModel &) = delete;
    StreamedModel &operator=(const StreamedModel &) = delete;

    const Reader &reader() const;

    // As find_extent(model). Loads the levels up to kBoundsLevel.
    //
    // errors  as Reader::directory and ChunkLoader::load; memory; usage if bounds_wanted() is not empty
    Result<Extent> bounds();
    // The ranges that `bounds` reads and the source lacks.
    std::vector<FileRange> bounds_wanted() const;

    // What a picture can show now. Reads directories if needed, but no chunk.
    Detail choose(const DetailView &view);

    // The whole picture: it lacks only what is `wanted`. After an error of a chunk the model still tries all others.
    //
    // errors  as Reader::directory and ChunkLoader::load, the one with the lowest offset; memory
    Result<Detail> load(const DetailView &view);

    // Loads these chunks in the background until all are resident or no more fit beside the chunks of the last view.
    // They replace chunks of earlier requests that no thread has started.
    void request(std::vector<MissingChunk> missing);
    // Whether a requested chunk is still to come.
    bool is_loading() const;

    // Errors of directories and chunks found since the last call.
    std::vector<Error> take_errors();

    StreamingStatistics statistics() const;

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

} // namespace pbm
