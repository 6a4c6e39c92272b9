// The test program `random_models`: README.md has the laws, --help the options.
#include "random_models/damage.h"
#include "random_models/free_writer.h"
#include "random_models/laws.h"
#include "random_models/random_model.h"

#include "command_line/parse.h"
#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/writer.h"
#include "system/files/file_replacement.h"
#include "unit/support/value_of.h"

#include <array>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::test;

struct Campaign {
    std::uint64_t seed = 1, first = 0, count = 300;
    bool damaged = false;
    std::string save;
};

struct Totals {
    std::uint64_t files = 0, valid = 0, broken = 0, mapped = 0, points = 0, chunks = 0, bytes = 0;
};

// One time in three the library's writer, else the random one.
Bytes encode(const Model &model, Random &random) {
    if (random.below(3) != 0)
        return write_freely(model, random);
    const WriteOptions options{.storage = random.below(2) == 0 ? Storage::packed : Storage::mapped,
                               .compression_level = 1 + static_cast<int>(random.below(19)),
                               .filters = random.below(4) != 0,
                               .chunk_points = kMinChunkPoints << random.below(8),
                               .threads = 1};
    return value_of(encode_model(model, options));
}

struct Case {
    Model model;
    Bytes file;
    std::string story;
};

Case make_case(const Campaign &campaign, std::uint64_t number) {
    Random random(Random(campaign.seed).next() + number);
    const std::size_t max_points = campaign.damaged ? 300 : random.below(8) == 0 ? 12000 : 1500;
    Case made{random_model(random, max_points), {}, {}};
    made.file = encode(made.model, random);
    if (campaign.damaged) {
        Damaged damaged = damage(std::move(made.file), [&](std::uint64_t limit) { return random.below(limit); });
        made.file = std::move(damaged.bytes);
        made.story = std::move(damaged.story);
    }
    return made;
}

void judge_one(const Campaign &campaign, std::uint64_t number, Totals &totals) {
    const Case made = make_case(campaign, number);
    const Judgement judgement = campaign.damaged ? judge(made.file) : judge_valid(made.file, made.model);
    ++totals.files;
    totals.valid += judgement.valid ? 1 : 0;
    totals.bytes += made.file.size();
    totals.points += made.model.point_count();
    if (judgement.valid) {
        Reader reader = value_of(Reader::open(made.file));
        totals.mapped += reader.header().storage() == Storage::mapped ? 1 : 0;
        totals.chunks += value_of(reader.directory(reader.depth()))->chunks.size();
    }
    if (!judgement.broken.empty()) {
        ++totals.broken;
        std::printf("file %llu: %s (%s)\n", static_cast<unsigned long long>(number), judgement.broken.c_str(),
                    made.story.c_str());
    }
}

int save_files(const Campaign &campaign) {
    for (std::uint64_t number = campaign.first; number < campaign.first + campaign.count; ++number)
        if (const Status status =
                replace_file(campaign.save + "/" + std::to_string(number) + ".pbvg", make_case(campaign, number).file);
            !status)
            return std::printf("%s\n", status.error().message.c_str()), 1;
    return 0;
}

int run(int argc, char **argv) {
    Campaign campaign;
    command_line::CommandLine line{"random_models", "Judges random valid files; exit code 1 if a law is broken"};
    line.add("COUNT", "How many", &campaign.count);
    line.add("FIRST", "Number of the first", &campaign.first);
    line.add("--damaged", "A damaged and signed copy of each instead", &campaign.damaged);
    line.add("--seed", "Other files", &campaign.seed, {.shows_default = true});
    line.add("--save", "Write them into this folder instead", &campaign.save);
    if (const auto done = command_line::parse(line, argc, argv))
        return *done;
    if (!campaign.save.empty())
        return save_files(campaign);
    Totals totals;
    for (std::uint64_t number = campaign.first; number < campaign.first + campaign.count; ++number)
        judge_one(campaign, number, totals);
    const auto print = [](const char *name, std::uint64_t value) {
        std::printf("%-14s %12llu\n", name, static_cast<unsigned long long>(value));
    };
    print("files", totals.files);
    print("valid", totals.valid);
    print("  mapped", totals.mapped);
    print("  chunks", totals.chunks); // of the finest level
    print("points", totals.points);
    print("bytes", totals.bytes);
    print("broken laws", totals.broken);
    return totals.broken == 0 && totals.files != 0 ? 0 : 1;
}

} // namespace

int main(int argc, char **argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "random_models: %s\n", error.what());
        return 4;
    }
}
