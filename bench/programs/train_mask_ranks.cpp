// Makes the normative table of the rank filter (format_spec/mask_ranks.txt) from models.
// usage: train_mask_ranks TABLE MODEL.pbvg[=WEIGHT]...
//
// Contexts (mask_ranks.h) with similar mask frequencies share a ranking. Lloyd's iteration assigns them: each context
// joins the ranking that codes its masks in the fewest bits, then each ranking sorts the masks of its contexts by
// frequency. Bits are those of one entropy coder for all codes, because a chunk has one Huffman table.
// The histogram of a model is scaled to its weight. Integer arithmetic: equal models give equal bytes.
#include "pbm_format/reading/load_model.h"
#include "pbm_format/streams/mask_ranks.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdio>
#include <limits>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

namespace pbm {
namespace {

constexpr std::size_t kMasks = 256;
constexpr unsigned kModelBits = 30;      // histogram sum of a model of weight 1: 2^30
constexpr std::uint64_t kOwnShare = 256; // weight of a context's own masks against those of all normals at its place
constexpr std::uint64_t kBit = 256;      // unit of code lengths
constexpr std::uint64_t kLongestCode = 16 * kBit;
constexpr int kRounds = 24; // costs converge after about 16

using Counts = std::array<std::uint64_t, kMasks>; // by mask image, or by code
using Lengths = std::array<std::uint64_t, kMasks>;
using Ranking = std::array<std::uint8_t, kMasks>; // [code] mask image

struct Sample {
    std::uint8_t mask = 0;
    std::uint64_t weight = 0;
};
using Context = std::vector<Sample>;

// Histograms of a model over all levels: by context, then by mask image.
std::vector<Counts> count_masks(const Model &model) {
    std::vector<Counts> counts(kMaskContexts, Counts{});
    for (std::size_t level = 1; level < model.levels.size(); ++level) {
        const Bytes &masks = model.levels[level].masks;
        std::vector<PlacedMask> placed(masks.size());
        place_masks(
            {.parent_masks = model.levels[level - 1].masks, .node_normals = model.levels[level - 1].points.normals},
            placed);
        for (std::size_t i = 0; i < masks.size(); ++i)
            ++counts[placed[i].context][mask_image(masks[i], placed[i].symmetry)];
    }
    return counts;
}

std::uint64_t sum_of(const Counts &counts) { return std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}); }

void add_model(const Model &model, std::uint64_t weight, std::vector<Counts> &all) {
    const std::vector<Counts> counts = count_masks(model);
    std::uint64_t nodes = 0;
    for (const Counts &context : counts)
        nodes += sum_of(context);
    for (std::size_t context = 0; context < kMaskContexts; ++context)
        for (std::size_t mask = 0; mask < kMasks; ++mask)
            all[context][mask] += (counts[context][mask] << kModelBits) / nodes * weight;
}

// Adds to each context a small share of the counts at its place and parent mask over all normals, or of all counts if
// there are none. So no context lacks samples, and hardly any mask does.
std::vector<Context> smooth(const std::vector<Counts> &all) {
    constexpr std::size_t kSurroundings = kMaskContexts / kMaskNormalClasses;
    std::vector<Counts> any_normal(kSurroundings, Counts{});
    Counts anywhere{};
    for (std::size_t context = 0; context < kMaskContexts; ++context)
        for (std::size_t mask = 0; mask < kMasks; ++mask) {
            any_normal[context % kSurroundings][mask] += all[context][mask];
            anywhere[mask] += all[context][mask];
        }
    std::vector<Context> contexts(kMaskContexts);
    for (std::size_t context = 0; context < kMaskContexts; ++context) {
        const Counts &around = any_normal[context % kSurroundings];
        const bool seen = sum_of(around) > 0;
        for (std::size_t mask = 1; mask < kMasks; ++mask) {
            const std::uint64_t weight = seen ? all[context][mask] * kOwnShare + around[mask] / kMaskNormalClasses
                                              : anywhere[mask] >> kModelBits;
            if (weight > 0)
                contexts[context].push_back({static_cast<std::uint8_t>(mask), weight});
        }
    }
    return contexts;
}

// Binary logarithm of `value` >= 1 in units of 1 / kBit, rounded down, by squaring.
std::uint64_t logarithm(std::uint64_t value) {
    const int whole = static_cast<int>(std::bit_width(value)) - 1;
    std::uint64_t mantissa = whole >= 31 ? value >> (whole - 31) : value << (31 - whole); // 1..2 x 2^31
    auto result = static_cast<std::uint64_t>(whole);
    for (std::uint64_t unit = kBit; unit > 1; unit /= 2) {
        mantissa = mantissa * mantissa >> 31;
        const bool over = mantissa >> 32 != 0;
        mantissa >>= over ? 1 : 0;
        result = 2 * result + (over ? 1 : 0);
    }
    return result;
}

// Code lengths for the frequencies, ascending by code.
Lengths code_lengths(const Counts &codes) {
    const std::uint64_t total = logarithm(sum_of(codes));
    Lengths lengths{};
    for (std::size_t code = 0; code < kMasks; ++code) {
        lengths[code] = codes[code] == 0 ? kLongestCode : std::min(kLongestCode, total - logarithm(codes[code]));
        if (code > 0)
            lengths[code] = std::max(lengths[code], lengths[code - 1]);
    }
    return lengths;
}

// Masks by falling count, then by falling count over all contexts, then ascending; mask 0 last (4.2 forbids it).
Ranking rank_by(const Counts &counts, const Counts &anywhere) {
    Ranking ranking{};
    std::iota(ranking.begin(), ranking.end(), std::uint8_t{0});
    std::sort(ranking.begin(), ranking.end(), [&](std::uint8_t a, std::uint8_t b) {
        if (a == 0 || b == 0)
            return b == 0 && a != 0;
        if (counts[a] != counts[b])
            return counts[a] > counts[b];
        return anywhere[a] != anywhere[b] ? anywhere[a] > anywhere[b] : a < b;
    });
    return ranking;
}

Lengths lengths_by_mask(const Ranking &ranking, const Lengths &lengths) {
    Lengths by_mask{};
    for (std::size_t code = 0; code < kMasks; ++code)
        by_mask[ranking[code]] = lengths[code];
    return by_mask;
}

std::uint64_t cost(const Context &context, const Lengths &by_mask) {
    std::uint64_t bits = 0;
    for (const Sample &sample : context)
        bits += sample.weight * by_mask[sample.mask];
    return bits;
}

void add_samples(const Context &context, Counts &counts) {
    for (const Sample &sample : context)
        counts[sample.mask] += sample.weight;
}

struct Table {
    std::vector<std::uint8_t> ranking_of = std::vector<std::uint8_t>(kMaskContexts);
    std::vector<Ranking> rankings;
};

// Initial guess of the code lengths.
Lengths guessed_lengths() {
    Lengths lengths{};
    for (std::size_t code = 0; code < kMasks; ++code)
        lengths[code] = std::min(14 * kBit, kBit + code * kBit * 9 / 20);
    return lengths;
}

// Adds rankings one by one, each from the context that would gain most from a ranking of its own.
std::vector<Ranking> first_rankings(const std::vector<Context> &contexts, const Counts &anywhere) {
    const Lengths lengths = guessed_lengths();
    const auto rank_one = [&](const Context &context) {
        Counts counts{};
        add_samples(context, counts);
        return rank_by(counts, anywhere);
    };
    std::vector<std::uint64_t> own(kMaskContexts), best(kMaskContexts);
    for (std::size_t c = 0; c < kMaskContexts; ++c) {
        own[c] = cost(contexts[c], lengths_by_mask(rank_one(contexts[c]), lengths));
        best[c] = std::numeric_limits<std::uint64_t>::max() / 2;
    }
    std::vector<Ranking> rankings;
    while (rankings.size() < kMaskRankings) {
        std::size_t worst = 0;
        for (std::size_t c = 1; c < kMaskContexts; ++c)
            if (rankings.empty() ? own[c] > own[worst] : best[c] - own[c] > best[worst] - own[worst])
                worst = c;
        rankings.push_back(rank_one(contexts[worst]));
        const Lengths by_mask = lengths_by_mask(rankings.back(), lengths);
        for (std::size_t c = 0; c < kMaskContexts; ++c)
            best[c] = std::min(best[c], cost(contexts[c], by_mask));
    }
    return rankings;
}

// Assigns each context to the first ranking of minimum cost. Returns the total cost.
std::uint64_t assign(const std::vector<Context> &contexts, const Lengths &lengths, Table &table) {
    std::vector<Lengths> by_mask;
    for (const Ranking &ranking : table.rankings)
        by_mask.push_back(lengths_by_mask(ranking, lengths));
    std::uint64_t total = 0;
    for (std::size_t c = 0; c < kMaskContexts; ++c) {
        std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
        for (std::size_t k = 0; k < kMaskRankings; ++k)
            if (const std::uint64_t bits = cost(contexts[c], by_mask[k]); bits < least) {
                least = bits;
                table.ranking_of[c] = static_cast<std::uint8_t>(k);
            }
        total += least;
    }
    return total;
}

// Sorts each ranking by the counts of its contexts. Returns the frequency of each code.
Counts sort_rankings(const std::vector<Context> &contexts, const Counts &anywhere, Table &table) {
    std::vector<Counts> counts(kMaskRankings, Counts{});
    for (std::size_t c = 0; c < kMaskContexts; ++c)
        add_samples(contexts[c], counts[table.ranking_of[c]]);
    Counts codes{};
    for (std::size_t k = 0; k < kMaskRankings; ++k) {
        table.rankings[k] = rank_by(counts[k], anywhere);
        for (std::size_t code = 0; code < kMasks; ++code)
            codes[code] += counts[k][table.rankings[k][code]];
    }
    return codes;
}

Table cluster(const std::vector<Context> &contexts) {
    Counts anywhere{};
    for (const Context &context : contexts)
        add_samples(context, anywhere);
    const auto weight = static_cast<double>(sum_of(anywhere)) * static_cast<double>(kBit);
    Table table{.rankings = first_rankings(contexts, anywhere)};
    Lengths lengths = guessed_lengths();
    for (int round = 0; round < kRounds; ++round) {
        const std::uint64_t bits = assign(contexts, lengths, table);
        lengths = code_lengths(sort_rankings(contexts, anywhere, table));
        std::printf("round %d: %.4f bits per mask\n", round, static_cast<double>(bits) / weight);
    }
    return table;
}

void append_hex(std::string &text, ByteView bytes) {
    constexpr std::size_t kPerLine = 32;
    constexpr std::string_view kDigits = "0123456789abcdef";
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        text += kDigits[bytes[i] >> 4];
        text += kDigits[bytes[i] & 15];
        if (i % kPerLine == kPerLine - 1)
            text += '\n';
    }
}

std::string print(const Table &table) {
    std::string text = "# The rank filter of child masks (BVG.md). Made by bench/train_mask_ranks; not to be edited.\n"
                       "# Bytes in hexadecimal digits; lines that start with # are comments.\n"
                       "# Ranking of each context: [normal class 21][place 8][parent's mask >> 1 128]\n";
    append_hex(text, table.ranking_of);
    for (std::size_t k = 0; k < kMaskRankings; ++k) {
        text += "# Ranking " + std::to_string(k) + ": masks in the order of their codes\n";
        append_hex(text, table.rankings[k]);
    }
    return text;
}

int fail(const std::string &path, const Error &error) {
    std::fprintf(stderr, "train_mask_ranks: %s: %s\n", path.c_str(), error.message.c_str());
    return exit_code(error.code);
}

int write_table(const std::string &path, const Table &table) {
    const std::string text = print(table);
    const Status written = replace_file(path, as_bytes(text));
    return written ? 0 : fail(path, written.error());
}

// MODEL.pbvg or MODEL.pbvg=WEIGHT
Result<std::uint64_t> split_weight(std::string &path) {
    std::uint64_t weight = 1;
    const std::size_t cut = path.rfind('=');
    if (cut == std::string::npos)
        return weight;
    const char *end = path.data() + path.size();
    const auto [at, problem] = std::from_chars(path.data() + cut + 1, end, weight);
    if (problem != std::errc{} || at != end || weight < 1 || weight > 16)
        return usage_error("a weight is a whole number, 1..16");
    path.resize(cut);
    return weight;
}

int run(int argc, char **argv) {
    std::vector<Counts> all(kMaskContexts, Counts{});
    for (int i = 2; i < argc; ++i) {
        std::string path = argv[i];
        const Result<std::uint64_t> weight = split_weight(path);
        if (!weight)
            return fail(path, weight.error());
        const Result<MappedFile> file = MappedFile::open(path);
        if (!file)
            return fail(path, file.error());
        Result<Reader> reader = Reader::open(file->bytes());
        const Result<Model> model = reader ? load_model(*reader) : Result<Model>(reader.error());
        if (!model)
            return fail(path, model.error());
        add_model(*model, *weight, all);
    }
    return write_table(argv[1], cluster(smooth(all)));
}

} // namespace
} // namespace pbm

int main(int argc, char **argv) {
    if (argc < 3) {
        std::fputs("usage: train_mask_ranks TABLE MODEL.pbvg[=WEIGHT]...\n", stderr);
        return 1;
    }
    return pbm::run(argc, argv);
}
