// An open model: its bytes, its reader, and what drawing keeps between two pictures.
#pragma once

#include "boundary.h"

#include "pbm_format/reading/reader.h"
#include "system/files/mapped_file.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace pbm::c_api {

class Drawing; // drawing.h

// The bytes of a file, from wherever they come.
class FileBytes {
  public:
    static FileBytes mapped(MappedFile file);
    static FileBytes viewed(ByteView bytes); // copied unless they lie at a multiple of 8
    static FileBytes owned(Bytes bytes);
    static FileBytes ranged(pbm_read_range read, void *context, std::uint64_t size);

    // The caller's handle, for callbacks.
    void belongs_to(const void *handle) { handle_ = handle; }

    const ByteSource &source() const { return *source_; }
    bool is_whole() const { return source_->is_whole(); }

    // Reads a range that is not there yet. Has no effect on a whole file.
    //
    // errors  io  the callback failed
    Status fetch(FileRange range) const;

    // All bytes, at a multiple of 8. Reads those of ranges once.
    Result<ByteView> whole();

  private:
    Status read(std::uint64_t offset, std::span<std::uint8_t> to) const;

    std::unique_ptr<MappedFile> file_;
    Bytes owned_;
    ByteView view_;
    std::shared_ptr<SparseFile> sparse_;
    std::optional<ByteSource> source_;
    pbm_read_range read_ = nullptr;
    void *context_ = nullptr;
    const void *handle_ = nullptr;
};

// A reader of these bytes.
//
// errors  as Reader::open
Result<Reader> open_reader(const FileBytes &bytes);

struct OpenModel {
    OpenModel(FileBytes of, Reader opened);
    ~OpenModel();
    OpenModel(const OpenModel &) = delete;
    OpenModel &operator=(const OpenModel &) = delete;

    // The directory of a level. Fetches those of the levels above, too.
    Result<const LevelDirectory *> directory(int level);

    FileBytes bytes;
    Reader reader;
    std::string metadata;             // ends with a zero byte
    std::unique_ptr<Drawing> drawing; // created on first use
};

Handles<pbm_model, OpenModel> &models();

// What load_points needs of levels 1 .. `level` and is not there yet; and drops their stored chunks again.
Status fetch_levels(OpenModel &model, int level);
void drop_levels(const OpenModel &model, int level);

// Opens a model and hands out its handle.
Status add_model(FileBytes bytes, pbm_model **model);
// The same of a file; errors name it.
Status add_file(const char *path, pbm_model **model);

// Bytes at a multiple of 8: the same, or a copy in `room`.
ByteView aligned(ByteView bytes, Bytes &room);

} // namespace pbm::c_api
