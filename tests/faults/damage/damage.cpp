// Damage that hashes detect: each case must be detected, and at the right place.
#include "campaign.h"
#include "goldens.h"
#include "judge.h"
#include "pictures.h"
#include "unit/support/value_of.h"

#include <algorithm>

namespace pbm::faults {
namespace {

// Results of `validate` and `verify` for a damaged file.
struct Found {
    ValidationReport report;
    Status first;
};

Found examine(ByteView file) { return {validate(file, {.threads = 1}), verify(file, {.threads = 1})}; }

bool within(std::uint64_t offset, std::uint64_t begin, std::uint64_t end) { return offset >= begin && offset < end; }

void flip_all(const Golden &golden, std::uint64_t step, Tally &tally) {
    Reader reader = value_of(Reader::open(golden.bytes));
    if (!reader.directory(reader.depth()))
        return;
    const std::vector<Region> regions = regions_of(reader, golden.bytes);
    Pictures pictures(golden);
    Bytes file = golden.bytes;
    for (std::uint64_t bit = 0; bit < 8 * file.size(); bit += step) {
        const std::uint64_t at = bit / 8;
        const Region &region =
            *std::find_if(regions.begin(), regions.end(), [&](const Region &candidate) { return at < candidate.end; });
        const std::string story = golden.name + ", bit " + std::to_string(bit) + ", " + describe(region);
        file[at] = static_cast<std::uint8_t>(file[at] ^ 1U << bit % 8);
        const Found found = examine(file);
        tally.add_case();
        const bool detected = tally.require(!found.report.valid(), story + ": the validator sees nothing") &&
                              tally.require(!found.first.ok(), story + ": verify sees nothing");
        if (detected) {
            tally.add_detected();
            tally.require(std::any_of(found.report.findings.begin(), found.report.findings.end(),
                                      [&](const Finding &finding) {
                                          return within(finding.offset, region.begin, region.end) &&
                                                 (region.part != Part::chunk || finding.chunk < 0 ||
                                                  finding.chunk == static_cast<std::int64_t>(region.index));
                                      }),
                          story + ": the validator does not say where, but " + found.report.findings[0].message);
            tally.require(within(found.first.error().offset, region.section_begin, region.section_end),
                          story + ": verify does not say where, but " + found.first.error().message);
        }
        pictures.check(file, region, story, tally);
        file[at] = golden.bytes[at];
    }
}

} // namespace

void cut_files(const Options &options, Tally &tally) {
    for (const Golden &golden : goldens(options.complete ? 64 << 10 : 4 << 10))
        for (std::size_t size = 0; size < golden.bytes.size(); ++size) {
            // An allocation of exactly this size: a sanitizer sees any access beyond.
            const Bytes file(golden.bytes.begin(), golden.bytes.begin() + static_cast<std::ptrdiff_t>(size));
            const Found found = examine(file);
            const std::string story = golden.name + " cut at " + std::to_string(size);
            tally.add_case();
            if (tally.require(!found.report.valid() && !found.first.ok(), story + ": not seen"))
                tally.add_detected();
            else
                continue;
            const Finding &finding = found.report.findings.front();
            tally.require((finding.code == ErrorCode::truncated || size == 0) && finding.offset == size &&
                              found.first.error().offset == size,
                          story + ": " + finding.message + " at " + std::to_string(finding.offset));
            tally.require(!open_and_draw(file).ok(), story + ": drawn");
        }
}

void flip_bits(const Options &options, Tally &tally) {
    const std::vector<Golden> files = options.complete ? goldens_and_scans(32 << 10) : goldens(13 << 10);
    for (const Golden &golden : files) {
        if (!options.golden.empty() && golden.name != options.golden)
            continue;
        constexpr std::uint64_t kSample = 400; // flips per file; an odd step, so that every bit position occurs
        const std::uint64_t step = golden.bytes.size() * 8 / kSample | 1;
        flip_all(golden, options.complete ? 1 : step, tally);
    }
}

} // namespace pbm::faults
