#include "pbm_scan/surface_reader.h"

#include "pbm_scan/mesh/material_text.h"
#include "pbm_scan/mesh/mesh_reader.h"
#include "pbm_scan/ply/ply_header.h"
#include "pbm_scan/ply/ply_reader.h"
#include "pbm_scan/text/encoding.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"
#include "system/files/mapped_file.h"

#include <algorithm>
#include <array>

namespace pbm::build {
namespace {

struct ForeignFormat {
    std::string_view magic;     // first bytes of the file; empty: recognised by the extension
    std::string_view extension; // lower case, with the dot; empty: recognised by the magic
    std::string_view what;      // "the file is ..."
};

constexpr std::array<ForeignFormat, 33> kForeign{{
    {"\x89"
     "BVG\r\n\x1a\n",
     "", "a PBM model already; draw it with pbm-render"},
    {"P1\n", "", "a Netpbm bitmap, not a scan"},
    {"P4\n", "", "a Netpbm bitmap, not a scan"},
    {"P5\n", "", "a Netpbm image, not a scan"},
    {"P6\n", "", "a Netpbm image, not a scan"},
    {"\x89PNG\r\n\x1a\n", "", "a PNG image, not a scan"},
    {"\xff\xd8\xff", "", "a JPEG image, not a scan"},
    {"glTF", ".glb", "glTF; convert it to PLY"},
    {"", ".gltf", "glTF; convert it to PLY"},
    {"LASF", ".las", "a LAS point cloud; convert it to PLY"},
    {"", ".laz", "a LAZ point cloud; convert it to PLY"},
    {"ASTM-E57", ".e57", "an E57 point cloud; convert it to PLY"},
    {"# .PCD", ".pcd", "a PCD point cloud; convert it to PLY"},
    {"Kaydara FBX", ".fbx", "FBX; convert it to PLY"},
    {"DRACO", ".drc", "a Draco mesh; convert it to PLY"},
    {"ISO-10303", ".step", "STEP; convert it to PLY"},
    {"# vtk DataFile", ".vtk", "VTK; convert it to PLY"},
    {"#VRML", ".wrl", "VRML; convert it to PLY"},
    {"\x1f\x8b", "", "compressed by gzip; unpack it first"},
    {"\x28\xb5\x2f\xfd", "", "compressed by zstd; unpack it first"},
    {"BZh", "", "compressed by bzip2; unpack it first"},
    {"\xfd"
     "7zXZ",
     "", "compressed by xz; unpack it first"},
    {"PK\x03\x04", ".3mf", "a ZIP archive (or 3MF); unpack it or convert it to PLY"},
    {"", ".dae", "COLLADA; convert it to PLY"},
    {"[Expe/PointSet/", "", "an Expe point set; convert it to PLY"},
    {"camera ", ".conf", "a list of scans and where they lie, not a scan; build the PLY files that it names"},
    {"", ".xyz", "a list of points without a header; convert it to PLY"},
    {"", ".pts", "a list of points without a header; convert it to PLY"},
    {"", ".ptx", "a PTX point cloud; convert it to PLY"},
    {"", ".pbm", "named like a Netpbm bitmap; PBM's models are .pbvg, scans are PLY, OBJ, STL or OFF"},
    {"", ".pbvg", "named like a PBM model but has not its magic number; it is damaged"},
    {"", ".bvg", "a Binary Vertex Group of Easy3D, Mapple or PolyFit, or a damaged PBM model; export it there as PLY"},
    {"", ".3ds", "3DS; convert it to PLY"},
}};

std::string lower_extension(std::string_view path) {
    const std::size_t dot = path.find_last_of("./");
    if (dot == std::string_view::npos || path[dot] != '.')
        return {};
    std::string extension(path.substr(dot));
    for (char &c : extension)
        c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return extension;
}

// The extension of `path`, or that of `format` where `path` has no extension of a scan.
std::string effective_extension(std::string_view path, const std::optional<ScanFormat> &format) {
    constexpr std::array<std::string_view, 4> kExtensions{".ply", ".obj", ".off", ".stl"};
    const std::string extension = lower_extension(path);
    const bool known = std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
    return known || !format ? extension : std::string(kExtensions[static_cast<std::size_t>(*format)]);
}

bool begins_off(std::string_view text) {
    const std::size_t off = text.substr(0, 8).find("OFF");
    return off != std::string_view::npos && text.substr(0, off).find_first_not_of("STCN4n") == std::string_view::npos;
}

bool begins_stl(std::span<const std::uint8_t> bytes, std::string_view text) {
    if (text.substr(0, 6) == "solid " || text.substr(0, 6) == "solid\n")
        return true;
    if (bytes.size() < 84 || (bytes.size() - 84) % 50 != 0)
        return false;
    const std::uint64_t facets =
        bytes[80] | std::uint64_t{bytes[81]} << 8 | std::uint64_t{bytes[82]} << 16 | std::uint64_t{bytes[83]} << 24;
    return facets == (bytes.size() - 84) / 50;
}

// Calls use(rest of the line, without white space around it) for every line of `file` whose first word begins with
// `keyword`.
template <class Use> void for_lines(std::span<const std::uint8_t> file, std::string_view keyword, Use &&use) {
    const auto utf8 = as_utf8(file);
    std::string_view text = utf8 ? as_text(utf8->bytes) : std::string_view();
    while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
        if (!line.starts_with(keyword))
            continue;
        line.remove_prefix(std::min(line.find_first_of(" \t"), line.size()));
        line = trimmed(line, " \t");
        if (!line.empty())
            use(line);
    }
}

// A line names several files (Wavefront), or one file with spaces in its name (most writers): takes the one if it
// exists, else those of the several that exist.
std::vector<std::string> material_files(std::span<const std::uint8_t> obj, const std::string &path) {
    const std::string folder = path.substr(0, path.find_last_of('/') + 1);
    std::vector<std::string> files;
    std::size_t looked_for = 0;
    // Whether it is there, new or not.
    const auto add = [&](std::string_view name) {
        std::string file = folder + std::string(name);
        if (std::find(files.begin(), files.end(), file) != files.end())
            return true;
        if (++looked_for > kMaxMaterialFiles || !MappedFile::open(file).ok())
            return false;
        files.push_back(std::move(file));
        return true;
    };
    for_lines(obj, "mtllib", [&](std::string_view names) {
        if (looked_for >= kMaxMaterialFiles || add(names))
            return;
        while (!names.empty()) {
            const std::size_t end = std::min(names.find_first_of(" \t"), names.size());
            add(names.substr(0, end));
            names.remove_prefix(std::min(names.find_first_not_of(" \t", end), names.size()));
        }
    });
    return files;
}

// What the material files of an OBJ say.
struct MaterialFiles {
    std::vector<NamedMaterial> materials;
    std::vector<AttributeReport> report;
};

// Skips material files that are missing or too large. Names the texture images, which are dropped.
MaterialFiles read_material_files(std::span<const std::uint8_t> obj, const std::string &path,
                                  const ReadOptions &options) {
    constexpr std::size_t kMaxImages = 64;
    MaterialFiles found;
    std::vector<std::string> images;
    for (const std::string &file : material_files(obj, path)) {
        const Result<MappedFile> materials = MappedFile::open(file);
        if (!materials || materials->bytes().size() > kMaxMaterialBytes)
            continue;
        const Result<Utf8Text> text = as_utf8(materials->bytes());
        if (!text)
            continue;
        read_materials(as_text(text->bytes), options.default_material, found.materials, found.report);
        for_lines(text->bytes, "map_", [&](std::string_view image) {
            image.remove_prefix(image.find_last_of(" \t") + 1); // options come before the file's name
            if (images.size() < kMaxImages && std::find(images.begin(), images.end(), image) == images.end())
                images.emplace_back(image);
        });
    }
    for (const std::string &image : images)
        found.report.push_back(
            {"texture image " + printable_in_quotes(image), Fate::dropped, "PBM stores point colours"});
    return found;
}

Result<Surface> read_utf8(std::span<const std::uint8_t> bytes, std::string_view path, const ReadOptions &options) {
    if (is_ply(bytes))
        return read_ply(bytes, options);
    const std::string_view text = as_text(bytes);
    const std::string extension = effective_extension(path, options.format);
    for (const ForeignFormat &format : kForeign)
        if (!format.magic.empty() && text.substr(0, format.magic.size()) == format.magic)
            return unsupported("the file is " + std::string(format.what));
    if (extension == ".ply")
        return read_ply(bytes, options); // returns the error
    if (extension == ".obj")
        return read_mesh(bytes, MeshFormat::obj, options);
    if (extension == ".off" || begins_off(text))
        return read_mesh(bytes, MeshFormat::off, options);
    if (extension == ".stl" || begins_stl(bytes, text))
        return read_mesh(bytes, MeshFormat::stl, options);
    for (const ForeignFormat &format : kForeign)
        if (!format.extension.empty() && extension == format.extension)
            return unsupported("the file is " + std::string(format.what));
    return bad_input(std::string("the file is of no known format; scans are PLY, OBJ, STL or OFF") +
                     (extension.empty() ? " (an OBJ without that extension needs --input-format obj)" : ""));
}

} // namespace

Result<Surface> read_surface(std::span<const std::uint8_t> bytes, std::string_view path, const ReadOptions &options) {
    const auto text = as_utf8(bytes);
    if (!text)
        return text.error();
    if (text->bytes.empty())
        return bad_input("the file is empty");
    Result<Surface> surface = read_utf8(text->bytes, path, options);
    if (!surface && surface.error().offset != 0)
        surface.error().offset = text->offset_in_file(surface.error().offset);
    return surface;
}

Result<Surface> read_surface(const std::string &path, const ReadOptions &options) {
    const Result<MappedFile> file =
        is_stream(path) ? MappedFile::read_stream(path, kMaxStreamBytes) : MappedFile::open(path);
    if (!file)
        return file.error();
    MaterialFiles materials;
    ReadOptions with_materials = options;
    if (lower_extension(path) == ".obj") {
        materials = read_material_files(file->bytes(), path, options);
        with_materials.materials = materials.materials;
    }
    Result<Surface> surface = read_surface(file->bytes(), path, with_materials);
    if (!surface)
        return surface;
    surface->input_bytes = file->bytes().size();
    surface->report.insert(surface->report.end(), materials.report.begin(), materials.report.end());
    return finished(std::move(*surface), options);
}

std::vector<std::string> material_files(const std::string &path) {
    if (lower_extension(path) != ".obj")
        return {};
    const Result<MappedFile> file = MappedFile::open(path);
    return file ? material_files(file->bytes(), path) : std::vector<std::string>();
}

} // namespace pbm::build
