// An open model: its bytes, its reader, and what drawing keeps between two pictures.
#pragma once

#include "boundary.h"

#include "pbm_format/reading/reader.h"
#include "system/byte_source.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::c_api {

class Drawing; // drawing.h

// The bytes of a file, from wherever they come.
class FileBytes {
  public:
    // A whole file, at a multiple of 8. `start_reading`: as in ByteSource.
    static FileBytes held(HeldBytes bytes, void (*start_reading)(ByteView) = nullptr);
    static FileBytes ranged(pbm_read_range read, void *context, std::uint64_t size);

    // The caller's handle, for callbacks.
    void belongs_to(const void *handle) { handle_ = handle; }

    const ByteSource &source() const { return *source_; }
    bool is_whole() const { return source_->is_whole(); }

    struct Fetched {
        bool any_arrived = false;         // some bytes that were missing before
        std::optional<FileRange> pending; // the first range that is to come later
    };
    // Asks for those of the ranges that are not there yet, in this order. Has no effect on a whole file.
    //
    // errors  io  the callback failed
    Result<Fetched> fetch(std::span<const FileRange> ranges) const;
    // The same for a call that needs all of them: throws Pending.
    Status require(std::span<const FileRange> ranges) const;

    // All bytes, at a multiple of 8. Reads those of ranges once. Throws Pending.
    Result<ByteView> whole();

    // Drops all bytes that were fetched and are not used yet, if they are more than these.
    void limit_memory(std::uint64_t max_memory) const;

  private:
    Status fetch_piece(FileRange piece, Fetched &fetched) const;

    HeldBytes whole_; // of ranges, once they were all needed
    std::shared_ptr<SparseFile> sparse_;
    std::optional<ByteSource> source_;
    pbm_read_range read_ = nullptr;
    void *context_ = nullptr;
    const void *handle_ = nullptr;
};

// A reader of these bytes. Throws Pending.
//
// errors  as Reader::open
Result<Reader> open_reader(const FileBytes &bytes);

// What shows where the model is.
inline constexpr int kCoarseLevel = 6;

struct OpenModel {
    OpenModel(FileBytes of, Reader opened);
    ~OpenModel();
    OpenModel(const OpenModel &) = delete;
    OpenModel &operator=(const OpenModel &) = delete;

    // The directory of a level. Fetches those of the levels above, too. Throws Pending.
    Result<const LevelDirectory *> directory(int level);

    // Levels 0 .. kCoarseLevel, as far as there are any. Reads them once. Throws Pending.
    //
    // errors  as load_points
    Result<std::span<const Level>> coarse_levels();

    FileBytes bytes;
    Reader reader;
    std::string metadata;             // ends with a zero byte
    std::unique_ptr<Drawing> drawing; // created on first use

  private:
    std::vector<Level> coarse_levels_; // empty: not read yet
};

Handles<pbm_model, OpenModel> &models();

// Error of a level that the model does not have.
Status check_level(const OpenModel &model, int level);
// Error of arrays of the caller that are too small.
Error no_room(std::uint64_t capacity, std::uint64_t points);

// Counts points of a level: `count` takes the model and the level, and returns a Result<std::uint64_t>.
template <class Count>
pbm_code count_level(pbm_model *model, std::int32_t level, std::uint64_t *points, pbm_error *error,
                     const Count &count) {
    return guarded(error, [&] {
        return models().use(model, "model", [&](OpenModel &open) -> Status {
            if (points == nullptr)
                return usage_error("points is null");
            const Result<std::uint64_t> counted = count(open, level);
            if (!counted)
                return counted.error();
            *points = *counted;
            return {};
        });
    });
}

// Fetches what load_points needs of levels 1 .. `level`, and drops their stored chunks again. Throws Pending.
Status fetch_levels(OpenModel &model, int level);
void drop_levels(const OpenModel &model, int level);

// Opens a model and hands out its handle. Throws Pending.
Status add_model(FileBytes bytes, pbm_model **model);

// Bytes at a multiple of 8: the same, or a copy.
HeldBytes aligned(ByteView bytes);

} // namespace pbm::c_api
