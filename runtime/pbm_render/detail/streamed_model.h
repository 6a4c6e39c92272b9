// A model of which only those chunks are in memory that its pictures need.
//
//   StreamedModel model(reader)    reads nothing beyond what the reader has read
//   model.bounds()                 loads the coarsest levels, for a first camera
//   model.load(view)               loads all that a picture needs, on several threads: for programs without a window
//   model.choose(view)             returns at once what a picture can show now, and what it lacks
//   model.request(missing)         loads that in the background, most urgent first: for a window
//
// The model reads the directory of a level when a view comes near enough, and verifies a chunk before it is first
// drawn. It decodes a chunk of a packed file after the chunk that it nests in, which stays in memory as long as that
// chunk does; it draws a chunk of a mapped file where it lies. It names a damaged chunk once, and never asks again for
// that chunk nor for those below it.
//
// Of a source that is not whole (system/byte_source.h), what is not there yet is told as ranges of the file:
//
//   model.bounds_wanted()          until it is empty, fetch that
//   model.choose(view).wanted      what the picture lacks: fill the source with it and choose anew
//
// A chunk's bytes are dropped from that source when the chunk is loaded. If the chunk is evicted and needed again, they
// are wanted again.
//
//   ChunkLoader      assembles a resident chunk from the file
//   ChunkCache       holds the resident chunks and evicts what no view needs
//   ChunkScheduler   decides which thread loads which chunk when
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_render/bricks/point_run.h"
#include "pbm_render/detail/detail_view.h"

#include <functional>
#include <memory>
#include <vector>

namespace pbm {

struct StreamingOptions {
    int threads = 0;                              // that decode; 0: one per processor
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes of decoded chunks and of surface offsets
    std::function<void()> arrived = {};           // called by those threads after each chunk that was requested
};

struct StreamingStatistics {
    std::uint64_t bytes_read = 0;     // of the file: header, table, small sections, directories, bricks, chunks
    std::uint64_t points_decoded = 0; // 0 for mapped files
    std::uint64_t memory = 0;         // bytes that count towards max_memory now
};

// What a picture can show now. Keeps its chunks in memory; the model must outlive it.
struct Detail {
    std::vector<FileRange> wanted; // what the picture lacks and is not there yet, most urgent first
    std::vector<PointRun> runs;
    std::vector<MissingChunk> missing; // for `request`
    std::vector<std::shared_ptr<const void>> chunks;
};

// One thread at a time may call the functions.
class StreamedModel {
  public:
    // The file that `reader` reads must outlive the model.
    explicit StreamedModel(Reader reader, StreamingOptions options = {});
    // Waits for the chunks that are being loaded.
    ~StreamedModel();
    StreamedModel(const StreamedModel &) = delete;
    StreamedModel &operator=(const StreamedModel &) = delete;

    const Reader &reader() const;

    // As bounding_sphere of the whole model. Loads its levels up to kBoundsLevel.
    //
    // errors  as Reader::directory and ChunkLoader::load; memory; usage if bounds_wanted() is not empty
    Result<Sphere> bounds();
    // What `bounds` reads of the file and is not there yet.
    std::vector<FileRange> bounds_wanted() const;

    // What a picture can show now. Reads directories where needed, and no chunk.
    Detail choose(const DetailView &view);

    // The whole picture: nothing is missing but what is `wanted`. After an error of a chunk the model still tries all
    // others.
    //
    // errors  as Reader::directory and ChunkLoader::load, the one with the lowest offset; memory
    Result<Detail> load(const DetailView &view);

    // Loads these chunks in the background, instead of those of former requests that no thread has begun to load, until
    // all are resident or no more fit into the memory allowed beside what the last view needs.
    void request(std::vector<MissingChunk> missing);
    // Whether something that was requested is still to come.
    bool is_loading() const;

    // The damaged directories and chunks that were found since the last call.
    std::vector<Error> take_errors();

    StreamingStatistics statistics() const;

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

} // namespace pbm
