// faults [--long] [--seed N] [CAMPAIGN...]: damages files and the world around them; prints a row of a table for each
// campaign, exit code 1 if a law is broken. docs/reliability.md
#include "campaign.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
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

} // namespace

int main(int argc, char **argv) {
    Options options;
    std::vector<std::string_view> wanted;
    for (int i = 1; i < argc; ++i) {
        const std::string_view argument = argv[i];
        if (argument == "--long")
            options.complete = true;
        else if (argument == "--seed" && i + 1 < argc)
            options.seed = std::strtoull(argv[++i], nullptr, 10);
        else
            wanted.push_back(argument);
    }
    std::size_t runs = 0;
    bool good = true;
    for (const Campaign &campaign : kCampaigns) {
        bool asked = wanted.empty();
        for (const std::string_view name : wanted)
            asked = asked || name == campaign.name;
        if (!asked)
            continue;
        ++runs;
        good = run(campaign, options) && good;
    }
    return good && runs >= wanted.size() && runs > 0 ? 0 : 1;
}
