// The whole walk from a scan to a .pbvg file.
//
//   read_surface -> place -> set_materials -> repair_mesh -> choose_creases -> merge_surfaces -> drop_far_parts ->
//   find_up_axis
//   -> estimate_normals -> choose_grid -> upsample -> sample_points -> voxelize -> choose_radii -> place_scene ->
//   evaluate_solid_texture -> bake_shadows -> set_levels -> write_model
#pragma once

#include "pbm_build/parts/part.h"
#include "pbm_build/preparing/build_options.h"
#include "pbm_build/report/build_statistics.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// Builds a model with all levels, without panorama, from surfaces in the model's coordinates. The result does not
// depend on the number of threads, nor on the order of surfaces, vertices, triangles and points. Adds to `statistics`.
//
// errors  unsupported_feature  more than kMaxMaterials materials, that of the ground plane included
//         bad_input            with `strict`: vertices that no triangle uses; a line of a kind that is denied
//         too_large, usage     see grid_choice.h; more than kMaxPoints points
//         memory               more samples than max_samples, or too many made points
Result<Model> build_model(std::vector<Surface> surfaces, const BuildOptions &options, BuildStatistics &statistics,
                          const Progress &progress = {});

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
