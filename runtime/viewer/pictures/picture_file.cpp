#include "viewer/pictures/picture_file.h"

#include "system/files/file_names.h"
#include "system/files/file_replacement.h"
#include "viewer/pictures/image_writer.h"
#include "viewer/pictures/jpeg_encoder.h"

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <system_error>

namespace pbm {
namespace {

// Reserves the name by creating an empty file, which fails if one exists.
bool take_name(const std::string &path) {
    std::FILE *const file = std::fopen(path.c_str(), "wx");
    return file != nullptr && std::fclose(file) == 0;
}

} // namespace

Result<PictureForm> picture_form(const std::string &name) {
    const std::string extension = lower_case(std::filesystem::path(name).extension().string());
    if (extension.empty() || extension == ".png")
        return PictureForm::png;
    if (extension == ".bmp")
        return PictureForm::bmp;
    if (extension == ".jpg" || extension == ".jpeg")
        return PictureForm::jpeg;
    if (extension == ".exr")
        return PictureForm::exr;
    return usage_error(
        name + ": pictures are PNG, JPEG, BMP or EXR files; choose a name that ends with .png, .jpg, .bmp or .exr");
}

Result<Bytes> encode_picture(const Framebuffer &picture, PictureForm form, int threads) {
    constexpr int kJpegQuality = 95;
    switch (form) {
    case PictureForm::bmp: return encode_bmp(picture);
    case PictureForm::jpeg: return encode_jpeg(picture, kJpegQuality);
    default: return encode_png(picture, threads);
    }
}

void set_dpi(int dpi, PictureForm form, Bytes &file) {
    const auto per_metre = static_cast<std::uint32_t>(std::lround(dpi / 0.0254));
    constexpr std::size_t kBmpResolution = 38, kJpegUnit = 13; // bytes from the start of the file
    if (form == PictureForm::png)
        set_png_density(per_metre, file);
    if (form == PictureForm::bmp)
        for (const std::size_t at : {kBmpResolution, kBmpResolution + 4})
            store(file.data() + at, per_metre);
    if (form == PictureForm::jpeg) { // the header of JFIF
        file[kJpegUnit] = 1;         // inches
        for (const std::size_t at : {kJpegUnit + 1, kJpegUnit + 3}) {
            file[at] = static_cast<std::uint8_t>(dpi >> 8);
            file[at + 1] = static_cast<std::uint8_t>(dpi);
        }
    }
}

Result<std::string> save_picture(const std::filesystem::path &folder, const std::string &name,
                                 const Framebuffer &picture) {
    const auto png = encode_png(picture);
    return png ? save_numbered(folder, name, ".png", *png) : png.error();
}

Result<std::string> save_numbered(const std::filesystem::path &folder, const std::string &name,
                                  const std::string &extension, ByteView bytes) {
    for (int number = 1;; ++number) {
        std::string file = name;
        file.append("-").append(std::to_string(number)).append(extension);
        const std::string path = (folder / file).string();
        errno = 0;
        if (!take_name(path)) {
            if (errno == EEXIST)
                continue;
            return Error{ErrorCode::io, 0,
                         "cannot write " + path + ": " + std::error_code(errno, std::generic_category()).message()};
        }
        if (const Status written = replace_file(path, bytes, Durability::cached); !written) {
            std::error_code ignored;
            std::filesystem::remove(path, ignored);
            return Error{written.error().code, 0, path + ": " + written.error().message};
        }
        return path;
    }
}

} // namespace pbm
