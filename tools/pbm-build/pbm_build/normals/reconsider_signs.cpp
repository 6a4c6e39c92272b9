#include "pbm_build/normals/reconsider_signs.h"

#include "pbm_build/surface/parity_sets.h"
#include "system/threads/parallel.h"

#include <algorithm>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 4096, kTogether = 4;
constexpr int kSweeps = 20;           // a low margin spreads over about as many points
constexpr double kViewWeight = 0.06;  // weight of a view; a link of full confidence has 1
constexpr float kBorderWeight = 1.1F; // weight of the margin 0 at a border
constexpr float kFixed = 1e6F;        // weight of a given normal
constexpr float kDoubt = 0.1F;        // |margin| up to which a sign is unknown
constexpr int kFirm = 200;            // minimum vote of the links within a part
constexpr std::int64_t kFew = 20;     // points: a smaller part is not judged
constexpr double kHidden = 1.5;       // minimum views per point: below, a part is mostly hidden
constexpr double kOneSide = 0.25;     // minimum net share of a part's views from one side
constexpr double kGlimpse = 0.5;      // minimum views of a point: fewer are chance
constexpr double kBehind = 0.5;       // net share of a point's views from behind

// Evidence for the sign of a point besides its neighbours. Views from both sides cancel.
struct Anchor {
    float sign = 0, weight = 0; // |sign| <= weight
};

Anchor anchor_of(const PlaneFits &fits, const SignEvidence &evidence, std::size_t point) {
    if (!evidence.is_given.empty() && evidence.is_given[point] != 0)
        return {kFixed, kFixed};
    if (evidence.has_outside[point] == 0)
        return {};
    const auto sign = static_cast<float>(kViewWeight / kNormalScale * evidence.view.towards[point]);
    return {sign, std::fabs(sign) + (fits.at_border[point] != 0 ? kBorderWeight : 0.0F)};
}

// The margin of a point is `alone` plus `share` times the margins of its neighbours, each times the vote of the link.
struct Mean {
    float alone = 0, share = 0;
};

std::vector<Mean> means_of(const PlaneFits &fits, const SignEvidence &evidence) {
    std::vector<Mean> means(fits.normals.size());
    for (std::size_t i = 0; i < means.size(); ++i) {
        int votes = 0;
        for (std::size_t link = i * kLinks; link < (i + 1) * kLinks; ++link)
            votes += std::abs(evidence.votes[link]);
        const Anchor anchor = anchor_of(fits, evidence, i);
        if (const float weight = static_cast<float>(votes) + anchor.weight * kSure; weight > 0)
            means[i] = {anchor.sign * kSure / weight, 1 / weight};
    }
    return means;
}

// Margins of confidence: 1: the sign is certainly correct, -1: certainly wrong. The iteration starts at 1, Gauss-Seidel
// within blocks and Jacobi between them, so a margin only decays where votes contradict each other, however far the
// next visible point is.
std::vector<float> margins_of_signs(const PlaneFits &fits, const SignEvidence &evidence, int threads) {
    const std::vector<Mean> means = means_of(fits, evidence);
    const std::size_t count = means.size();
    std::vector<float> margins(2 * count, 1.0F); // now, and behind them those of the sweep before
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        const auto update = [&](std::size_t i, std::size_t block) {
            const std::uint32_t *const nearest = &fits.links.nearest[i * kLinks];
            const Vote *const votes = &evidence.votes[i * kLinks];
            float sum = 0;
            for (std::size_t k = 0; k < kLinks; ++k) {
                const bool inside = nearest[k] - block < kBlock;
                const std::size_t before = count & (static_cast<std::size_t>(inside) - 1); // count or 0: no branch
                sum += static_cast<float>(votes[k]) * margins[nearest[k] + before];
            }
            margins[i] = means[i].alone + means[i].share * sum;
        };
        // Each point waits for the one before it, so that several blocks take turns.
        parallel_blocks(count, kTogether * kBlock, threads, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = 0; i < kBlock; ++i)
                for (std::size_t block = begin; block + i < end; block += kBlock)
                    update(block + i, block);
        });
        std::copy_n(margins.begin(), count, margins.begin() + static_cast<std::ptrdiff_t>(count));
    }
    margins.resize(count);
    return margins;
}

std::vector<Verdict> verdicts_of(const std::vector<float> &margins) {
    std::vector<Verdict> verdicts(margins.size());
    for (std::size_t i = 0; i < margins.size(); ++i)
        verdicts[i] = margins[i] > kDoubt ? Verdict::keep : margins[i] < -kDoubt ? Verdict::turn : Verdict::unknown;
    return verdicts;
}

// Sets of points with known signs, joined by firm links.
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

// A point with a wrong sign would be culled and leave a hole.
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
    std::vector<Verdict> verdicts = verdicts_of(margins_of_signs(fits, evidence, threads));
    judge_parts(fits.links, evidence, verdicts);
    doubt_points_seen_from_behind(evidence, verdicts);
    return verdicts;
}

} // namespace pbm::build
