// The test program `faults`: docs/explanation/reliability.md has the laws, --help the options.
#include "campaign.h"

#include "command_line/parse.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

namespace {

using namespace pbm::faults;

struct Campaign {
    std::string_view name;
    void (*run)(const Options &, Tally &);
};

constexpr std::array<Campaign, 8> kCampaigns{{{"cut", cut_files},
                                              {"flip", flip_bits},
                                              {"behind_hashes", flip_bits_behind_hashes},
                                              {"fields", set_fields_to_edges},
                                              {"bombs", send_bombs},
                                              {"allocations", fail_allocations},
                                              {"changing", change_mapped_files},
                                              {"many", open_many_files}}};

bool run(const Campaign &campaign, const Options &options) {
    Tally tally;
    const auto begin = std::chrono::steady_clock::now();
    campaign.run(options, tally);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::printf("%s\n", tally.row(std::string(campaign.name), seconds).c_str());
    std::fflush(stdout);
    return tally.broken() == 0 && tally.cases() > 0;
}

int run(int argc, char **argv) {
    Options options;
    std::vector<std::string> names, wanted;
    for (const Campaign &campaign : kCampaigns)
        names.emplace_back(campaign.name);
    pbm::command_line::CommandLine line{
        "faults", "Damages files and the world around them; prints a row of a table for each campaign, exit code 1 if "
                  "a law is broken"};
    line.add("CAMPAIGN", "Which ones; default: all", &wanted, {.check = names});
    line.add("--long", "All of it, for minutes; else a sample", &options.complete);
    line.add("--golden", "Flips: of this file alone", &options.golden);
    line.add("--seed", "Other places", &options.seed, {.shows_default = true});
    if (const auto done = pbm::command_line::parse(line, argc, argv))
        return *done;
    bool good = true;
    for (const Campaign &campaign : kCampaigns)
        if (wanted.empty() || std::find(wanted.begin(), wanted.end(), campaign.name) != wanted.end())
            good = run(campaign, options) && good;
    return good ? 0 : 1;
}

} // namespace

int main(int argc, char **argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "faults: %s\n", error.what());
        return 4;
    }
}
