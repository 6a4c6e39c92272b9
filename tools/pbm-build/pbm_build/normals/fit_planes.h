// Fits a plane to the neighbours of each point: normals of unknown sign, which orient_normals.h orients.
// Based on: Hoppe, DeRose, Duchamp, McDonald, Stuetzle. Surface Reconstruction from Unorganized Points. 1992
#pragma once

#include "pbm_build/neighbourhoods/neighbourhoods.h"
#include "pbm_build/neighbours/neighbours.h"
#include "pbm_build/normals/plane_columns.h"
#include "system/bytes.h"

namespace pbm::build {

struct PointLinks {
    std::vector<std::uint32_t> nearest; // [points][kLinks] nearest first; the point itself where there are fewer
    std::vector<float> spacing;         // [points] mean distance to them in lattice steps; 0 where there is none
};

struct PlaneFits {
    PointLinks links;
    std::vector<ShortNormal> normals; // [points] of either sign; zero: the neighbours lie on a line
    std::vector<Spread> spreads;      // [points]
    Bytes at_border; // [points] 1: no neighbour within an angle of 150 degrees, as at borders and on curves
};

// Least-squares planes, weighted by distance. Where the nearest few neighbours do not lie on a plane, more are used if
// they fit better: noise needs many points, edges and thin walls few. A border is a gap between the directions of the
// nearest few in that plane.
// Based on: Demantké, Mallet, David, Vallet. Dimensionality Based Scale Selection in 3D Lidar Point Clouds. 2011
//           Bendels, Schnabel, Klein. Detecting Holes in Point Set Surfaces. 2006 (the angle criterion)
PlaneFits fit_planes(const PointNeighbours &neighbours, int threads);

} // namespace pbm::build
