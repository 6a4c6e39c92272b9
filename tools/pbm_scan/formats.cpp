#include "pbm_scan/formats.h"

#include "pbm_scan/e57/e57_reader.h"
#include "pbm_scan/gltf/gltf_reader.h"
#include "pbm_scan/las/las_reader.h"
#include "pbm_scan/mesh/mesh_reader.h"
#include "pbm_scan/ply/ply_header.h"
#include "pbm_scan/ply/ply_reader.h"
#include "pbm_scan/ptx/ptx_reader.h"
#include "pbm_scan/spz/spz_reader.h"
#include "pbm_scan/table/pcd_reader.h"
#include "pbm_scan/table/text_cloud.h"
#include "pbm_scan/text/words.h"

#include <algorithm>
#include <array>

namespace pbm::build {
namespace {

// A reader that opens no other file.
template <Result<Surface> (*Read)(std::span<const std::uint8_t>, const ReadOptions &)>
Result<Surface> alone(const ScanFile &file, const ReadOptions &options) {
    return Read(file.bytes, options);
}

constexpr std::array kFormats{
    ScanFormat{"ply", ".ply", is_ply, read_ply, files_of_ply},
    ScanFormat{"gltf", ".gltf .glb", is_gltf, read_gltf, files_of_gltf},
    ScanFormat{"obj", ".obj", nullptr, read_obj, files_of_obj},
    ScanFormat{"off", ".off", is_off, alone<read_off>},
    ScanFormat{"stl", ".stl", is_stl, alone<read_stl>},
    ScanFormat{"e57", ".e57", is_e57, alone<read_e57>},
    ScanFormat{"ptx", ".ptx", is_ptx, alone<read_ptx>},
    ScanFormat{"las", ".las .laz", is_las, alone<read_las>},
    ScanFormat{"spz", ".spz", is_spz, alone<read_spz>},
    ScanFormat{"pcd", ".pcd", is_pcd, alone<read_pcd>},
    ScanFormat{"xyz", ".xyz .xyzrgb .xyzn .pts .asc .csv .txt", nullptr, alone<read_text_cloud>, nullptr, true},
};

} // namespace

bool ScanFormat::has_extension(std::string_view extension) const {
    for (std::string_view rest = extensions; !rest.empty();) {
        const std::size_t end = std::min(rest.find(' '), rest.size());
        if (rest.substr(0, end) == extension)
            return true;
        rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return false;
}

std::span<const ScanFormat> scan_formats() { return kFormats; }

std::string names_of_formats() {
    std::vector<std::string> names;
    for (const ScanFormat &format : kFormats)
        for (const char c : format.extensions)
            if (c == '.')
                names.emplace_back();
            else if (c != ' ')
                names.back() += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    return joined(names, " or ");
}

} // namespace pbm::build
