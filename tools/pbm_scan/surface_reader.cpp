#include "pbm_scan/surface_reader.h"

#include "pbm_scan/conventions/convention.h"
#include "pbm_scan/conventions/geographic.h"
#include "pbm_scan/foreign_formats.h"
#include "pbm_scan/formats.h"
#include "pbm_scan/packing/compressed.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/encoding.h"
#include "system/files/file_names.h"
#include "system/files/mapped_file.h"

#include <algorithm>

namespace pbm::build {
namespace {

const ScanFormat *format_of(std::span<const std::uint8_t> bytes, std::string_view extension) {
    const std::span<const ScanFormat> formats = scan_formats();
    auto found = std::find_if(formats.begin(), formats.end(), [&](const ScanFormat &format) {
        return format.recognises != nullptr && format.recognises(bytes);
    });
    if (found == formats.end())
        found = std::find_if(formats.begin(), formats.end(),
                             [&](const ScanFormat &format) { return format.has_extension(extension); });
    return found == formats.end() ? nullptr : &*found;
}

// `path`: its extension decides where the content does not tell. `place`: of files beside the scan, or empty.
Result<Surface> read_file(std::span<const std::uint8_t> bytes, std::string_view path, const std::string &place,
                          const ReadOptions &options) {
    const auto text = as_utf8(bytes);
    if (!text)
        return text.error();
    if (text->bytes.empty())
        return bad_input("the file is empty");
    if (const auto foreign = foreign_by_content(text->bytes))
        return unsupported(*foreign);
    const std::string extension = lower_extension(path);
    const ScanFormat *format = format_of(text->bytes, extension);
    if (format == nullptr) {
        if (const auto foreign = foreign_by_name(extension); foreign && options.format == nullptr)
            return unsupported(*foreign);
        format = options.format;
        if (const auto formats = scan_formats(); format == nullptr && !options.columns.empty()) // only a table has them
            format = &*std::find_if(formats.begin(), formats.end(), [](const auto &each) { return each.has_columns; });
    }
    if (format == nullptr)
        return bad_input("the file is of no known format; scans are " + names_of_formats() +
                         (extension.empty() ? " (an OBJ without that extension needs --input-format obj)" : ""));
    if (!options.columns.empty() && !format->has_columns)
        return usage_error(
            "--columns is for tables of points (XYZ, PTS, ASC, CSV, TXT); this file says itself what it holds");
    Result<Surface> surface = format->read({text->bytes, place}, options);
    if (surface) {
        apply_convention(format->name, extension, *surface);
        const bool are_degrees = options.is_geographic || surface->convention.is_geographic;
        if (are_degrees && options.is_one_of_several)
            return bad_input(
                "x and y are degrees, and the metres of several inputs have no common origin; convert them "
                "to one projected coordinate reference system first");
        if (are_degrees)
            degrees_to_metres(*surface, surface->convention.height_metres);
        else if (look_like_degrees(*surface))
            surface->report.push_back({"x and y", Fate::kept,
                                       "they look like degrees of longitude and latitude, and are taken as lengths; "
                                       "--geographic converts them to metres"});
    } else if (surface.error().offset != 0)
        surface.error().offset = text->offset_in_file(surface.error().offset);
    return surface;
}

// A file, mapped or unpacked.
struct Contents {
    MappedFile file;
    std::vector<std::uint8_t> unpacked{};
    bool is_packed = false;

    ByteView bytes() const { return is_packed ? ByteView(unpacked) : file.bytes(); }
};

Result<Contents> open(const std::string &path) {
    Result<MappedFile> file = is_stream(path) ? MappedFile::read_stream(path, kMaxStreamBytes) : MappedFile::open(path);
    if (!file)
        return file.error();
    auto unpacked_bytes = unpacked(file->bytes(), kMaxStreamBytes);
    if (!unpacked_bytes)
        return Contents{std::move(*file)};
    if (!*unpacked_bytes)
        return unpacked_bytes->error();
    return Contents{std::move(*file), std::move(**unpacked_bytes), true};
}

} // namespace

const ScanFormat *find_format(std::string_view name) {
    const std::span<const ScanFormat> formats = scan_formats();
    const auto found =
        std::find_if(formats.begin(), formats.end(), [&](const auto &each) { return each.name == name; });
    return found == formats.end() ? nullptr : &*found;
}

Result<Surface> read_surface(std::span<const std::uint8_t> bytes, std::string_view path, const ReadOptions &options) {
    return read_file(bytes, path, "", options);
}

Result<Surface> read_surface(const std::string &path, const ReadOptions &options) {
    const Result<Contents> file = open(path);
    if (!file)
        return file.error();
    Result<Surface> surface = read_file(file->bytes(), uncompressed_name(path), is_stream(path) ? "" : path, options);
    if (surface)
        surface->input_bytes = file->file.bytes().size();
    else if (file->is_packed && surface.error().offset != 0)
        surface.error().message += " (offset in the unpacked file)";
    return surface;
}

std::vector<NamedFile> further_files(const std::string &path) {
    if (is_stream(path))
        return {};
    const Result<Contents> file = open(path);
    const Result<Utf8Text> text = file ? as_utf8(file->bytes()) : Result<Utf8Text>(file.error());
    if (!text || text->bytes.empty())
        return {};
    const ScanFormat *const format = format_of(text->bytes, lower_extension(uncompressed_name(path)));
    return format == nullptr || format->further_files == nullptr ? std::vector<NamedFile>()
                                                                 : format->further_files({text->bytes, path});
}

} // namespace pbm::build
