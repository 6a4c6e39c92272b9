// Motion JPEG in an AVI file: every frame a JPEG of its own, with an index.
// Based on: Microsoft, AVI RIFF File Reference; the RIFF chunks 'hdrl', 'movi' and 'idx1'
#pragma once

#include "system/files/file_replacement.h"

#include <glm/vec2.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace pbm {

// Frames per second as a fraction.
struct FrameRate {
    std::uint32_t frames = 30, seconds = 1;
};
// The nearest in thousandths, in lowest terms. `fps` is 1..240.
FrameRate frame_rate(double fps);

class AviWriter {
  public:
    // Players that count in 32 bits with a sign read no more.
    static constexpr std::uint64_t kMaxBytes = (std::uint64_t{1} << 31) - 1;

    // `path` appears, or is replaced, when `finish` succeeds. `max_bytes`: of the file, at most kMaxBytes.
    static Result<AviWriter> begin(const std::string &path, glm::ivec2 size, FrameRate rate,
                                   std::uint64_t max_bytes = kMaxBytes);

    // errors  memory  the file would have more than `max_bytes`
    //         io
    Status write(ByteView jpeg);
    Status finish(); // the last call

  private:
    AviWriter(FileReplacement file, glm::ivec2 size, FrameRate rate, std::uint64_t max_bytes)
        : file_(std::move(file)), size_(size), rate_(rate), max_bytes_(max_bytes) {}
    Bytes headers() const;
    std::uint64_t index_bytes(std::size_t frames) const;

    FileReplacement file_;
    glm::ivec2 size_; // pixels
    FrameRate rate_;
    std::uint64_t max_bytes_, bytes_ = 0; // of the file
    std::vector<std::uint32_t> frames_;   // bytes of each
};

} // namespace pbm
