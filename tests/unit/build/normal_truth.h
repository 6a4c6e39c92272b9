// Estimated normals of points whose true normals are known.
#pragma once

#include "pbm_build/normals/estimate_normals.h"
#include "unit/support/value_of.h"

#include <glm/trigonometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace pbm::test {

// Points with their true normals.
struct Truth {
    build::Surface points;
    std::vector<glm::dvec3> normals;

    void add(const glm::dvec3 &p, const glm::dvec3 &n) {
        points.positions.push_back(p);
        normals.push_back(n);
    }
};

// Fractions of all points.
struct Score {
    double bent = 0;      // more than 25 degrees from the truth, whatever the sign
    double wrong = 0;     // one-sided, with the wrong sign
    double two_sided = 0; //
    double worst = 0;     // degrees, whatever the sign
};

inline Score score(const std::string &name, const Truth &truth, const build::PointRequest &request = {}) {
    build::Surface points = truth.points;
    build::BuildStatistics statistics;
    const build::VertexNormals found = value_of(build::estimate_normals(points, request, 2, statistics));
    Score score;
    const double share = 1.0 / static_cast<double>(truth.normals.size());
    for (std::size_t i = 0; i < truth.normals.size(); ++i) {
        const build::ShortNormal &n = found.normals[i];
        const glm::dvec3 &t = truth.normals[i];
        const double cosine = (n[0] * t.x + n[1] * t.y + n[2] * t.z) / build::kNormalScale;
        const double degrees = glm::degrees(std::acos(std::min(1.0, std::fabs(cosine))));
        score.bent += degrees > 25 ? share : 0;
        score.worst = std::max(score.worst, degrees);
        if (points.two_sided[i] != 0)
            score.two_sided += share;
        else
            score.wrong += cosine < 0 ? share : 0;
    }
    std::printf("%-36s %8zu points: %6.2f %% off by > 25 degrees, %6.2f %% wrong sign, %6.2f %% two-sided; %s\n",
                name.c_str(), truth.normals.size(), 100 * score.bent, 100 * score.wrong, 100 * score.two_sided,
                statistics.attributes.back().note.c_str());
    return score;
}

} // namespace pbm::test
