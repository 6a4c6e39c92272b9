#include "viewer/pictures/avi_writer.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>
#include <utility>

namespace pbm {
namespace {

constexpr std::uint32_t kHasIndex = 0x10, kKeyFrame = 0x10;
constexpr std::uint32_t kDefaultQuality = 0xFFFFFFFF;
constexpr std::uint32_t kMainHeader = 56, kStreamHeader = 56, kFormat = 40; // bytes of data
constexpr std::uint32_t kChunk = 8, kList = 12;                             // bytes in front of their data
constexpr std::uint32_t kStreamList = kList + kChunk + kStreamHeader + kChunk + kFormat;
constexpr std::uint32_t kHeaderList = kList + kChunk + kMainHeader + kStreamList;
constexpr std::uint32_t kHeaders = kList + kHeaderList + kList; // of the file, up to its first frame
constexpr std::uint32_t kIndexEntry = 16;

void write_name(ByteWriter &out, std::string_view name) {
    out.append({reinterpret_cast<const std::uint8_t *>(name.data()), name.size()});
}

void write_chunk(ByteWriter &out, std::string_view name, std::uint32_t size) {
    write_name(out, name);
    out.u32(size);
}

// `size` is that of the whole list.
void write_list(ByteWriter &out, std::string_view kind, std::uint64_t size, std::string_view name) {
    write_chunk(out, kind, static_cast<std::uint32_t>(size - kChunk));
    write_name(out, name);
}

std::uint32_t padded(std::uint32_t size) { return size + (size & 1); }

} // namespace

FrameRate frame_rate(double fps) {
    const auto thousandths = static_cast<std::uint32_t>(std::lround(fps * 1000));
    const std::uint32_t common = std::gcd(thousandths, 1000U);
    return {thousandths / common, 1000 / common};
}

Result<AviWriter> AviWriter::begin(const std::string &path, glm::ivec2 size, FrameRate rate, std::uint64_t max_bytes) {
    auto file = FileReplacement::begin(path);
    if (!file)
        return file.error();
    AviWriter writer(std::move(*file), size, rate, max_bytes);
    const Bytes headers = writer.headers(); // placeholders: `finish` knows sizes and counts
    writer.bytes_ = headers.size();
    if (Status written = writer.file_.write(headers); !written)
        return std::move(written).error();
    return writer;
}

Status AviWriter::write(ByteView jpeg) {
    const std::uint64_t chunk = kChunk + jpeg.size() + (jpeg.size() & 1);
    if (bytes_ + chunk + index_bytes(frames_.size() + 1) > max_bytes_)
        return Error{ErrorCode::memory, 0,
                     "an AVI file ends at " + std::to_string(max_bytes_ >> 20) +
                         " MiB; ask for fewer or smaller frames, a lower --video-quality, .mp4 or single pictures"};
    const auto size = static_cast<std::uint32_t>(jpeg.size());
    ByteWriter out;
    write_chunk(out, "00dc", size);
    out.append(jpeg);
    out.zeros(padded(size) - size);
    frames_.push_back(size);
    bytes_ += out.size();
    return file_.write(out.bytes());
}

Status AviWriter::finish() {
    ByteWriter index;
    write_chunk(index, "idx1", static_cast<std::uint32_t>(frames_.size()) * kIndexEntry);
    std::uint32_t at = 4; // from the name of 'movi'
    for (const std::uint32_t size : frames_) {
        write_name(index, "00dc");
        index.u32(kKeyFrame);
        index.u32(at);
        index.u32(size);
        at += kChunk + padded(size);
    }
    if (Status written = file_.write(index.bytes()); !written)
        return written;
    if (Status written = file_.overwrite(0, headers()); !written)
        return written;
    return file_.finish(Durability::cached);
}

std::uint64_t AviWriter::index_bytes(std::size_t frames) const { return kChunk + frames * std::uint64_t{kIndexEntry}; }

// All bytes in front of the first frame, for the frames written so far.
Bytes AviWriter::headers() const {
    const auto count = static_cast<std::uint32_t>(frames_.size());
    const std::uint32_t largest = frames_.empty() ? 0 : *std::max_element(frames_.begin(), frames_.end());
    const std::uint64_t content = std::max<std::uint64_t>(bytes_, kHeaders);
    const auto width = static_cast<std::uint32_t>(size_.x), height = static_cast<std::uint32_t>(size_.y);
    ByteWriter out;
    write_list(out, "RIFF", content + index_bytes(count), "AVI ");
    write_list(out, "LIST", kHeaderList, "hdrl");
    write_chunk(out, "avih", kMainHeader);
    out.u32(static_cast<std::uint32_t>(std::uint64_t{1000000} * rate_.seconds / rate_.frames)); // microseconds
    out.u32(static_cast<std::uint32_t>(std::min<std::uint64_t>(                                 // most bytes per second
        std::uint64_t{largest} * rate_.frames / rate_.seconds, 0xFFFFFFFF)));
    out.u32(0); // padding
    out.u32(kHasIndex);
    out.u32(count);
    out.u32(0); // frames before the sound
    out.u32(1); // streams
    out.u32(largest);
    out.u32(width);
    out.u32(height);
    out.zeros(16);
    write_list(out, "LIST", kStreamList, "strl");
    write_chunk(out, "strh", kStreamHeader);
    write_name(out, "vidsMJPG");
    out.zeros(12); // flags, priority, language, frames before the sound
    out.u32(rate_.seconds);
    out.u32(rate_.frames);
    out.u32(0); // start
    out.u32(count);
    out.u32(largest);
    out.u32(kDefaultQuality);
    out.zeros(12); // sample size 0: it varies; rectangle 0: the whole window
    write_chunk(out, "strf", kFormat);
    out.u32(kFormat); // a BITMAPINFOHEADER
    out.u32(width);
    out.u32(height);
    out.u16(1);
    out.u16(24);
    write_name(out, "MJPG");
    out.u32(static_cast<std::uint32_t>(std::min<std::uint64_t>(std::uint64_t{width} * height * 3, 0xFFFFFFFF)));
    out.zeros(16);
    write_list(out, "LIST", content - kHeaders + kList, "movi");
    return out.take();
}

} // namespace pbm
