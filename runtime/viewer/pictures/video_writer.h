// A video while it is made, frame by frame; the name says in which form.
//
//   name.avi        Motion JPEG
//   name.mp4        H.264, by running ffmpeg
//   name_%04d.png   a picture for every frame, from 1 on; .bmp too
//   -               raw frames on standard output: R G B of every pixel, nothing between
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

// What goes to where `output` names.
struct VideoSink {
    std::function<Result<Bytes>(const Framebuffer &)> encode; // any thread, several at once
    std::function<Status(ByteView)> write;                    // encoded frames in their order
    std::function<Status()> finish;                           // without it no file appears, but for single pictures
};

// Refuses a name that asks for nothing of the above.
//
// errors  usage
Status check_video_name(const std::string &output);
// Whether frames keep their transparency. A name that is known.
bool has_transparency(const std::string &output);
// Files that will be written, one or two of them in place of all: what must not be an input.
std::vector<std::string> video_files(const VideoOptions &options);

// errors  usage   as check_video_name
//         io      it cannot be written
//         memory  ffmpeg is not installed
Result<VideoSink> open_video(const VideoOptions &options, glm::ivec2 size);

// Encodes frames on threads of its own while the next ones are drawn.
class VideoRecorder {
  public:
    // Takes at most `max_memory` bytes for frames, but two at least.
    VideoRecorder(VideoSink sink, glm::ivec2 size, bool with_depths, int threads, std::uint64_t max_memory);

    // Where to draw the next frame.
    Framebuffer &canvas() { return slots_[next_].picture; }
    // The canvas is a frame. What came before it may be written now, and its errors told.
    Status add();
    // Waits until all is written. The last call.
    Status finish();

    std::uint64_t bytes() const { return bytes_; } // encoded and written so far

  private:
    struct Slot {
        Slot(glm::ivec2 size, bool with_depths) : picture(size.x, size.y, with_depths) {}
        Framebuffer picture;
        std::future<Result<Bytes>> encoded;
    };
    Status drain(Slot &slot);

    const VideoSink sink_;
    std::vector<Slot> slots_; // used in turn
    std::size_t next_ = 0;
    std::uint64_t bytes_ = 0;
    std::optional<ThreadPool> encoders_; // last: their work uses the slots
};

} // namespace pbm
