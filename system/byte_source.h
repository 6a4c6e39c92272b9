// The bytes of a file where a reader finds them: all of them in memory, or the ranges that have arrived so far.
//
//   auto file = std::make_shared<SparseFile>(size);    a file on the other side of a network
//   file->fill(0, first_bytes)                         from any thread, as ranges arrive
//   ByteSource(file).view({offset, bytes})             those bytes, or none: not there yet
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

namespace pbm {

// Bytes that stay readable and unchanged as long as this or a copy of it lives. The bytes of a whole file need no owner
// here: they outlive whoever reads them. The first byte lies in memory at an address with the remainder by 8 that its
// offset has in the file.
struct HeldBytes {
    ByteView bytes;
    std::shared_ptr<const void> owner;
};

// A file of which ranges arrive in any order and may be dropped again; it may be larger than the memory. Memory is used
// for the ranges that are there, and freed in pieces of up to kPieceBytes. Safe to use from several threads.
class SparseFile {
  public:
    static constexpr std::uint64_t kPieceBytes = 65536;

    explicit SparseFile(std::uint64_t size) : size_(size) {}

    std::uint64_t size() const { return size_; } // bytes of the file
    std::uint64_t memory() const;                // bytes that are there

    // The bytes from `offset` on have arrived; they are copied. What was there already stays as it is. Ignores bytes
    // past the end of the file.
    void fill(std::uint64_t offset, ByteView bytes);
    // Forgets a range: it may be filled again. Whoever holds a view of it keeps that.
    void drop(FileRange range);

    bool has(FileRange range) const;
    // None if some of the range has not arrived, was dropped, or lies outside the file. Copies the bytes where they
    // arrived in several pieces.
    std::optional<HeldBytes> view(FileRange range) const;

  private:
    using Pieces = std::map<std::uint64_t, HeldBytes>; // by offset; they do not overlap

    template <class Use> bool for_pieces(FileRange range, Use &&use) const;

    const std::uint64_t size_;
    mutable std::mutex mutex_; // of the pieces
    Pieces pieces_;
};

// Where a reader finds its bytes. A copy is the same source.
class ByteSource {
  public:
    // All of a file. `file` must stay readable and unchanged as long as anything reads from the source, and its first
    // byte lie at a multiple of 8 in memory, as it does in any mapping or vector.
    explicit ByteSource(ByteView file) : whole_(file) {}
    // Not null.
    explicit ByteSource(std::shared_ptr<SparseFile> file) : sparse_(std::move(file)) {}

    bool is_whole() const { return sparse_ == nullptr; }
    std::uint64_t size() const { return is_whole() ? whole_.size() : sparse_->size(); }

    bool has(FileRange range) const { return is_whole() ? is_inside(range) : sparse_->has(range); }
    // None if the range is not there yet, or lies outside the file.
    std::optional<HeldBytes> view(FileRange range) const {
        if (!is_whole())
            return sparse_->view(range);
        return is_inside(range) ? std::optional(HeldBytes{slice(whole_, range.offset, range.bytes), nullptr})
                                : std::nullopt;
    }
    // The same where a call needs all of them at once; else `not_there_yet`.
    Result<HeldBytes> require(FileRange range) const;
    // The range is no longer needed in the form in which it is stored. Frees nothing of a whole file.
    void drop(FileRange range) const {
        if (!is_whole())
            sparse_->drop(range);
    }

  private:
    bool is_inside(FileRange range) const {
        return range.offset <= whole_.size() && range.bytes <= whole_.size() - range.offset;
    }

    ByteView whole_;
    std::shared_ptr<SparseFile> sparse_;
};

// The error of a call whose bytes are not there: the caller asked too early, the file is not damaged.
Error not_there_yet(FileRange range);

} // namespace pbm
