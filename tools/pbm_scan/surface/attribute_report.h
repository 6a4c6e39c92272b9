// The report of a build: a line for each attribute of a scan, and names for the kinds of lines that options can refuse.
// Stability: stable.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstdint>
#include <string>
#include <string_view>

namespace pbm::build {

// The fate of one attribute of the input file.
enum class Fate : std::uint8_t { kept, converted, dropped, estimated };

// Kinds of report lines, and of other problems that do not end a build. --deny and --allow take their names.
enum class Warning : std::uint8_t {
    none,
    dropped_attribute,
    idle_option,
    loose_vertices,
    missing_image,
    replaced_attribute,
    small_parts,
    stray_points,
    trailing_bytes,
    unusable_geometry,
    coordinate_steps,
    default_up_axis,
    inward_faces,
    one_sided_sheets,
    kept_outliers,
    open_end,
    coarser_grid,
    far_coordinates,
    guessed_columns,
    repeated_points,
    turned_faces,
    turned_normals,
    default_lights,
    estimated_normals,
    estimated_up_axis,
    filled_holes,
    finer_grid,
    made_points,
    cache_not_filled,
    left_out,
    stale_model,
};

struct WarningEntry {
    std::string_view name; // permanent
    Fate fate;             // of its lines; `dropped` ones are printed as warnings, all are in the report
    std::string_view help;
    std::string_view remedy; // how to change the command or the scan so that the line disappears
    bool is_deniable = true; // false: it is no line of the report of a scan
};

// In the order of Warning.
inline constexpr std::array kWarnings = std::to_array<WarningEntry>({
    {"", Fate::kept, "", ""},
    {"dropped-attribute", Fate::dropped, "A model has no place for this part of the scan, or its values are unusable.",
     "Remove it from the scan."},
    {"idle-option", Fate::dropped, "An option found nothing to work on.", "Leave the option out."},
    {"loose-vertices", Fate::dropped, "Vertices of a mesh belong to no face.", "Remove them from the scan."},
    {"missing-image", Fate::dropped, "An image of the scan is not there, or cannot be read.",
     "Put the image beside the scan."},
    {"replaced-attribute", Fate::dropped, "--ignore-point-colours leaves colours or materials of the scan out.",
     "Leave --ignore-point-colours out."},
    {"small-parts", Fate::dropped, "--drop-parts leaves small parts of the mesh out.", "Leave --drop-parts out."},
    {"stray-points", Fate::dropped, "Points or faces lie far from all others.", "Remove them from the scan."},
    {"trailing-bytes", Fate::dropped, "There are bytes behind the end of the scan.", "Export the scan again."},
    {"unusable-geometry", Fate::dropped,
     "Vertices have coordinates that are not finite, or corners of triangles coincide.", "Repair the mesh."},
    {"coordinate-steps", Fate::kept, "The steps between coordinates of the scan are larger than a voxel.",
     "Export coordinates with more digits, or choose a smaller --depth."},
    {"default-up-axis", Fate::kept, "Neither --up nor the shape of the scan says which axis points up: y is taken.",
     "Give --up."},
    {"inward-faces", Fate::kept, "The faces of a closed mesh point inwards.",
     "Give --flip-faces, or leave --no-orient-faces out."},
    {"one-sided-sheets", Fate::kept, "A sheet of faces has one side only, like a Moebius strip.", "Repair the mesh."},
    {"kept-outliers", Fate::kept, "Points or faces lie far from all others, and may belong to the scan.",
     "Remove them from the scan."},
    {"open-end", Fate::kept, "The last line of a text has no end: it may have been cut off.", "Export the scan again."},
    {"coarser-grid", Fate::converted, "The depth that fits the scan needs too much memory: a smaller one is taken.",
     "Give --depth, or a larger --max-memory."},
    {"far-coordinates", Fate::converted, "The scan lies so far from its origin that voxels cannot be finer.",
     "Give --origin."},
    {"guessed-columns", Fate::converted, "A table does not name its columns: their numbers say what they may be.",
     "Give --columns, or a first line with their names."},
    {"repeated-points", Fate::converted, "Half of the points or more lie where others lie.",
     "Remove copies from the scan."},
    {"turned-faces", Fate::converted, "Faces looked inwards, or were wound against those around them: they are turned.",
     "Repair the mesh, or give --no-orient-faces."},
    {"turned-normals", Fate::converted, "Normals contradict the faces of a closed mesh, or of one with two windings.",
     "Repair the normals, or give --no-orient-faces."},
    {"default-lights", Fate::estimated, "Shadows or a ground plane need lights, and none are given.",
     "Give --lights or --light."},
    {"estimated-normals", Fate::estimated, "Points have no normals: their neighbours give them.",
     "Export the scan with normals."},
    {"estimated-up-axis", Fate::estimated, "--up does not say which axis points up: the shape of the scan decides.",
     "Give --up."},
    {"filled-holes", Fate::estimated, "--fill-holes made faces that the scan does not have.",
     "Leave --fill-holes out."},
    {"finer-grid", Fate::estimated, "Normals or images of the scan ask for a greater depth than its edges do.",
     "Give --depth."},
    {"made-points", Fate::estimated, "--upsample made points that the scan does not have.", "Leave --upsample out."},
    {"cache-not-filled", Fate::kept, "The model is built, but could not be stored in the cache.",
     "Make room in the folder of --cache.", false},
    {"left-out", Fate::kept, "A folder of --batch holds scans of kinds that are not read, linked folders, or pipes.",
     "Convert or move them, or name the scans in a list; --strict makes it an error.", false},
    {"stale-model", Fate::kept, "The folder of a batch holds models that none of its scans becomes.",
     "Remove them, or give each batch a folder of its own.", false},
});
static_assert(kWarnings.size() == static_cast<std::size_t>(Warning::stale_model) + 1);

using WarningSet = std::bitset<kWarnings.size()>;

inline const WarningEntry &entry_of(Warning warning) { return kWarnings[static_cast<std::size_t>(warning)]; }
inline bool contains(const WarningSet &set, Warning warning) { return set[static_cast<std::size_t>(warning)]; }

// Warning::none if there is no such name.
inline Warning find_warning(std::string_view name) {
    const auto found =
        std::find_if(kWarnings.begin(), kWarnings.end(), [&](const WarningEntry &entry) { return entry.name == name; });
    return found == kWarnings.end() ? Warning::none : static_cast<Warning>(found - kWarnings.begin());
}

struct AttributeReport {
    using Fate = build::Fate;
    std::string name; // as the input names it, e.g. "vertex.confidence"
    Fate fate = Fate::kept;
    std::string note;                // its conversion, or the reason for its drop
    std::string input{};             // which of several inputs; empty where there is only one
    Warning warning = Warning::none; // see warning_of
};

// A line of this kind.
inline AttributeReport line_of(Warning warning, std::string name, std::string note, std::string input = {}) {
    return {std::move(name), entry_of(warning).fate, std::move(note), std::move(input), warning};
}

// The kind of a line. A `dropped` line without a kind of its own is a dropped attribute.
inline Warning warning_of(const AttributeReport &line) {
    return line.warning == Warning::none && line.fate == Fate::dropped ? Warning::dropped_attribute : line.warning;
}

} // namespace pbm::build
