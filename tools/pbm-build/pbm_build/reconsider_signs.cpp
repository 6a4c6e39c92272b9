#include "pbm_build/reconsider_signs.h"

#include "pbm_build/parity_sets.h"
#include "pbm_format/parallel.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 4096;
constexpr int kSweeps = 20;           // doubt spreads over about as many points
constexpr double kViewWeight = 0.06;  // of a view, against a sure link
constexpr float kBorderWeight = 1.1F; // of not knowing at a border, against a sure link
constexpr float kFixed = 1e6F;        // weight of what is given
constexpr float kDoubt = 0.1F;        // margin below which a sign is not known
constexpr int kFirm = 200;            // of the links that hold a part together
constexpr std::int64_t kFew = 20;     // points: a smaller part is as sure as its neighbours say
constexpr double kHidden = 1.5;       // views of a point, on average: below, most of a part is hidden
constexpr double kOneSide = 0.25;     // net share of what is seen of a part
constexpr double kGlimpse = 0.5;      // views of a point: fewer are chance
constexpr double kBehind = 0.5;       // net share of what is seen of a point

// What speaks for the sign of a point besides its neighbours. What is seen from both sides says nothing.
struct Anchor {
    float sign = 0, weight = 0; // |sign| <= weight
};

std::vector<Anchor> anchors_of(const PlaneFits &fits, const SignEvidence &evidence) {
    std::vector<Anchor> anchors(fits.normals.size());
    for (std::size_t i = 0; i < anchors.size(); ++i)
        if (!evidence.is_given.empty() && evidence.is_given[i] != 0) {
            anchors[i] = {kFixed, kFixed};
        } else if (evidence.has_outside[i] != 0) {
            anchors[i].sign = static_cast<float>(kViewWeight / kNormalScale * evidence.view.towards[i]);
            anchors[i].weight = std::fabs(anchors[i].sign) + (fits.at_border[i] != 0 ? kBorderWeight : 0.0F);
        }
    return anchors;
}

// 1: the sign is right beyond doubt, -1: wrong beyond doubt. Sweeps of Gauss-Seidel within blocks, of Jacobi between
// them, from the signs as they are: so only what contradicts decays, whatever the distance to what is seen.
std::vector<float> margins_of_signs(const PointLinks &links, const SignEvidence &evidence,
                                    const std::vector<Anchor> &anchors, int threads) {
    const std::size_t count = anchors.size();
    std::vector<float> margins(count, 1.0F), next(count);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        parallel_for((count + kBlock - 1) / kBlock, threads, [&](std::size_t block) {
            const std::size_t first = block * kBlock;
            for (std::size_t i = first; i < std::min(count, first + kBlock); ++i) {
                float sum = 0;
                int weight = 0;
                for (std::size_t link = i * kLinks; link < (i + 1) * kLinks; ++link) {
                    const std::size_t j = links.nearest[link];
                    sum += static_cast<float>(evidence.votes[link]) * (j >= first && j < i ? next[j] : margins[j]);
                    weight += std::abs(evidence.votes[link]);
                }
                const float all = static_cast<float>(weight) + anchors[i].weight * kSure;
                next[i] = all > 0 ? (sum + anchors[i].sign * kSure) / all : 0.0F;
            }
        });
        std::swap(margins, next);
    }
    return margins;
}

std::vector<Verdict> verdicts_of(const std::vector<float> &margins) {
    std::vector<Verdict> verdicts(margins.size());
    for (std::size_t i = 0; i < margins.size(); ++i)
        verdicts[i] = margins[i] > kDoubt ? Verdict::keep : margins[i] < -kDoubt ? Verdict::turn : Verdict::unknown;
    return verdicts;
}

// Points whose signs are known and that firm links join.
ParitySets parts_of(const PointLinks &links, const std::vector<Vote> &votes, const std::vector<Verdict> &verdicts) {
    ParitySets parts(verdicts.size());
    for (std::size_t link = 0; link < votes.size(); ++link) {
        const std::size_t i = link / kLinks, j = links.nearest[link];
        if (votes[link] * static_cast<int>(verdicts[i]) * static_cast<int>(verdicts[j]) >= kFirm)
            parts.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j), false);
    }
    return parts;
}

struct Seen {
    std::int64_t points = 0, towards = 0, all = 0; // the latter two as in OutsideView, summed
};

Verdict judge(const Seen &part) {
    if (part.points < kFew)
        return Verdict::keep;
    const auto seen = static_cast<double>(part.all), towards = static_cast<double>(part.towards);
    if (seen < kHidden * kNormalScale * static_cast<double>(part.points) || std::fabs(towards) < kOneSide * seen)
        return Verdict::unknown;
    return towards > 0 ? Verdict::keep : Verdict::turn;
}

void judge_parts(const PointLinks &links, const SignEvidence &evidence, std::vector<Verdict> &verdicts) {
    ParitySets parts = parts_of(links, evidence.votes, verdicts);
    const auto part_of = [&](std::size_t i) { return parts.find(static_cast<std::uint32_t>(i)).root; };
    std::vector<Seen> seen(verdicts.size());
    for (std::size_t i = 0; i < verdicts.size(); ++i)
        if (evidence.has_outside[i] != 0) {
            Seen &part = seen[part_of(i)];
            part.points += 1;
            part.towards += static_cast<std::int64_t>(verdicts[i]) * evidence.view.towards[i];
            part.all += evidence.view.seen[i];
        }
    for (std::size_t i = 0; i < verdicts.size(); ++i)
        if (evidence.has_outside[i] != 0)
            verdicts[i] =
                static_cast<Verdict>(static_cast<int>(verdicts[i]) * static_cast<int>(judge(seen[part_of(i)])));
}

// With their sign there would be a hole.
void doubt_points_seen_from_behind(const SignEvidence &evidence, std::vector<Verdict> &verdicts) {
    for (std::size_t i = 0; i < verdicts.size(); ++i)
        if (evidence.has_outside[i] != 0) {
            const auto seen = static_cast<double>(evidence.view.seen[i]);
            const double towards = static_cast<double>(verdicts[i]) * evidence.view.towards[i];
            if (seen > kGlimpse * kNormalScale && towards < -kBehind * seen)
                verdicts[i] = Verdict::unknown;
        }
}

} // namespace

std::vector<Verdict> reconsider_signs(const PlaneFits &fits, const SignEvidence &evidence, int threads) {
    const std::vector<Anchor> anchors = anchors_of(fits, evidence);
    std::vector<Verdict> verdicts = verdicts_of(margins_of_signs(fits.links, evidence, anchors, threads));
    judge_parts(fits.links, evidence, verdicts);
    doubt_points_seen_from_behind(evidence, verdicts);
    return verdicts;
}

} // namespace pbm::build
