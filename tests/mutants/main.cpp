// The test program `mutants`: README.md has the laws, --help the options.
#include "command_line/parse.h"
#include "mutants/format_traits.h"
#include "mutants/laws.h"
#include "system/processes/child_process.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <string>
#include <type_traits>
#include <vector>

namespace {

using namespace pbm;
using namespace pbm::mutants;

constexpr int kVerdicts = 5;
constexpr std::array<const char *, kVerdicts> kVerdictNames{"loaded", "with drops", "refused", "unsupported", "BROKEN"};
constexpr std::uint64_t kBatch = 100; // mutants per child process

// The verdict of a child process on one mutant.
struct Record {
    std::uint64_t number = 0;
    Verdict verdict{};
    std::array<char, 400> text{};
};
static_assert(std::is_trivially_copyable_v<Record>);

std::vector<HonestFile> all_honest_files() {
    std::vector<HonestFile> files = honest_meshes();
    for (HonestFile &cloud : honest_clouds())
        files.push_back(std::move(cloud));
    return files;
}

struct Campaign {
    std::vector<HonestFile> files = all_honest_files();
    std::uint64_t seed = 1, first = 0, count = 4000;
    std::array<std::array<std::uint64_t, kVerdicts>, kFormats> table{};
    std::uint64_t broken = 0;
};

Mutant make(const Campaign &campaign, std::uint64_t number) {
    Random random(campaign.seed * 0x100000001B3U + number);
    return mutate(campaign.files, number % campaign.files.size(), Random(random.next()));
}

void note(Campaign &campaign, const Record &record) {
    const HonestFile &origin = campaign.files[record.number % campaign.files.size()];
    ++campaign.table[static_cast<std::size_t>(origin.format)][static_cast<std::size_t>(record.verdict)];
    constexpr std::uint64_t kMaxShown = 40;
    if (record.verdict == Verdict::broken && ++campaign.broken <= kMaxShown)
        std::printf("mutant %llu (%s, %s; %s): %s\n", static_cast<unsigned long long>(record.number),
                    traits(origin.format).name, origin.name.c_str(), make(campaign, record.number).story.c_str(),
                    record.text.data());
}

// Judges mutants in a child process. Returns the number after the last mutant that was judged or ended the child.
std::uint64_t run_batch(Campaign &campaign, std::uint64_t begin, std::uint64_t end) {
    std::uint64_t next = begin;
    std::string received;
    const ChildTask task{.name = "the reader",
                         .advice = "save the mutant and look",
                         .limits = {.cpu_seconds = 30, .wall_seconds = 150, .memory = std::uint64_t{512} << 20},
                         .work = [&](const ByteSink &send) -> Status {
                             for (std::uint64_t number = begin; number < end; ++number) {
                                 const Judgement judgement = judge(make(campaign, number));
                                 Record record{.number = number, .verdict = judgement.verdict, .text = {}};
                                 judgement.text.copy(record.text.data(), record.text.size() - 1);
                                 send({reinterpret_cast<const std::uint8_t *>(&record), sizeof record});
                             }
                             return {};
                         },
                         .receive = [&](ByteView bytes) -> Status {
                             received.append(reinterpret_cast<const char *>(bytes.data()), bytes.size());
                             for (; received.size() >= sizeof(Record); received.erase(0, sizeof(Record))) {
                                 Record record;
                                 std::memcpy(&record, received.data(), sizeof record);
                                 note(campaign, record);
                                 next = record.number + 1;
                             }
                             return {};
                         }};
    if (const Status status = run_in_child(task); !status) {
        Record record{.number = next, .verdict = Verdict::broken, .text = {}};
        status.error().message.copy(record.text.data(), record.text.size() - 1);
        note(campaign, record);
        return next + 1;
    }
    return end;
}

void print_table(const Campaign &campaign) {
    std::printf("%-12s", "");
    for (const char *name : kVerdictNames)
        std::printf("%13s", name);
    std::array<std::uint64_t, kVerdicts> sum{};
    for (int format = 0; format < kFormats; ++format) {
        std::printf("\n%-12s", traits(static_cast<Format>(format)).name);
        for (std::size_t k = 0; k < kVerdicts; ++k) {
            const std::uint64_t count = campaign.table[static_cast<std::size_t>(format)][k];
            sum[k] += count;
            std::printf("%13llu", static_cast<unsigned long long>(count));
        }
    }
    std::printf("\n%-12s", "all");
    for (const std::uint64_t count : sum)
        std::printf("%13llu", static_cast<unsigned long long>(count));
    std::printf("\n");
}

// The unchanged files must load with the right counts; otherwise all further results are meaningless.
bool honest_files_load(const Campaign &campaign) {
    bool good = true;
    for (const HonestFile &file : campaign.files) {
        const Judgement judgement = judge({.origin = &file, .bytes = file.bytes, .story = {}, .cut_at = {}});
        if (judgement.verdict != Verdict::loaded && judgement.verdict != Verdict::loaded_less) {
            std::printf("honest file (%s, %s): %s\n", traits(file.format).name, file.name.c_str(),
                        judgement.text.c_str());
            good = false;
        }
    }
    return good;
}

int run(int argc, char **argv) {
    Campaign campaign;
    std::string save;
    command_line::CommandLine line{
        "mutants", "Reads mutants of honest files and judges what came of each; exit code 1 if a law is broken"};
    line.add("COUNT", "How many", &campaign.count);
    line.add("FIRST", "Number of the first", &campaign.first);
    line.add("--seed", "Other mutants", &campaign.seed, {.shows_default = true});
    line.add("--save", "Write the first to this file instead", &save, {.type = "FILE"});
    if (const auto done = command_line::parse(line, argc, argv))
        return *done;
    if (!save.empty()) {
        std::ofstream(save, std::ios::binary) << make(campaign, campaign.first).bytes;
        return 0;
    }
    if (!honest_files_load(campaign))
        return 1;
    const std::uint64_t end = campaign.first + campaign.count;
    for (std::uint64_t at = campaign.first; at < end;)
        at = run_batch(campaign, at, std::min(at + kBatch, end));
    print_table(campaign);
    return campaign.broken == 0 && campaign.count != 0 ? 0 : 1;
}

} // namespace

int main(int argc, char **argv) {
    try {
        return run(argc, argv);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "mutants: %s\n", error.what());
        return 4;
    }
}
