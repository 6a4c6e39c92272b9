#include "viewer/pictures/exr_writer.h"

#include <cmath>
#include <string>

#ifdef PBM_OPENEXR_LIBRARY
#include <OpenEXR/openexr.h>

#include <dlfcn.h>

#include <algorithm>
#include <string_view>
#endif

namespace pbm {

PictureLayers::PictureLayers(int columns, int rows)
    : width(columns), height(rows), colour(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)),
      depth(colour.size()), position(colour.size()), normal(colour.size()), numbers(colour.size()) {}

#ifdef PBM_OPENEXR_LIBRARY
namespace {

constexpr float kNothing = 1e10F; // Z where nothing is

// The functions of the library that are used. It is loaded once and stays.
struct OpenExr {
    decltype(&exr_start_write) start_write = nullptr;
    decltype(&exr_add_part) add_part = nullptr;
    decltype(&exr_initialize_required_attr_simple) set_required = nullptr;
    decltype(&exr_add_channel) add_channel = nullptr;
    decltype(&exr_write_header) write_header = nullptr;
    decltype(&exr_get_scanlines_per_chunk) rows_per_chunk = nullptr;
    decltype(&exr_write_scanline_chunk_info) chunk_info = nullptr;
    decltype(&exr_encoding_initialize) encoding_initialize = nullptr;
    decltype(&exr_encoding_update) encoding_update = nullptr;
    decltype(&exr_encoding_choose_default_routines) choose_routines = nullptr;
    decltype(&exr_encoding_run) encoding_run = nullptr;
    decltype(&exr_encoding_destroy) encoding_destroy = nullptr;
    decltype(&exr_finish) finish = nullptr;
    decltype(&exr_get_default_error_message) message = nullptr;
    std::string error; // why it is not there

    static const OpenExr &get() {
        static const OpenExr kLibrary;
        return kLibrary;
    }

  private:
    OpenExr() {
        void *const library = dlopen(PBM_OPENEXR_LIBRARY, RTLD_NOW | RTLD_LOCAL);
        const auto find = [&](auto &function, const char *name) {
            if (error.empty() && library != nullptr)
                function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(dlsym(library, name));
            if (error.empty() && function == nullptr) {
                const char *const why = dlerror();
                error = why != nullptr ? why : name;
            }
        };
        find(start_write, "exr_start_write");
        find(add_part, "exr_add_part");
        find(set_required, "exr_initialize_required_attr_simple");
        find(add_channel, "exr_add_channel");
        find(write_header, "exr_write_header");
        find(rows_per_chunk, "exr_get_scanlines_per_chunk");
        find(chunk_info, "exr_write_scanline_chunk_info");
        find(encoding_initialize, "exr_encoding_initialize");
        find(encoding_update, "exr_encoding_update");
        find(choose_routines, "exr_encoding_choose_default_routines");
        find(encoding_run, "exr_encoding_run");
        find(encoding_destroy, "exr_encoding_destroy");
        find(finish, "exr_finish");
        find(message, "exr_get_default_error_message");
    }
};

// A channel of the file, and where its value of pixel 0 lies in memory.
struct Channel {
    const char *name;
    exr_pixel_type_t stored, in_memory; // in_memory: of 4 bytes
    const void *first;
    std::size_t stride; // bytes from pixel to pixel
};

std::vector<Channel> channels_of(const PictureLayers &layers, const std::vector<float> &depths) {
    const auto channel = [](const char *name, exr_pixel_type_t type, const auto &pixels, std::size_t at,
                            exr_pixel_type_t stored) {
        return Channel{name, stored, type, reinterpret_cast<const std::uint8_t *>(pixels.data()) + 4 * at,
                       sizeof(pixels[0])};
    };
    std::vector<Channel> all;
    for (const auto &[name, at] : {std::pair{"R", 0U}, {"G", 1U}, {"B", 2U}, {"A", 3U}})
        all.push_back(channel(name, EXR_PIXEL_FLOAT, layers.colour, at, EXR_PIXEL_HALF));
    all.push_back(channel("Z", EXR_PIXEL_FLOAT, depths, 0, EXR_PIXEL_FLOAT));
    for (const auto &[name, at] : {std::pair{"P.X", 0U}, {"P.Y", 1U}, {"P.Z", 2U}})
        all.push_back(channel(name, EXR_PIXEL_FLOAT, layers.position, at, EXR_PIXEL_FLOAT));
    for (const auto &[name, at] : {std::pair{"N.X", 0U}, {"N.Y", 1U}, {"N.Z", 2U}})
        all.push_back(channel(name, EXR_PIXEL_FLOAT, layers.normal, at, EXR_PIXEL_FLOAT));
    for (const auto &[name, at] : {std::pair{"level.X", 0U}, {"material.X", 1U}, {"point.X", 2U}})
        all.push_back(channel(name, EXR_PIXEL_UINT, layers.numbers, at, EXR_PIXEL_UINT));
    return all;
}

std::int64_t append(exr_const_context_t, void *file, const void *bytes, std::uint64_t size, std::uint64_t offset,
                    exr_stream_error_func_ptr_t) {
    Bytes &to = *static_cast<Bytes *>(file);
    to.resize(std::max<std::size_t>(to.size(), offset + size));
    std::copy_n(static_cast<const std::uint8_t *>(bytes), size, to.data() + offset);
    return static_cast<std::int64_t>(size);
}

// One file that is written. Each step returns what the library returns; after an error nothing more is done.
class ExrFile {
  public:
    explicit ExrFile(const OpenExr &library) : exr_(library) {}
    ~ExrFile() { finish(); }
    ExrFile(const ExrFile &) = delete;
    ExrFile &operator=(const ExrFile &) = delete;

    exr_result_t begin(const PictureLayers &layers, const std::vector<Channel> &channels) {
        exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
        settings.user_data = &bytes_;
        settings.write_fn = append;
        settings.error_handler_fn = [](exr_const_context_t, exr_result_t, const char *) {}; // not on standard error
        int part = 0;
        exr_result_t code = exr_.start_write(&file_, "picture.exr", EXR_WRITE_FILE_DIRECTLY, &settings);
        if (code == EXR_ERR_SUCCESS)
            code = exr_.add_part(file_, nullptr, EXR_STORAGE_SCANLINE, &part);
        if (code == EXR_ERR_SUCCESS)
            code = exr_.set_required(file_, part, layers.width, layers.height, EXR_COMPRESSION_ZIP);
        for (const Channel &channel : channels)
            if (code == EXR_ERR_SUCCESS)
                code = exr_.add_channel(file_, part, channel.name, channel.stored, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
        if (code == EXR_ERR_SUCCESS)
            code = exr_.write_header(file_);
        if (code == EXR_ERR_SUCCESS)
            code = exr_.rows_per_chunk(file_, part, &rows_);
        return code;
    }
    exr_result_t write(const PictureLayers &layers, const std::vector<Channel> &channels) {
        for (int y = 0; y < layers.height; y += rows_) {
            exr_chunk_info_t chunk{};
            exr_result_t code = exr_.chunk_info(file_, 0, y, &chunk);
            if (code == EXR_ERR_SUCCESS)
                code = has_pipeline_ ? exr_.encoding_update(file_, 0, &chunk, &pipeline_)
                                     : exr_.encoding_initialize(file_, 0, &chunk, &pipeline_);
            if (code != EXR_ERR_SUCCESS)
                return code;
            for (const Channel &channel : channels)
                place(channel, static_cast<std::size_t>(y), static_cast<std::size_t>(layers.width));
            if (!std::exchange(has_pipeline_, true))
                code = exr_.choose_routines(file_, 0, &pipeline_);
            if (code == EXR_ERR_SUCCESS)
                code = exr_.encoding_run(file_, 0, &pipeline_);
            if (code != EXR_ERR_SUCCESS)
                return code;
        }
        return EXR_ERR_SUCCESS;
    }
    exr_result_t finish() {
        if (std::exchange(has_pipeline_, false))
            exr_.encoding_destroy(file_, &pipeline_); // which needs the file
        return file_ != nullptr ? exr_.finish(&file_) : EXR_ERR_SUCCESS;
    }
    Bytes take() { return std::move(bytes_); }

  private:
    // Tells the library, which has sorted the channels by name, where the values of row `y` are.
    void place(const Channel &channel, std::size_t y, std::size_t width) {
        const auto ends = pipeline_.channels + pipeline_.channel_count;
        const auto to = std::find_if(pipeline_.channels, ends,
                                     [&](const auto &c) { return std::string_view(c.channel_name) == channel.name; });
        to->user_bytes_per_element = 4;
        to->user_data_type = static_cast<std::uint16_t>(channel.in_memory);
        to->user_pixel_stride = static_cast<std::int32_t>(channel.stride);
        to->user_line_stride = static_cast<std::int32_t>(channel.stride * width);
        to->encode_from_ptr = static_cast<const std::uint8_t *>(channel.first) + channel.stride * width * y;
    }

    const OpenExr &exr_;
    exr_context_t file_ = nullptr;
    exr_encode_pipeline_t pipeline_{};
    bool has_pipeline_ = false;
    std::int32_t rows_ = 1; // of a chunk
    Bytes bytes_;
};

} // namespace

Result<Bytes> encode_exr(const PictureLayers &layers) {
    const OpenExr &library = OpenExr::get();
    if (!library.error.empty())
        return Error{ErrorCode::unsupported_feature, 0,
                     "OpenEXR is not installed (Debian's package libopenexr-3-1-30): " + library.error};
    std::vector<float> depths = layers.depth;
    std::replace_if(
        depths.begin(), depths.end(), [](float z) { return !std::isfinite(z); }, kNothing);
    const std::vector<Channel> channels = channels_of(layers, depths);
    ExrFile file(library);
    exr_result_t code = file.begin(layers, channels);
    if (code == EXR_ERR_SUCCESS)
        code = file.write(layers, channels);
    if (code == EXR_ERR_SUCCESS)
        code = file.finish();
    if (code != EXR_ERR_SUCCESS)
        return Error{ErrorCode::memory, 0, std::string("OpenEXR failed: ") + library.message(code)};
    return file.take();
}

#else

Result<Bytes> encode_exr(const PictureLayers &) {
    return Error{ErrorCode::unsupported_feature, 0,
                 "this program was built without OpenEXR (Debian's package libopenexr-dev)"};
}

#endif

} // namespace pbm
