// Writes a video frame by frame. The name determines the format:
//
//   name.avi        Motion JPEG
//   name.mp4        H.264 in BT.709, by running ffmpeg
//   name_%04d.png   a picture for every frame, numbered from 1; also .jpg and .bmp; %% is a %
//   -               raw frames on standard output: R G B of every pixel, no headers
#pragma once

#include "system/threads/thread_pool.h"

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

#include <glm/vec2.hpp>

#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

namespace pbm {

inline constexpr int kMaxFrames = 100'000;

struct VideoOptions {
    std::string output; // empty: no video
    int frames = 120;
    double fps = 30;
    int quality = 90; // of JPEG, 1..100
};

// Encodes and writes frames to `output`.
struct VideoSink {
    std::function<Result<Bytes>(const Framebuffer &)> encode; // any thread, several at once
    std::function<Status(ByteView)> write;                    // encoded frames, in order
    std::function<Status()> finish;                           // creates the file; single pictures exist before
};

// Refuses a name of none of these formats.
//
// errors  usage
Status check_video_name(const std::string &output);
// Whether the format of `output`, a known one, keeps transparency.
bool has_transparency(const std::string &output);
// The size of the frames of `output`, a known format, that are drawn with `size`: MP4 repeats the last column or row
// where that is odd, since H.264 has even sizes.
glm::ivec2 stored_size(const std::string &output, glm::ivec2 size);
// Files that will be written, which must not be inputs. Frames are represented by the first and the last one.
std::vector<std::string> video_files(const VideoOptions &options);

// errors  usage   as check_video_name
//         io      it cannot be written
//         memory  ffmpeg is not installed
Result<VideoSink> open_video(const VideoOptions &options, glm::ivec2 size);

// Encodes frames on its own threads while the next ones are drawn.
class VideoRecorder {
  public:
    // Allocates at most `max_memory` bytes for frames, but at least two frames.
    VideoRecorder(VideoSink sink, glm::ivec2 size, bool with_depths, int threads, std::uint64_t max_memory);

    // Where the caller draws the next frame.
    Framebuffer &canvas() { return slots_[next_].picture; }
    // Enqueues the canvas as a frame. Writes the oldest frame if its memory is needed, and returns its error, which
    // names the frame's number, from 1.
    Status add();
    // Waits until all frames are written. Must be the last call.
    Status finish();

    std::uint64_t bytes() const { return bytes_; } // encoded and written so far

  private:
    struct Slot {
        Slot(glm::ivec2 size, bool with_depths) : picture(size.x, size.y, with_depths) {}
        Framebuffer picture;
        std::future<Result<Bytes>> encoded;
    };
    Status drain(Slot &slot);
    Error with_frame(Error error) const;

    const VideoSink sink_;
    std::vector<Slot> slots_; // used cyclically
    std::size_t next_ = 0;
    std::uint64_t bytes_ = 0, frames_ = 0; // written
    std::optional<ThreadPool> encoders_;   // last member: its threads use the slots
};

} // namespace pbm
