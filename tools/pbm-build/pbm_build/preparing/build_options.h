// What is asked of a build.
#pragma once

#include "pbm_build/fields/field_choice.h"
#include "pbm_build/grid/grid_choice.h"
#include "pbm_build/mesh_repair/repair_mesh.h"
#include "pbm_build/normals/estimate_normals.h"
#include "pbm_build/preparing/placement.h"
#include "pbm_build/scene/scene.h"
#include "pbm_format/model/model.h"
#include "pbm_format/writing/writer.h"
#include "pbm_scan/surface/surface.h"

#include <bitset>
#include <optional>
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
    std::vector<std::string> dropped_fields{};     // of usual_fields(): not kept
    std::bitset<256> dropped_classes{};            // points with these classes are left out
    bool is_geographic = false;                    // x and y of the inputs are degrees
    double min_opacity = 0.2;                      // 0..1: fainter Gaussian splats are left out
    bool keep_placeholders = false;                // keep points that stand for no measurement
    std::optional<double> crease_angle;            // degrees, 0..180; creases.h
    std::vector<std::array<double, 3>> viewpoints; // estimated normals face them; model units. One for all, or one for
                                                   // each surface in their order; empty: the stations of the surfaces
    Outliers outliers = Outliers::drop_strays;     // and far parts; kept with a grid that is given
    std::optional<double> alpha_cutoff;            // image_holes.h
    bool flip_green = false;                       // the green of normal maps points downwards
    std::optional<int> upsample;                   // largest gap, voxels; upsample.h
    bool strict = false;                           // refuse the input instead of dropping any of it
    WarningSet denied{};                           // refuse the input where its report has a line of these kinds
    int threads = 0;                               // 0: one per processor
    std::uint64_t max_samples = std::uint64_t{1} << 31; // pairs of a voxel and a triangle or point
};

} // namespace pbm::build
