#include "pbm_scan/conventions/convention.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pbm::build {
namespace {

struct Rule {
    std::string_view name; // of a format, or an extension
    UpAxis up;
    bool is_firm;
    Unit unit;
    const char *reason;
};
constexpr std::array<Rule, 6> kRules{{{"gltf", UpAxis::y, false, Unit::metre, "as glTF has it"},
                                      {"e57", UpAxis::z, true, Unit::metre, "as E57 has it"},
                                      {"ptx", UpAxis::z, true, Unit::metre, "as PTX has it"},
                                      {".pts", UpAxis::z, true, Unit::metre, "as PTS has it"},
                                      {"las", UpAxis::z, true, Unit::unknown, "as LAS has it"},
                                      {"spz", UpAxis::y, false, Unit::unknown, "as SPZ has it"}}};

// Whether x and y are far from zero beside their extent, and z is not, as eastings, northings and heights are.
bool is_like_map(const Surface &surface) {
    constexpr double kMinDistance = 1e5, kMaxHeight = 1e4, kMinRatio = 10;
    if (surface.positions.empty() || std::abs(surface.positions.front().x) < kMinDistance)
        return false;
    glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-low);
    for (const glm::dvec3 &p : surface.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    const auto is_far = [&](int axis) {
        const double nearest = std::min(std::abs(low[axis]), std::abs(high[axis]));
        return low[axis] * high[axis] > 0 && nearest >= kMinDistance && nearest >= kMinRatio * (high[axis] - low[axis]);
    };
    return is_far(0) && is_far(1) && std::max(std::abs(low.z), std::abs(high.z)) <= kMaxHeight;
}

} // namespace

void apply_crs(const CrsFacts &facts, Convention &convention) {
    if (facts.kind == CrsKind::projected || facts.kind == CrsKind::geographic) {
        convention.up = UpAxis::z;
        convention.is_firm = true;
        convention.up_reason = "the coordinate reference system";
    }
    convention.is_geographic = facts.kind == CrsKind::geographic;
    if (facts.height_metres > 0)
        convention.height_metres = facts.height_metres;
    if (facts.metres <= 0)
        return;
    convention.unit = unit_of_metres(facts.metres);
    convention.unit_reason = "the coordinate reference system has " + unit_name(facts.metres);
    if (facts.height_metres > 0 && facts.height_metres != facts.metres)
        convention.unit_reason += ", but heights in " + unit_name(facts.height_metres);
}

void apply_convention(std::string_view format, std::string_view extension, Surface &surface) {
    Convention &convention = surface.convention;
    if (!surface.crs.empty() && convention.up_reason.empty() && convention.unit_reason.empty())
        apply_crs(facts_of(surface.crs), convention);
    const auto *const rule = std::find_if(kRules.begin(), kRules.end(), [&](const Rule &each) {
        return each.name == format || (!extension.empty() && each.name == extension);
    });
    if (rule != kRules.end() && rule->unit != Unit::unknown) {
        convention.unit = rule->unit;
        convention.unit_reason = rule->reason;
        convention.is_geographic = false;
    }
    if (rule != kRules.end() && !convention.up) {
        convention.up = rule->up;
        convention.is_firm = rule->is_firm;
        convention.up_reason = rule->reason;
    }
    if (!(convention.up && convention.is_firm) && is_like_map(surface)) {
        convention.up = UpAxis::z;
        convention.is_firm = true;
        convention.up_reason = "x and y are like those of a map";
    }
}

Convention common_convention(std::span<const Surface> surfaces) {
    Convention common;
    bool is_first = true;
    for (const Surface &surface : surfaces) {
        if (surface.positions.empty())
            continue;
        const Convention &own = surface.convention;
        if (std::exchange(is_first, false)) {
            common = own;
            continue;
        }
        if (own.up != common.up)
            common.up.reset();
        common.is_firm = common.is_firm && own.is_firm;
        if (own.unit != common.unit)
            common.unit_reason.clear();
    }
    return common;
}

} // namespace pbm::build
