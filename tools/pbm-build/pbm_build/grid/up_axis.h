// Finds which axis of a scan points up, by what scans have in common: things stand on a base, terrain is flat.
//
// The box that holds all but 1/1000 of the positions beyond each of its sides is divided into cubes, 64 along its
// longest edge; occupied cubes count, however many positions they hold. So the answer depends neither on the order of
// the positions nor on threads. Each axis is tried, with areas of convex hulls seen along it:
//
//   terrain   the height is at most a third of both widths, the cubes fill at least 0.6 of their hull, and no more than
//             two of them stand upon each other in the mean
//   base      the cubes within 1/25 of the height above the lowest ones. Its share is its area over that of all cubes.
//             It counts if the centre of all cubes lies above it. A base at the upper end counts half: its thing stands
//             upside down, and a .pbvg file has no negative up axis.
//
// The axis of a terrain wins; else that with the largest base, if its share is at least 0.3 and those of the other axes
// are at most 2/3 of it. Else nothing is found, and the answer is +Y. Terrain comes first: seen edge-on, each of its
// sides looks like a base.
#pragma once

#include "pbm_build/grid/grid_choice.h"
#include "pbm_scan/surface/surface.h"

#include <array>
#include <string>

namespace pbm::build {

enum class UpReason : std::uint8_t { base, upper_base, terrain, none };

struct FoundUp {
    UpAxis up = UpAxis::y;
    UpReason reason = UpReason::none;
    double share = 0;                // of the base
    std::array<double, 3> weights{}; // of the better base along x, y and z; an upper one counts half

    // Whether the shape contradicts a format that has another axis: it stands on a base of 0.6 or more of its outline,
    // and on nearly none along that axis. Terrain does not contradict: a relief may stand upright.
    bool overrules(UpAxis other) const;
};

// `bounds`: those of the surface.
FoundUp find_up_axis(const Surface &surface, const Bounds &bounds, int threads);

// What was found and why, for the report.
std::string note_of(const FoundUp &found);

} // namespace pbm::build
