#include "pbm_scan/las/las_records.h"

#include "pbm_scan/las/laz_point10.h"
#include "pbm_scan/las/laz_point14.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/surface/surface.h"
#include "system/threads/parallel.h"

#include <string>
#include <utility>

namespace pbm::build {
namespace {

Error cut_short(std::uint64_t announced, std::uint64_t found) {
    return bad_input("the file announces " + std::to_string(announced) + " points and has " + std::to_string(found) +
                         ": it is cut short; copy or export it again",
                     107);
}

struct DecodedChunk {
    Bytes records;
    Result<std::size_t> bytes = std::size_t{0}; // of the chunk
};

DecodedChunk decode(ByteView file, const LazLayout &layout, const LazChunk &chunk) {
    const std::uint64_t bytes = chunk.bytes != 0 ? chunk.bytes : file.size() - chunk.offset;
    const ByteView from = slice(file, chunk.offset, bytes);
    DecodedChunk decoded{.records = Bytes(static_cast<std::size_t>(chunk.points) * layout.stride)};
    if (!layout.is_layered) {
        decoded.bytes = decode_pointwise(from, layout, decoded.records);
        if (decoded.bytes && chunk.bytes != 0 && *decoded.bytes != chunk.bytes)
            decoded.bytes = bad_input("it is damaged: its points end at byte " + std::to_string(*decoded.bytes) +
                                          " of " + std::to_string(chunk.bytes),
                                      *decoded.bytes);
    } else if (Status good = decode_layered(from, layout, decoded.records); !good) {
        decoded.bytes = good.error();
    }
    return decoded;
}

} // namespace

Result<LasRecords> LasRecords::open(ByteView file, const LasHeader &header, int threads) {
    LasRecords records(file, threads);
    if (Status found = header.is_compressed ? records.find_chunks(header) : records.find_records(header); !found)
        return found.error();
    if (records.count_ > kMaxVertices)
        return too_large("more than 2^31 - 1 points; split the scan", 107);
    return records;
}

Status LasRecords::find_records(const LasHeader &header) {
    const std::size_t bytes = file_.size() - header.first;
    const std::uint64_t room = bytes / header.stride;
    if (header.announced > room)
        return cut_short(header.announced, room);
    // Some writers forget the count. Where nothing may stand behind the points, the file's size tells it.
    const bool is_forgotten = header.announced == 0 && bytes % header.stride == 0 && !header.has_records_behind;
    count_ = is_forgotten ? room : header.announced;
    if (!header.has_records_behind)
        bytes_behind_ = bytes - static_cast<std::size_t>(count_) * header.stride;
    records_ = slice(file_, header.first, count_ * header.stride);
    return {};
}

Status LasRecords::find_chunks(const LasHeader &header) {
    Result<LazLayout> layout = read_laz_layout(header);
    if (!layout)
        return layout.error();
    layout_ = std::move(*layout);
    Result<std::vector<LazChunk>> chunks = find_laz_chunks(file_, header, layout_);
    if (!chunks)
        return chunks.error();
    chunks_ = std::move(*chunks);
    for (const LazChunk &chunk : chunks_)
        count_ += chunk.points;
    if (header.announced > count_)
        return cut_short(header.announced, count_);
    if (count_ > max_laz_points(file_.size(), layout_))
        return bad_input("the file has " + std::to_string(count_) + " points in " + std::to_string(file_.size()) +
                             " bytes: it is damaged",
                         107);
    return {};
}

Result<ByteView> LasRecords::next() {
    if (!records_.empty())
        return std::exchange(records_, {});
    if (next_in_batch_ == batch_.size()) {
        if (next_chunk_ == chunks_.size())
            return ByteView();
        if (Status decoded = decode_batch(); !decoded)
            return decoded.error();
    }
    return ByteView(batch_[next_in_batch_++]);
}

Status LasRecords::decode_batch() {
    constexpr std::uint64_t kBatchBytes = 32 << 20; // of records, unless one chunk has more
    const std::size_t first = next_chunk_;
    std::uint64_t bytes = 0;
    do
        bytes += chunks_[next_chunk_].points * layout_.stride;
    while (chunks_[next_chunk_++].bytes != 0 && next_chunk_ < chunks_.size() && bytes < kBatchBytes);
    std::vector<DecodedChunk> decoded(next_chunk_ - first);
    parallel_for(decoded.size(), threads_,
                 [&](std::size_t i) { decoded[i] = decode(file_, layout_, chunks_[first + i]); });
    batch_.clear();
    next_in_batch_ = 0;
    for (std::size_t i = 0; i < decoded.size(); ++i) {
        const LazChunk &chunk = chunks_[first + i];
        if (const Result<std::size_t> &end = decoded[i].bytes; !end)
            return bad_input("chunk " + std::to_string(first + i) + ": " + end.error().message,
                             chunk.offset + end.error().offset);
        batch_.push_back(std::move(decoded[i].records));
        if (chunk.bytes == 0 && next_chunk_ < chunks_.size()) // then it is the only one
            chunks_[next_chunk_].offset = chunk.offset + *decoded[i].bytes;
    }
    return {};
}

} // namespace pbm::build
