#include "system/byte_source.h"

#include <algorithm>
#include <iterator>

namespace pbm {

namespace {

// Allocates memory for the bytes from `offset` on, at an address that equals the offset modulo 8.
std::pair<std::uint8_t *, std::shared_ptr<const void>> allocate(std::uint64_t offset, std::size_t bytes) {
    const auto before = static_cast<std::size_t>(offset % 8);
    const std::shared_ptr<std::uint64_t[]> words(new std::uint64_t[(before + bytes + 7) / 8]);
    return {reinterpret_cast<std::uint8_t *>(words.get()) + before, words};
}

HeldBytes copy(std::uint64_t offset, ByteView bytes) {
    auto [to, owner] = allocate(offset, bytes.size());
    std::copy(bytes.begin(), bytes.end(), to);
    return {{to, bytes.size()}, std::move(owner)};
}

} // namespace

std::uint64_t SparseFile::memory() const {
    const std::lock_guard lock(mutex_);
    std::uint64_t bytes = 0;
    for (const auto &[offset, piece] : pieces_)
        bytes += piece.bytes.size();
    return bytes;
}

void SparseFile::fill(std::uint64_t offset, ByteView bytes) {
    bytes = slice(bytes, 0, std::min<std::uint64_t>(bytes.size(), size_ - std::min(offset, size_)));
    const std::lock_guard lock(mutex_);
    while (!bytes.empty()) {
        const auto next = pieces_.upper_bound(offset);
        std::uint64_t count = bytes.size();
        const auto before = next == pieces_.begin() ? pieces_.end() : std::prev(next);
        if (before != pieces_.end() && before->first + before->second.bytes.size() > offset) { // is present already
            count = std::min(count, before->first + before->second.bytes.size() - offset);
        } else {
            count = std::min(count, kPieceBytes - offset % kPieceBytes);
            if (next != pieces_.end())
                count = std::min(count, next->first - offset);
            pieces_.emplace_hint(next, offset, copy(offset, slice(bytes, 0, count)));
        }
        offset += count;
        bytes = slice(bytes, count, bytes.size() - count);
    }
}

void SparseFile::drop(FileRange range) {
    const std::lock_guard lock(mutex_);
    const std::uint64_t last = range.offset + std::min(range.bytes, ~range.offset);
    auto at = pieces_.upper_bound(range.offset);
    if (at != pieces_.begin())
        --at;
    while (at != pieces_.end() && at->first < last) {
        const std::uint64_t start = at->first, end = start + at->second.bytes.size();
        const std::uint64_t from = std::clamp(range.offset, start, end), to = std::min(last, end);
        if (from >= to) {
            ++at;
            continue;
        }
        const HeldBytes piece = std::move(at->second);
        at = pieces_.erase(at);
        if (from > start)
            pieces_.emplace_hint(at, start, HeldBytes{slice(piece.bytes, 0, from - start), piece.owner});
        if (to < end)
            pieces_.emplace_hint(at, to, HeldBytes{slice(piece.bytes, to - start, end - to), piece.owner});
    }
}

// Calls use(piece, part) for the parts of `range` in order; returns false at the first missing part.
template <class Use> bool SparseFile::for_pieces(FileRange range, Use &&use) const {
    if (range.offset > size_ || range.bytes > size_ - range.offset)
        return false;
    auto at = pieces_.upper_bound(range.offset);
    if (at != pieces_.begin())
        --at;
    for (; range.bytes > 0; ++at) {
        if (at == pieces_.end() || at->first > range.offset)
            return false;
        const std::uint64_t before = range.offset - at->first, size = at->second.bytes.size();
        if (before >= size)
            return false;
        const std::uint64_t count = std::min(range.bytes, size - before);
        use(at->second, slice(at->second.bytes, before, count));
        range = {range.offset + count, range.bytes - count};
    }
    return true;
}

bool SparseFile::has(FileRange range) const {
    const std::lock_guard lock(mutex_);
    return for_pieces(range, [](const HeldBytes &, ByteView) {});
}

std::optional<HeldBytes> SparseFile::view(FileRange range) const {
    const std::lock_guard lock(mutex_);
    HeldBytes held;
    if (!for_pieces(range, [&](const HeldBytes &piece, ByteView part) { held = {part, piece.owner}; }))
        return std::nullopt;
    if (held.bytes.size() == range.bytes)
        return held;
    auto [to, owner] = allocate(range.offset, static_cast<std::size_t>(range.bytes));
    const ByteView bytes(to, static_cast<std::size_t>(range.bytes));
    for_pieces(range, [&, next = to](const HeldBytes &, ByteView part) mutable {
        next = std::copy(part.begin(), part.end(), next);
    });
    return HeldBytes{bytes, std::move(owner)};
}

Result<HeldBytes> ByteSource::require(FileRange range) const {
    std::optional<HeldBytes> bytes = view(range);
    if (!bytes)
        return not_there_yet(range);
    return std::move(*bytes);
}

Error not_there_yet(FileRange range) {
    return {.code = ErrorCode::usage,
            .offset = range.offset,
            .message = std::to_string(range.bytes) + " bytes of the file have not arrived yet"};
}

} // namespace pbm
