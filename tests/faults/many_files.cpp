// Opens, verifies and closes files many times, as a viewer or server does: its memory must not grow.
#include "allocation_meter.h"
#include "campaign.h"
#include "goldens.h"
#include "judge.h"

#include "system/files/mapped_file.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <unistd.h>

namespace pbm::faults {
namespace {

std::uint64_t resident_bytes() {
    std::ifstream in("/proc/self/statm");
    std::uint64_t pages = 0;
    in >> pages >> pages;
    return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

std::uint64_t open_descriptors() {
    return static_cast<std::uint64_t>(std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}));
}

// Maps the file, compares `verify` and `validate`, and returns whether it is valid.
bool open_validate_close(const std::string &path, Tally &tally) {
    const Result<MappedFile> file = MappedFile::open(path);
    if (!tally.require(file.ok(), path + ": not opened"))
        return false;
    const bool valid = validate(file->bytes(), {.threads = 1}).valid();
    tally.require(verify(file->bytes(), {.threads = 1}).ok() == valid, path + ": verify and validate differ");
    return valid;
}

} // namespace

void open_many_files(const Options &options, Tally &tally) {
    const std::string vectors = PBM_SOURCE_DIR "/format_spec/vectors/";
    std::vector<std::pair<std::string, bool>> files; // path, whether valid
    for (const Golden &golden : goldens(16 << 10))
        files.emplace_back(vectors + "valid/" + golden.name + ".pbvg", true);
    for (const Golden &broken : broken_vectors())
        files.emplace_back(vectors + "invalid/" + broken.name + ".pbvg", false);
    // Whole turns through the files: what a thread keeps for the next file is then the same at both ends.
    const std::uint64_t warm_up = 2 * files.size(), asked = options.complete ? 100'000 : 3'000,
                        rounds = (asked + files.size() - 1) / files.size() * files.size();
    std::uint64_t resident = 0, descriptors = 0, live = 0;
    for (std::uint64_t round = 0; round < warm_up + rounds; ++round) {
        if (round == warm_up) {
            resident = resident_bytes();
            descriptors = open_descriptors();
            live = heap_use().live;
        }
        const auto &[path, good] = files[round * 7919 % files.size()];
        const bool valid = open_validate_close(path, tally);
        tally.require(valid == good, path + ": the other verdict");
        if (round < warm_up)
            continue;
        tally.add_case();
        if (!valid)
            tally.add_detected();
    }
    const std::uint64_t kept = std::max(heap_use().live, live) - live;
    const std::uint64_t grown = std::max(resident_bytes(), resident) - resident;
    constexpr std::uint64_t kMaxGrowth = std::uint64_t{1} << 20;
    tally.note_largest("KiB of growth", static_cast<double>(grown) / 1024);
    tally.require(grown <= kMaxGrowth || !reuses_memory(), "memory grew by " + std::to_string(grown >> 10) + " KiB");
    tally.require(open_descriptors() == descriptors, "descriptors stay open");
    tally.require(kept == 0, "the heap holds " + std::to_string(kept) + " bytes more");
}

} // namespace pbm::faults
