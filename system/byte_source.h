// The bytes of a file as a reader gets them: all in memory, or only the ranges that have arrived so far.
//
//   auto file = std::make_shared<SparseFile>(size);    a file on the other side of a network
//   file->fill(0, first_bytes)                         from any thread, as ranges arrive
//   ByteSource(file).view({offset, bytes})             the bytes, or nothing if some have not arrived
// Stability: stable.
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

namespace pbm {

// Bytes that stay readable and unchanged as long as this object or a copy of it lives. Bytes of a whole file have no
// owner: they outlive their readers. The address of the first byte equals its offset in the file modulo 8.
struct HeldBytes {
    ByteView bytes;
    std::shared_ptr<const void> owner;
};

// A file whose ranges arrive in any order and may be dropped again; it may be larger than the memory. Memory is
// allocated for present ranges and freed in pieces of up to kPieceBytes. Thread-safe.
class SparseFile {
  public:
    static constexpr std::uint64_t kPieceBytes = 65536;

    explicit SparseFile(std::uint64_t size) : size_(size) {}

    std::uint64_t size() const { return size_; } // bytes of the file
    std::uint64_t memory() const;                // bytes that are present

    // Copies bytes that have arrived from `offset` on. Present bytes stay; bytes past the end of the file are ignored.
    void fill(std::uint64_t offset, ByteView bytes);
    // Drops a range, which may be filled again. Existing views of it stay valid.
    void drop(FileRange range);

    bool has(FileRange range) const;
    // Empty if part of the range is missing or outside the file. Copies bytes that arrived in several pieces.
    std::optional<HeldBytes> view(FileRange range) const;

  private:
    using Pieces = std::map<std::uint64_t, HeldBytes>; // by offset; they do not overlap

    template <class Use> bool for_pieces(FileRange range, Use &&use) const;

    const std::uint64_t size_;
    mutable std::mutex mutex_; // guards the pieces
    Pieces pieces_;
};

// The bytes that a reader reads. A copy is the same source.
class ByteSource {
  public:
    // A whole file. `file` must stay readable and unchanged as long as anything reads from the source. Its first byte
    // must lie at a multiple of 8 in memory, as in any mapping or vector. `start_reading`: see will_need; may be null.
    explicit ByteSource(ByteView file, void (*start_reading)(ByteView) = nullptr)
        : whole_(file), start_reading_(start_reading) {}
    // `file` must not be null.
    explicit ByteSource(std::shared_ptr<SparseFile> file) : sparse_(std::move(file)) {}

    bool is_whole() const { return sparse_ == nullptr; }
    std::uint64_t size() const { return is_whole() ? whole_.size() : sparse_->size(); }

    bool has(FileRange range) const { return is_whole() ? is_inside(range) : sparse_->has(range); }
    // Empty if part of the range is missing or lies outside the file.
    std::optional<HeldBytes> view(FileRange range) const {
        if (!is_whole())
            return sparse_->view(range);
        will_need(range);
        return is_inside(range) ? std::optional(HeldBytes{slice(whole_, range.offset, range.bytes), nullptr})
                                : std::nullopt;
    }
    // The same where a call needs all of them at once; else `not_there_yet`.
    Result<HeldBytes> require(FileRange range) const;
    // The caller is going to read the range: a mapped file starts to read it from the disk.
    void will_need(FileRange range) const {
        if (start_reading_ != nullptr && is_inside(range))
            start_reading_(slice(whole_, range.offset, range.bytes));
    }
    // The caller no longer needs the stored bytes of the range. Has no effect on a whole file.
    void drop(FileRange range) const {
        if (!is_whole())
            sparse_->drop(range);
    }

  private:
    bool is_inside(FileRange range) const {
        return range.offset <= whole_.size() && range.bytes <= whole_.size() - range.offset;
    }

    ByteView whole_;
    void (*start_reading_)(ByteView) = nullptr;
    std::shared_ptr<SparseFile> sparse_;
};

// For calls that need all their bytes at once: the caller asked too early, the file is not damaged.
Error not_there_yet(FileRange range);

} // namespace pbm
