// The whole walk from a scan to a .pbvg file.
//
//   read_surface -> place -> dress -> repair_mesh -> choose_creases -> merge_surfaces -> drop_far_parts -> find_up_axis
//   -> estimate_normals -> choose_grid -> upsample -> sample_points -> voxelize -> choose_radii -> place_scene ->
//   evaluate_solid_texture -> bake_shadows -> encode_octree -> average_levels -> write_model
#pragma once

#include "pbm_build/fields/field_choice.h"
#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/grid/placement.h"
#include "pbm_build/mesh_repair/repair_mesh.h"
#include "pbm_build/normals/estimate_normals.h"
#include "pbm_build/parts/part.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_build/scene/scene.h"
#include "pbm_format/model/model.h"
#include "pbm_format/writing/writer.h"
#include "pbm_scan/surface/surface.h"

#include <bitset>
#include <optional>
#include <span>
#include <string>

namespace pbm::build {

struct Credits {
    std::string name, licence, credit; // UTF-8, may be empty
};

struct BuildOptions {
    GridRequest grid;
    Placement placement;
    std::vector<std::string> poses;             // files of matrices, one for each input, or none
    const ScanFormat *input_format = nullptr;   // for inputs that neither content nor name identifies
    std::vector<std::string> columns;           // of inputs that are tables (table/text_cloud.h)
    ColourFormat colour = ColourFormat::rgb888; // where the input has colours
    Storage storage = Storage::packed;
    int compression_level = kDefaultCompressionLevel; // of packed files
    Credits credits;
    SceneRequest scene;
    MeshRequest mesh;
    std::vector<FieldRequest> fields;              // at most kMaxFields
    bool is_geographic = false;                    // x and y of the inputs are degrees
    bool keep_placeholders = false;                // keep points that stand for no measurement
    std::bitset<256> dropped_classes{};            // points with these classes are left out
    std::optional<double> crease_angle;            // degrees, 0..180; creases.h
    std::vector<std::array<double, 3>> viewpoints; // estimated normals face them; model units. One for all, or one for
                                                   // each surface in their order; empty: the stations of the surfaces
    Outliers outliers = Outliers::drop_strays;     // and far parts; kept with a grid that is given
    std::optional<int> upsample;                   // largest gap, voxels; upsample.h
    bool strict = false;                           // refuse the input instead of dropping any of it
    WarningSet denied{};                           // refuse the input where its report has a line of these kinds
    int threads = 0;                               // 0: one per processor
    std::uint64_t max_samples = std::uint64_t{1} << 31; // pairs of a voxel and a triangle or point
};

// Builds a model with all levels, without panorama, from surfaces in the model's coordinates. The result does not
// depend on the number of threads, nor on the order of surfaces, vertices, triangles and points. Adds to `statistics`.
//
// errors  unsupported_feature  more than kMaxMaterials materials, that of the ground plane included
//         bad_input            with `strict`: vertices that no triangle uses; a line of a kind that is denied
//         too_large, usage     see grid_choice.h; more than kMaxPoints points
//         memory               more samples than max_samples, or too many made points
Result<Model> build_model(std::vector<Surface> surfaces, const BuildOptions &options, BuildStatistics &statistics,
                          const Progress &progress = {});

// The name of an input in errors and reports.
inline std::string name_of(const std::string &input) { return input == "-" ? "standard input" : input; }

// Calls read_surface and place for each input, then build_model. Errors and report lines name the input where there are
// several. The caller adds the panorama (make_panorama).
Result<Model> read_and_build(std::span<const std::string> inputs, const BuildOptions &options,
                             BuildStatistics &statistics, const Progress &progress = {});

// The two halves of read_and_build for several processes: each reads all inputs and makes a part of the points, and one
// joins all parts of the scan, in their order. The parts give the model that read_and_build gives. Inputs are read
// again for shadows that rays cast.
//
// errors  as read_and_build
//         memory  a part, or all of them, have more than max_samples, where read_and_build would choose a coarser grid
Result<Part> read_and_build_part(std::span<const std::string> inputs, const PartNumber &number,
                                 const BuildOptions &options, BuildStatistics &statistics,
                                 const Progress &progress = {});
Result<Model> merge_parts(std::vector<Part> parts, std::span<const std::string> inputs, const BuildOptions &options,
                          BuildStatistics &statistics, const Progress &progress = {});

// Writes the file (write_model) and counts its bytes.
Status write(const std::string &output, const Model &model, const BuildOptions &options, BuildStatistics &statistics,
             const Progress &progress = {});

} // namespace pbm::build
