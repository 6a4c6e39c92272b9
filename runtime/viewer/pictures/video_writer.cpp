#include "viewer/pictures/video_writer.h"

#include "system/files/file_replacement.h"
#include "system/processes/child_program.h"
#include "system/threads/parallel.h"
#include "viewer/pictures/avi_writer.h"
#include "viewer/pictures/frame_names.h"
#include "viewer/pictures/jpeg_encoder.h"
#include "viewer/pictures/picture_file.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <utility>

namespace pbm {
namespace {

enum class Form { avi, mp4, pictures, raw };

Result<Form> form_of(const std::string &output) {
    if (output == "-")
        return Form::raw;
    const std::string extension = std::filesystem::path(output).extension().string();
    if (extension == ".avi" || extension == ".AVI")
        return Form::avi;
    if (extension == ".mp4" || extension == ".MP4")
        return Form::mp4;
    if (const auto form = picture_form(output); !extension.empty() && form && *form != PictureForm::exr) {
        const auto names = parse_frame_names(output);
        return names ? Result<Form>(Form::pictures) : names.error();
    }
    return usage_error(output + ": videos are .avi, .mp4, pictures like name_%04d.png, or - for raw frames");
}

// A frame of `size`, which repeats the last column and row of the picture.
Bytes rgb_of(const Framebuffer &picture, glm::ivec2 size) {
    Bytes bytes(3 * static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
    std::uint8_t *to = bytes.data();
    for (int y = 0; y < size.y; ++y) {
        const std::uint32_t *const row =
            picture.colour.data() + std::ptrdiff_t{std::min(y, picture.height - 1)} * picture.width;
        for (int x = 0; x < size.x; ++x, to += 3) {
            const Rgba8 pixel = unpack_rgba(row[std::min(x, picture.width - 1)]);
            std::copy_n(pixel.begin(), 3, to);
        }
    }
    return bytes;
}

Result<VideoSink> open_avi(const VideoOptions &options, glm::ivec2 size) {
    auto opened = AviWriter::begin(options.output, size, frame_rate(options.fps));
    if (!opened)
        return opened.error();
    const auto writer = std::make_shared<AviWriter>(std::move(*opened));
    return VideoSink{
        .encode = [quality = options.quality](const Framebuffer &frame) { return encode_jpeg(frame, quality); },
        .write = [writer](ByteView jpeg) { return writer->write(jpeg); },
        .finish = [writer] { return writer->finish(); }};
}

// One thread, exact arithmetic and no encoder version in the file: the same bytes on every computer. The file exists
// and is empty, hence -y. Players take an untagged film for BT.709 or BT.601 by its size: the matrix is named where it
// is applied, and in the file. Colours have finer steps than brightness, at 7 % more bytes: plain ones stay within 3 of
// 255.
std::vector<std::string> ffmpeg_command(glm::ivec2 size, FrameRate rate, const std::string &file) {
    std::istringstream words("ffmpeg -hide_banner -loglevel error -y -f rawvideo -pixel_format rgb24 -video_size " +
                             std::to_string(size.x) + "x" + std::to_string(size.y) + " -framerate " +
                             std::to_string(rate.frames) + "/" + std::to_string(rate.seconds) +
                             " -i pipe:0 -an -vf scale=out_color_matrix=bt709:out_range=tv:"
                             "flags=bicubic+accurate_rnd+full_chroma_inp+bitexact,format=yuv420p"
                             " -c:v libx264 -crf 18 -x264-params chroma-qp-offset=-6 -colorspace bt709 "
                             "-color_primaries bt709 -color_trc bt709"
                             " -color_range tv -threads 1 -bitexact -fflags +bitexact -flags:v +bitexact"
                             " -movflags +faststart -f mp4");
    std::vector<std::string> command(std::istream_iterator<std::string>(words), {});
    command.push_back("file:" + file); // one word, even with spaces
    return command;
}

Result<VideoSink> open_mp4(const VideoOptions &options, glm::ivec2 size) {
    auto opened = FileReplacement::begin(options.output);
    if (!opened)
        return opened.error();
    const auto file = std::make_shared<FileReplacement>(std::move(*opened));
    const glm::ivec2 stored = stored_size(options.output, size);
    auto started = ChildProgram::start(ffmpeg_command(stored, frame_rate(options.fps), file->name_until_finished()));
    const auto with_advice = [](Error error) {
        error.message += "; .avi needs no other program";
        return error;
    };
    if (!started)
        return with_advice(started.error());
    const auto program = std::make_shared<ChildProgram>(std::move(*started));
    return VideoSink{
        .encode = [stored](const Framebuffer &frame) { return rgb_of(frame, stored); },
        .write = [=](ByteView rgb) -> Status {
            Status written = program->write(rgb);
            return written ? written : with_advice(std::move(written).error());
        },
        .finish = [=]() -> Status {
            if (Status ended = program->finish(); !ended)
                return with_advice(std::move(ended).error());
            std::error_code unknown;
            if (std::filesystem::file_size(file->name_until_finished(), unknown) == 0)
                return with_advice({ErrorCode::memory, 0, "ffmpeg ended without an error and wrote nothing"});
            return file->finish(Durability::cached);
        }};
}

Result<VideoSink> open_pictures(const std::string &output) {
    const auto names = parse_frame_names(output);
    if (!names)
        return names.error();
    return VideoSink{
        .encode = [form = *picture_form(output)](const Framebuffer &frame) { return encode_picture(frame, form); },
        .write = [names = *names, frame = 0](ByteView bytes) mutable -> Status {
            const std::string name = names.of(++frame);
            Status written = replace_file(name, bytes, Durability::cached);
            if (!written)
                written.error().message.insert(0, name + ": ");
            return written;
        },
        .finish = [] { return Status(); }};
}

Result<VideoSink> open_raw(const std::string &output, glm::ivec2 size) {
    auto opened = FileReplacement::begin(output);
    if (!opened)
        return opened.error();
    const auto file = std::make_shared<FileReplacement>(std::move(*opened));
    return VideoSink{.encode = [size](const Framebuffer &frame) { return rgb_of(frame, size); },
                     .write = [file](ByteView rgb) { return file->write(rgb); },
                     .finish = [file] { return file->finish(Durability::cached); }};
}

} // namespace

Status check_video_name(const std::string &output) {
    const auto form = form_of(output);
    return form ? Status() : Status(form.error());
}

bool has_transparency(const std::string &output) {
    return *form_of(output) == Form::pictures && *picture_form(output) != PictureForm::jpeg;
}

glm::ivec2 stored_size(const std::string &output, glm::ivec2 size) {
    return *form_of(output) == Form::mp4 ? glm::ivec2(size.x + size.x % 2, size.y + size.y % 2) : size;
}

std::vector<std::string> video_files(const VideoOptions &options) {
    if (options.output.empty())
        return {};
    if (const auto names = parse_frame_names(options.output); names && *form_of(options.output) == Form::pictures)
        return options.frames == 1 ? std::vector{names->of(1)} : std::vector{names->of(1), names->of(options.frames)};
    return {options.output};
}

Result<VideoSink> open_video(const VideoOptions &options, glm::ivec2 size) {
    const auto form = form_of(options.output);
    if (!form)
        return form.error();
    switch (*form) {
    case Form::avi: return open_avi(options, size);
    case Form::mp4: return open_mp4(options, size);
    case Form::pictures: return open_pictures(options.output);
    case Form::raw: break;
    }
    return open_raw(options.output, size);
}

VideoRecorder::VideoRecorder(VideoSink sink, glm::ivec2 size, bool with_depths, int threads, std::uint64_t max_memory)
    : sink_(std::move(sink)) {
    // Bytes of a frame, its depths, its encoding and a copy of that.
    const std::uint64_t frame =
        std::uint64_t{16} * static_cast<std::uint64_t>(size.x) * static_cast<std::uint64_t>(size.y);
    const auto wanted = static_cast<std::uint64_t>(resolve_threads(threads)) + 1; // one more is being drawn
    const std::uint64_t count = std::clamp<std::uint64_t>(max_memory / frame, 2, wanted);
    slots_.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i)
        slots_.emplace_back(size, with_depths);
    encoders_.emplace(static_cast<int>(count)); // the calling thread draws
}

Status VideoRecorder::add() {
    Slot &slot = slots_[next_];
    slot.encoded = encoders_->post([this, &slot] { return sink_.encode(slot.picture); });
    next_ = (next_ + 1) % slots_.size();
    return drain(slots_[next_]);
}

Status VideoRecorder::finish() {
    for (std::size_t i = 0; i < slots_.size(); ++i)
        if (Status written = drain(slots_[(next_ + i) % slots_.size()]); !written)
            return written;
    return sink_.finish();
}

// Errors name the frame that was just taken from its slot.
Error VideoRecorder::with_frame(Error error) const {
    error.message.insert(0, "frame " + std::to_string(frames_) + ": ");
    return error;
}

// Writes the frame of a slot, if it holds one; it is the oldest frame not yet written.
Status VideoRecorder::drain(Slot &slot) {
    if (!slot.encoded.valid())
        return {};
    auto encoded = slot.encoded.get();
    ++frames_;
    if (!encoded)
        return with_frame(std::move(encoded).error());
    bytes_ += encoded->size();
    Status written = sink_.write(*encoded);
    return written ? written : with_frame(std::move(written).error());
}

} // namespace pbm
