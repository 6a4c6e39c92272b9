#include "viewer/pictures/avi_writer.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
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

void write_name(ByteWriter &out, std::string_view name) { out.append(as_bytes(name)); }

void write_chunk(ByteWriter &out, std::string_view name, std::uint32_t size) {
    write_name(out, name);
    out.u32(size);
}

// Numbers of 32 bits, clamped.
void write_numbers(ByteWriter &out, std::initializer_list<std::uint64_t> numbers) {
    for (const std::uint64_t number : numbers)
        out.u32(static_cast<std::uint32_t>(std::min<std::uint64_t>(number, 0xFFFFFFFF)));
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
        write_numbers(index, {kKeyFrame, at, size});
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
    // Microseconds per frame, most bytes per second, padding, flags, frames, frames before the sound, streams.
    write_numbers(out, {std::uint64_t{1000000} * rate_.seconds / rate_.frames,
                        std::uint64_t{largest} * rate_.frames / rate_.seconds, 0, kHasIndex, count, 0, 1});
    write_numbers(out, {largest, width, height});
    out.zeros(16);
    write_list(out, "LIST", kStreamList, "strl");
    write_chunk(out, "strh", kStreamHeader);
    write_name(out, "vidsMJPG");
    out.zeros(12); // flags, priority, language, frames before the sound
    write_numbers(out, {rate_.seconds, rate_.frames, 0, count, largest, kDefaultQuality}); // 0: the start
    out.zeros(12); // sample size 0: it varies; rectangle 0: the whole window
    write_chunk(out, "strf", kFormat);
    write_numbers(out, {kFormat, width, height, 1 | 24 << 16}); // a BITMAPINFOHEADER: one plane, 24 bits
    write_name(out, "MJPG");
    write_numbers(out, {std::uint64_t{width} * height * 3});
    out.zeros(16);
    write_list(out, "LIST", content - kHeaders + kList, "movi");
    return out.take();
}

} // namespace pbm
