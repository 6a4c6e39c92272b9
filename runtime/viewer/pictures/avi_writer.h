// Writes Motion JPEG to an AVI file: every frame is a JPEG image, an index ends the file.
// Based on: Microsoft. AVI RIFF File Reference (chunks 'hdrl', 'movi' and 'idx1')
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
// The nearest fraction in thousandths, in lowest terms. `fps` is 1..240.
FrameRate frame_rate(double fps);

class AviWriter {
  public:
    // Limit of players that count bytes in signed 32-bit integers.
    static constexpr std::uint64_t kMaxBytes = (std::uint64_t{1} << 31) - 1;

    // The file at `path` is created or replaced when `finish` succeeds. `max_bytes`: of the file, at most kMaxBytes.
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
