#include "pbm_scan/foreign_formats.h"

#include "pbm_scan/text/stand_in.h"
#include "pbm_scan/text/text_lines.h"

#include <array>

namespace pbm::build {
namespace {

struct ForeignFormat {
    std::string_view magic;     // first bytes of the file, as a whole word; empty: recognised by the extension
    std::string_view extension; // lower case, with the dot; empty: recognised by the magic
    std::string_view what;      // "the file is ..."
};

bool continues_word(char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

// "camera x y z" names columns of a table.
bool begins_with(std::string_view text, std::string_view magic) {
    if (!text.starts_with(magic))
        return false;
    const std::string_view rest = text.substr(magic.size());
    if (magic == "BZh") // and the digit of its level
        return rest.empty() || (rest.front() >= '1' && rest.front() <= '9' && (rest.size() == 1 || rest[1] == '1'));
    return rest.empty() || (magic.back() == ' '            ? rest.find_first_of("-.0123456789") == 0
                            : continues_word(magic.back()) ? !continues_word(rest.front()) && rest.front() != ','
                                                           : true);
}

constexpr auto kForeign = std::to_array<ForeignFormat>({
    {"\x89"
     "BVG\r\n\x1a\n",
     "", "a PBM model already; draw it with pbm-render"},
    {"P1\n", "", "a Netpbm bitmap, not a scan"},
    {"P4\n", "", "a Netpbm bitmap, not a scan"},
    {"P5\n", "", "a Netpbm image, not a scan"},
    {"P6\n", "", "a Netpbm image, not a scan"},
    {"\x89PNG\r\n\x1a\n", "", "a PNG image, not a scan"},
    {"\xff\xd8\xff", "", "a JPEG image, not a scan"},
    {"Kaydara FBX", ".fbx", "FBX; convert it to PLY"},
    {"DRACO", ".drc", "a Draco mesh; convert it to PLY"},
    {"ISO-10303", ".step", "STEP; convert it to PLY"},
    {"# 3D point list with one line of data per point:", "",
     "COLMAP's text of points, whose rows have different lengths; write PLY with colmap model_converter --output_type "
     "PLY"},
    {"# vtk DataFile", ".vtk", "VTK; convert it to PLY"},
    {"#VRML", ".wrl", "VRML; convert it to PLY"},
    {"\x1f\x8b", "", "compressed by gzip twice; unpack it first"},
    {"\x28\xb5\x2f\xfd", "", "compressed by zstd twice; unpack it first"},
    {"BZh", "", "compressed by bzip2; unpack it first"},
    {"\xfd"
     "7zXZ",
     "", "compressed by xz; unpack it first"},
    {"PK\x03\x04", ".3mf", "a ZIP archive (or 3MF); unpack it or convert it to PLY"},
    {"", ".dae", "COLLADA; convert it to PLY"},
    {"[Expe/PointSet/", "", "an Expe point set; convert it to PLY"},
    {"camera ", ".conf", "a list of scans and where they lie, not a scan; build the PLY files that it names"},
    {"", ".pbm", "named like a Netpbm bitmap; PBM's models are .pbvg, scans are PLY, OBJ, STL or OFF"},
    {"", ".pbvg", "named like a PBM model but has not its magic number; it is damaged"},
    {"", ".bvg", "a Binary Vertex Group of Easy3D, Mapple or PolyFit, or a damaged PBM model; export it there as PLY"},
    {"", ".3ds", "3DS; convert it to PLY"},
    {"", ".usd", "USD; convert it to PLY"},
    {"", ".usda", "USD; convert it to PLY"},
    {"", ".usdc", "USD; convert it to PLY"},
    {"", ".usdz", "USD; convert it to PLY"},
    {"", ".blend", "a scene of Blender; export it there as PLY"},
    {"", ".x3d", "X3D; convert it to PLY"},
});

} // namespace

std::optional<std::string> foreign_by_content(std::span<const std::uint8_t> bytes) {
    if (const auto instead = stand_in(as_text(bytes)))
        return "the file is " + *instead;
    for (const ForeignFormat &format : kForeign)
        if (!format.magic.empty() && begins_with(as_text(bytes), format.magic))
            return "the file is " + std::string(format.what);
    constexpr std::size_t kTarMagicAt = 257;
    if (bytes.size() > kTarMagicAt && as_text(bytes.subspan(kTarMagicAt)).starts_with("ustar"))
        return "the file is a tar archive; unpack it";
    return std::nullopt;
}

std::optional<std::string> foreign_by_name(std::string_view extension) {
    for (const ForeignFormat &format : kForeign)
        if (!format.extension.empty() && format.extension == extension)
            return "the file is " + std::string(format.what);
    return std::nullopt;
}

} // namespace pbm::build
