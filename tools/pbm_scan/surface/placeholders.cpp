#include "pbm_scan/surface/placeholders.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pbm::build {
namespace {

// Distance from the box of the other points, in which it is so many times its diagonal, makes a placeholder.
constexpr double kFarDiagonals = 1;

bool has_sentinel(const glm::dvec3 &p) {
    constexpr double kLimit = static_cast<double>(std::numeric_limits<float>::max());
    static constexpr std::array<double, 6> kSentinels{-9999, -99999, 1e10, -1e10, kLimit, -kLimit};
    const auto is_sentinel = [](double value) {
        return std::find(kSentinels.begin(), kSentinels.end(), value) != kSentinels.end();
    };
    return may_be_placeholder(p) && (is_sentinel(p.x) || is_sentinel(p.y) || is_sentinel(p.z));
}

struct Box {
    glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-low};

    bool is_far(const glm::dvec3 &p) const {
        const double diagonal = glm::distance(low, high);
        return glm::distance(p, glm::clamp(p, low, high)) > kFarDiagonals * diagonal;
    }
};

// Whether the origin is there far more often than other positions are.
bool are_more_than_copies(std::span<const glm::dvec3> positions, std::size_t at_zero) {
    constexpr std::size_t kMinCount = 16, kMinShare = 2000, kSamples = 64, kTimes = 4;
    if (at_zero < kMinCount || at_zero * kMinShare < positions.size())
        return false;
    std::vector<glm::dvec3> samples;
    for (std::size_t i = 0; i < kSamples; ++i)
        if (const glm::dvec3 &p = positions[i * (positions.size() - 1) / (kSamples - 1)]; p != glm::dvec3(0))
            samples.push_back(p);
    if (samples.empty())
        return false;
    const auto before = [](const glm::dvec3 &a, const glm::dvec3 &b) {
        return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
    };
    std::sort(samples.begin(), samples.end(), before);
    samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
    std::vector<std::size_t> counts(samples.size());
    for (const glm::dvec3 &p : positions)
        if (const auto at = std::lower_bound(samples.begin(), samples.end(), p, before);
            at != samples.end() && *at == p)
            ++counts[static_cast<std::size_t>(at - samples.begin())];
    const auto middle = counts.begin() + static_cast<std::ptrdiff_t>(counts.size() / 2);
    std::nth_element(counts.begin(), middle, counts.end());
    return at_zero > kTimes * *middle;
}

} // namespace

std::string Placeholders::note() const {
    const auto points = [](std::size_t count) { return std::to_string(count) + (count == 1 ? " point" : " points"); };
    std::string note = at_zero != 0 ? points(at_zero) + " at 0 0 0" : "";
    if (at_sentinels != 0)
        note += (at_zero != 0 ? " and " : "") + points(at_sentinels) + " with a value such as -9999";
    return note + ", which stand for no measurement, left out; --keep-placeholders keeps them";
}

std::vector<std::uint8_t> mark_placeholders(std::span<const glm::dvec3> positions, std::size_t first,
                                            Placeholders &found) {
    found = {};
    const std::span<const glm::dvec3> points = positions.subspan(first);
    constexpr std::size_t kMinOthers = 16; // fewer have no box that says anything
    Box rest;
    std::size_t zeros = 0, sentinels = 0;
    for (const glm::dvec3 &p : points) {
        if (p == glm::dvec3(0)) {
            ++zeros;
        } else if (has_sentinel(p)) {
            ++sentinels;
        } else {
            rest.low = glm::min(rest.low, p);
            rest.high = glm::max(rest.high, p);
        }
    }
    if (zeros + sentinels == 0 || points.size() - zeros - sentinels < kMinOthers)
        return {};
    const bool zeros_stand_for_nothing =
        zeros != 0 && (rest.is_far(glm::dvec3(0)) || are_more_than_copies(points, zeros));
    std::vector<std::uint8_t> marks(positions.size());
    for (std::size_t i = first; i < positions.size(); ++i) {
        const glm::dvec3 &p = positions[i];
        if (p == glm::dvec3(0) && zeros_stand_for_nothing)
            found.at_zero += marks[i] = 1;
        else if (sentinels != 0 && has_sentinel(p) && rest.is_far(p))
            found.at_sentinels += marks[i] = 1;
    }
    return found.sum() != 0 ? marks : std::vector<std::uint8_t>();
}

} // namespace pbm::build
