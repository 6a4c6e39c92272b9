#include "pbm_build/normals/orient_normals.h"

#include "pbm_build/neighbours/outliers.h"
#include "pbm_build/normals/reconsider_signs.h"
#include "pbm_build/surface/parity_sets.h"
#include "system/free_memory.h"
#include "system/threads/parallel.h"

#include <glm/gtc/type_precision.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr int kStrong = 128;      // minimum |vote| of a link in the spanning tree
constexpr double kClosed = 0.25;  // minimum net share of the views of a closed piece that agree on one side
constexpr double kHidden = 0.005; // minimum views per point of a closed piece: fewer pass through gaps
constexpr double kFacing = 0.5;   // minimum length of the mean normal of a sheet along the axis that it faces

bool is_given_at(const Bytes &is_given, std::size_t point) { return !is_given.empty() && is_given[point] != 0; }

ShortNormal negated(const ShortNormal &n) {
    return {static_cast<std::int16_t>(-n[0]), static_cast<std::int16_t>(-n[1]), static_cast<std::int16_t>(-n[2])};
}

// The vote compares one normal with the mirror image of the other in the bisecting plane: they are equal for two points
// of an arc. Links out of the tangent planes get a low weight.
Vote vote_between(const LatticePoint &p, const ShortNormal &at_p, const LatticePoint &q, const ShortNormal &at_q) {
    const glm::dvec3 e = glm::dvec3(q - p);
    const double squared = (e.x * e.x + e.y * e.y) + e.z * e.z;
    constexpr double kUnit = 1 / (kNormalScale * kNormalScale);
    const double cosine = static_cast<double>(dot(at_p, at_q)) * kUnit;
    if (!(squared > 0))
        return static_cast<Vote>(cosine * kSure);
    const double rise_p = (e.x * at_p[0] + e.y * at_p[1]) + e.z * at_p[2];
    const double rise_q = (e.x * at_q[0] + e.y * at_q[1]) + e.z * at_q[2];
    const double mirrored = cosine - 2 * rise_p * rise_q / squared * kUnit;
    const double steepest = std::min(1.0, std::max(rise_p * rise_p, rise_q * rise_q) / squared * kUnit);
    return static_cast<Vote>(std::clamp(mirrored * (1 - steepest), -1.0, 1.0) * kSure);
}

std::vector<Vote> votes_of_links(const std::vector<LatticePoint> &points, const PlaneFits &fits, int threads) {
    std::vector<Vote> votes(points.size() * kLinks);
    parallel_for(points.size(), kBlock, threads, [&](std::size_t i) {
        for (std::size_t link = i * kLinks; link < (i + 1) * kLinks; ++link) {
            const std::size_t j = fits.links.nearest[link];
            if (i != j)
                votes[link] = vote_between(points[std::min(i, j)], fits.normals[std::min(i, j)], points[std::max(i, j)],
                                           fits.normals[std::max(i, j)]);
        }
    });
    return votes;
}

// [points] bit k: link k is of high confidence, and the first of two if both ends name each other.
Bytes sure_links(const PointLinks &links, const std::vector<Vote> &votes, int threads) {
    Bytes sure(links.spacing.size());
    parallel_for(sure.size(), kBlock, threads, [&](std::size_t i) {
        int bits = 0;
        for (std::size_t k = 0; k < kLinks; ++k) {
            if (std::abs(votes[i * kLinks + k]) < kStrong)
                continue;
            const std::size_t to = links.nearest[i * kLinks + k];
            int named = 0; // by the other end
            for (std::size_t back = to * kLinks; i > to && back < (to + 1) * kLinks; ++back)
                named |= links.nearest[back] == i ? 1 : 0;
            if (named == 0)
                bits |= 1 << k;
        }
        sure[i] = static_cast<std::uint8_t>(bits);
    });
    return sure;
}

// Joins the links of high confidence to a spanning forest: Kruskal's algorithm, highest |vote| first, ties by index.
void join_along_sure_links(const PointLinks &links, const std::vector<Vote> &votes, int threads, ParitySets &sets) {
    const Bytes sure = sure_links(links, votes, threads);
    const auto for_sure_links = [&](const auto &work) { // (from, link, rank)
        for (std::size_t i = 0; i < sure.size(); ++i)
            for (unsigned bits = sure[i]; bits != 0; bits &= bits - 1) {
                const std::size_t link = i * kLinks + static_cast<std::size_t>(std::countr_zero(bits));
                work(i, link, static_cast<std::size_t>(kSure - std::abs(votes[link])));
            }
    };
    std::array<std::size_t, kSure - kStrong + 2> place{}; // of the links of a rank; counted one behind
    for_sure_links([&](std::size_t, std::size_t, std::size_t rank) { ++place[rank + 1]; });
    std::partial_sum(place.begin(), place.end(), place.begin());
    std::vector<std::uint64_t> order(place.back()); // from << 32 | to << 1 | opposite: at most 2^31 points
    for_sure_links([&](std::size_t from, std::size_t link, std::size_t rank) {
        order[place[rank]++] =
            std::uint64_t{from} << 32 | std::uint64_t{links.nearest[link]} << 1 | (votes[link] < 0 ? 1 : 0);
    });
    for (const std::uint64_t link : order)
        sets.join(static_cast<std::uint32_t>(link >> 32), static_cast<std::uint32_t>(link) >> 1, (link & 1) != 0);
}

// Connected points with consistent normals, and their visibility from outside. The root of a patch is its lowest point.
struct Patches {
    ParitySets sets;
    std::vector<std::int64_t> towards, seen; // [points] at roots: sums of outside_view.h, in the unit of votes

    bool join(std::uint32_t a, std::uint32_t b, bool opposite) {
        const auto p = sets.find(a), q = sets.find(b);
        if (!sets.join(a, b, opposite))
            return false;
        const auto [low, high] = std::minmax(p.root, q.root);
        const bool turned = (p.opposite != q.opposite) != opposite;
        towards[low] += turned ? -towards[high] : towards[high];
        seen[low] += seen[high];
        return true;
    }
};

// The sum of all links between two patches.
struct PatchLink {
    std::uint32_t low, high;   // roots
    std::int64_t votes;        // positive: same sign
    std::int64_t evidence = 0; // votes, and visibility from outside
};

std::vector<PatchLink> merged(std::vector<PatchLink> links) {
    const auto pair = [](const PatchLink &l) { return std::uint64_t{l.low} << 32 | l.high; };
    std::sort(links.begin(), links.end(), [&](const PatchLink &a, const PatchLink &b) { return pair(a) < pair(b); });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < links.size(); ++i)
        if (kept > 0 && pair(links[i]) == pair(links[kept - 1]))
            links[kept - 1].votes += links[i].votes;
        else
            links[kept++] = links[i];
    links.resize(kept);
    std::erase_if(links, [](const PatchLink &l) { return l.votes == 0; });
    return links;
}

// The link between the patches of two points; no votes within one patch.
PatchLink between_roots(ParitySets &sets, std::uint32_t a, std::uint32_t b, std::int64_t votes) {
    const auto p = sets.find(a), q = sets.find(b);
    const std::int64_t turned = p.opposite != q.opposite ? -votes : votes;
    return {std::min(p.root, q.root), std::max(p.root, q.root), p.root == q.root ? 0 : turned};
}

// Votes, plus half of the visibility gained by equal signs over opposite ones: (|a + b| - |a - b|) / 2.
std::int64_t evidence(const Patches &patches, const PatchLink &link) {
    const std::int64_t a = patches.towards[link.low], b = patches.towards[link.high];
    return link.votes + (std::abs(a + b) - std::abs(a - b)) / 2;
}

bool surer(const PatchLink &a, const PatchLink &b) {
    const std::int64_t p = std::abs(a.evidence), q = std::abs(b.evidence);
    return p != q ? p > q : a.low != b.low ? a.low < b.low : a.high < b.high;
}

// The surest link of each patch.
std::vector<PatchLink> surest_links(const std::vector<PatchLink> &links) {
    std::vector<std::pair<std::uint32_t, std::size_t>> ends; // patch, link
    for (std::size_t i = 0; i < links.size(); ++i) {
        ends.emplace_back(links[i].low, i);
        ends.emplace_back(links[i].high, i);
    }
    std::sort(ends.begin(), ends.end(), [&](const auto &a, const auto &b) {
        return a.first != b.first ? a.first < b.first : surer(links[a.second], links[b.second]);
    });
    std::vector<PatchLink> surest;
    for (std::size_t i = 0; i < ends.size(); ++i)
        if (i == 0 || ends[i].first != ends[i - 1].first)
            surest.push_back(links[ends[i].second]);
    std::sort(surest.begin(), surest.end(), surer);
    return surest;
}

// Joins each patch along its link of highest evidence until no links remain. The votes between two patches are summed,
// so that a few wrong links do not matter. Based on: Borůvka's algorithm
void join_patches(const PointLinks &links, const std::vector<Vote> &votes, Patches &patches) {
    std::vector<PatchLink> open;
    for (std::size_t link = 0; link < votes.size(); ++link) {
        const auto from = static_cast<std::uint32_t>(link / kLinks), to = links.nearest[link];
        if (votes[link] == 0 || patches.sets.share_parent(from, to))
            continue;
        if (const PatchLink l = between_roots(patches.sets, from, to, votes[link]); l.votes != 0)
            open.push_back(l);
    }
    for (open = merged(std::move(open)); !open.empty(); open = merged(std::move(open))) {
        for (PatchLink &l : open)
            l.evidence = evidence(patches, l);
        for (const PatchLink &l : surest_links(open)) {
            PatchLink now = between_roots(patches.sets, l.low, l.high, l.votes);
            if (now.votes != 0)
                patches.join(now.low, now.high, evidence(patches, now) < 0);
        }
        for (PatchLink &l : open)
            l = between_roots(patches.sets, l.low, l.high, l.votes);
    }
}

struct Turned {
    std::vector<std::uint32_t> roots; // [points]
    std::vector<ShortNormal> normals; // [points] with signs relative to their roots
};

Turned turned_to_roots(ParitySets &sets, const std::vector<ShortNormal> &normals) {
    Turned turned{std::vector<std::uint32_t>(normals.size()), normals};
    for (std::size_t i = 0; i < normals.size(); ++i) {
        const auto place = sets.find(static_cast<std::uint32_t>(i));
        turned.roots[i] = place.root;
        if (place.opposite)
            turned.normals[i] = negated(normals[i]);
    }
    return turned;
}

// Replaces the root of each point by the number of its piece. Returns the roots: [pieces]. A root is the lowest point
// of its piece.
std::vector<std::uint32_t> number_pieces(std::vector<std::uint32_t> &roots) {
    std::vector<std::uint32_t> pieces;
    for (std::uint32_t i = 0; i < roots.size(); ++i)
        if (roots[i] == i) {
            roots[i] = static_cast<std::uint32_t>(pieces.size());
            pieces.push_back(i);
        } else {
            roots[i] = roots[roots[i]];
        }
    return pieces;
}

OutsideView look_from_outside(const std::vector<LatticePoint> &points, const PlaneFits &fits, Patches &patches,
                              int threads) {
    const Turned turned = turned_to_roots(patches.sets, fits.normals);
    const double spacing = std::max(1.0, static_cast<double>(median_of(fits.links.spacing)));
    OutsideView view = view_from_outside(points, turned.normals, spacing, threads);
    for (std::size_t i = 0; i < points.size(); ++i) {
        patches.towards[turned.roots[i]] += view.towards[i];
        patches.seen[turned.roots[i]] += view.seen[i];
    }
    constexpr std::int64_t kToVotes = 128;
    for (std::size_t i = 0; i < points.size(); ++i) {
        patches.towards[i] /= kToVotes;
        patches.seen[i] /= kToVotes;
    }
    for (std::size_t i = 0; i < points.size(); ++i)
        if (turned.normals[i] != fits.normals[i])
            view.towards[i] = -view.towards[i]; // back to the normals as they are
    return view;
}

enum class Side : std::uint8_t { as_is, opposite, unknown };

// Whether a piece of `points` points is mostly closed, so that it is visible from one side.
bool is_closed(std::int64_t towards, std::int64_t seen, std::int64_t points) {
    return static_cast<double>(seen) > kHidden * kSure * static_cast<double>(points) &&
           std::fabs(static_cast<double>(towards)) > kClosed * static_cast<double>(seen);
}

// The side that a sheet of `points` points faces.
Side side_of_sheet(const glm::i64vec3 &normal_sum, std::int64_t points, UpAxis up) {
    const double flat = kFacing * kNormalScale * static_cast<double>(points);
    for (const int axis : {up == UpAxis::x ? 0 : up == UpAxis::y ? 1 : 2, 2})
        if (std::fabs(static_cast<double>(normal_sum[axis])) > flat)
            return normal_sum[axis] > 0 ? Side::as_is : Side::opposite;
    return Side::unknown;
}

// Converts evidence about the original normals to evidence about the oriented ones: `flipped` ([points], 1: negated).
void turn_evidence(const PointLinks &links, const Bytes &flipped, SignEvidence &evidence) {
    for (std::size_t link = 0; link < evidence.votes.size(); ++link)
        if (flipped[link / kLinks] != flipped[links.nearest[link]])
            evidence.votes[link] = static_cast<Vote>(-evidence.votes[link]);
    for (std::size_t i = 0; i < evidence.view.towards.size(); ++i)
        if (flipped[i] != 0)
            evidence.view.towards[i] = -evidence.view.towards[i];
}

} // namespace

Orientation orient_normals(const std::vector<LatticePoint> &points, PlaneFits &fits, const Bytes &is_given, UpAxis up,
                           int threads) {
    const std::size_t count = points.size();
    Patches patches{ParitySets(count), std::vector<std::int64_t>(count), std::vector<std::int64_t>(count)};
    std::size_t first_given = count;
    for (std::size_t i = 0; i < count; ++i)
        if (is_given_at(is_given, i)) {
            first_given = std::min(first_given, i);
            patches.sets.join(static_cast<std::uint32_t>(first_given), static_cast<std::uint32_t>(i), false);
        }
    std::vector<Vote> votes = votes_of_links(points, fits, threads);
    join_along_sure_links(fits.links, votes, threads, patches.sets);
    OutsideView view;
    if (is_given.empty())
        view = look_from_outside(points, fits, patches, threads);
    join_patches(fits.links, votes, patches);

    Turned turned = turned_to_roots(patches.sets, fits.normals);
    const std::vector<std::uint32_t> roots = number_pieces(turned.roots); // [pieces]
    const std::vector<std::uint32_t> &piece_of = turned.roots;
    std::vector<glm::i64vec3> normal_sums(roots.size(), glm::i64vec3(0));
    std::vector<std::int64_t> sizes(roots.size());
    for (std::size_t i = 0; i < count; ++i) {
        sizes[piece_of[i]] += 1;
        const ShortNormal &n = turned.normals[i];
        normal_sums[piece_of[i]] += glm::i64vec3(n[0], n[1], n[2]);
    }
    std::vector<Side> sides(roots.size(), Side::unknown);
    std::vector<bool> closed(roots.size());
    Orientation result{Bytes(count), 0, false};
    for (std::size_t piece = 0; piece < roots.size(); ++piece) {
        const std::uint32_t root = roots[piece];
        closed[piece] = is_closed(patches.towards[root], patches.seen[root], sizes[piece]);
        sides[piece] = !closed[piece]              ? side_of_sheet(normal_sums[piece], sizes[piece], up)
                       : patches.towards[root] > 0 ? Side::as_is
                                                   : Side::opposite;
        result.pieces += is_zero(turned.normals[root]) ? 0 : 1;
    }
    if (first_given < count)
        sides[piece_of[first_given]] =
            patches.sets.find(static_cast<std::uint32_t>(first_given)).opposite ? Side::opposite : Side::as_is;
    Bytes flipped(count);
    SignEvidence evidence{std::move(votes), std::move(view), Bytes(count), is_given};
    for (std::size_t i = 0; i < count; ++i) {
        const Side side = sides[piece_of[i]];
        const ShortNormal normal = side == Side::opposite ? negated(turned.normals[i]) : turned.normals[i];
        flipped[i] = normal != fits.normals[i] ? 1 : 0;
        fits.normals[i] = normal;
        evidence.has_outside[i] = closed[piece_of[i]] ? 1 : 0;
        result.two_sided[i] = side == Side::unknown ? 1 : 0;
    }
    free_memory(patches.towards);
    free_memory(patches.seen);
    free_memory(turned.roots);
    free_memory(turned.normals);
    result.of_body = looks_like_body(evidence.view);
    turn_evidence(fits.links, flipped, evidence);
    const std::vector<Verdict> verdicts = reconsider_signs(fits, evidence, threads);
    for (std::size_t i = 0; i < count; ++i) {
        if (verdicts[i] == Verdict::turn)
            fits.normals[i] = negated(fits.normals[i]);
        if (verdicts[i] == Verdict::unknown)
            result.two_sided[i] = 1;
        if (is_given_at(is_given, i))
            result.two_sided[i] = 0;
    }
    return result;
}

void face_scanner(std::vector<ShortNormal> &normals, const Bytes &is_given,
                  const std::function<glm::dvec3(std::size_t point)> &sight) {
    for (std::size_t i = 0; i < normals.size(); ++i) {
        if (is_given_at(is_given, i))
            continue;
        const glm::dvec3 to_scanner = sight(i);
        const ShortNormal &n = normals[i];
        if ((to_scanner.x * n[0] + to_scanner.y * n[1]) + to_scanner.z * n[2] < 0)
            normals[i] = negated(n);
    }
}

} // namespace pbm::build
