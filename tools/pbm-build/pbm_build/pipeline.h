// The whole walk from a scan to a .pbvg file.
//
//   read_surface -> place -> dress -> merge_surfaces -> estimate_normals -> choose_grid -> sample_points -> voxelize ->
//   choose_radii -> place_scene -> evaluate_solid_texture -> bake_shadows -> encode_octree -> average_levels ->
//   write_model
#pragma once

#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_build/scene/metadata.h"
#include "pbm_build/scene/scene.h"
#include "pbm_format/model/model.h"
#include "pbm_format/writing/writer.h"
#include "pbm_scan/surface_reader.h"

#include <optional>
#include <span>
#include <string>

namespace pbm::build {

struct BuildOptions {
    GridRequest grid;
    Placement placement;
    std::optional<ScanFormat> input_format;     // where neither content nor name tells
    ColourFormat colour = ColourFormat::rgb888; // where the input has colours
    Storage storage = Storage::packed;
    int compression_level = kDefaultCompressionLevel; // of packed files
    Credits credits;
    SceneRequest scene;
    bool flip_faces = false;                              // the scan winds its faces clockwise
    std::optional<std::array<double, 3>> viewpoint;       // estimated normals face it; model units
    bool remove_outliers = false;                         // of points without faces; outliers.h
    bool strict = false;                                  // refuse rather than drop anything
    int threads = 0;                                      // 0: one per processor
    std::uint64_t max_hit_bytes = std::uint64_t{4} << 30; // of hits (hit_store.h); more is ErrorCode::memory
};

// Surfaces in the model's coordinates to a model, all levels, without panorama. The same model for any number of
// threads, any order of the surfaces, and any order of equal vertices, triangles and points. Adds to `statistics`.
//
// errors  unsupported_feature  more than kMaxMaterials materials, that of the ground plane included
//         bad_input            with `strict`: vertices that no triangle uses
//         too_large, usage     see grid_choice.h; more than kMaxPoints points
//         memory               more samples than max_hit_bytes hold
Result<Model> build_model(std::vector<Surface> surfaces, const BuildOptions &options, BuildStatistics &statistics,
                          const Progress &progress = {});
Result<Model> build_model(Surface surface, const BuildOptions &options, BuildStatistics &statistics,
                          const Progress &progress = {});

// What errors and reports call an input.
inline std::string name_of(const std::string &input) { return input == "-" ? "standard input" : input; }

// read_surface and place for each input, then build_model. Of several inputs, errors and lines of the report name
// theirs. The panorama (make_panorama) is the caller's.
Result<Model> read_and_build(std::span<const std::string> inputs, const BuildOptions &options,
                             BuildStatistics &statistics, const Progress &progress = {});

// write_model with the options that concern it.
Status write(const std::string &output, const Model &model, const BuildOptions &options, BuildStatistics &statistics,
             const Progress &progress = {});

} // namespace pbm::build
