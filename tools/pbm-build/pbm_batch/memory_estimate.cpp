#include "pbm_batch/memory_estimate.h"

#include "system/files/file_names.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace pbm::batch {
namespace {

constexpr std::uint64_t kProgram = std::uint64_t{96} << 20; // of a build of a scan of a few points
constexpr int kEnough = 3;                                  // builds from which what they needed counts
constexpr double kMargin = 1.1;

// Builds of binary PLY meshes and clouds needed 2.5 to 4.2 bytes per byte, of OBJ 2 to 5, of LAS with its usual
// fields 9. Packed files hold more points in a byte.
constexpr double kPlain = 8, kLas = 10, kPacked = 40;

std::string kind_of(const std::string &scan) {
    const std::string plain(uncompressed_name(scan));
    return lower_extension(plain) + (plain == scan ? "" : lower_extension(scan));
}

double first_guess(const std::string &kind) {
    for (const char *packed : {".laz", ".spz", ".glb", ".gltf", ".gz", ".zst"})
        if (kind.ends_with(packed))
            return kPacked;
    return kind.ends_with(".las") ? kLas : kPlain;
}

} // namespace

std::uint64_t MemoryEstimate::of(const std::string &scan, std::uint64_t scan_bytes) const {
    const std::string kind = kind_of(scan);
    const auto known = by_extension_.find(kind);
    const double per_byte = known == by_extension_.end() || known->second.builds < kEnough
                                ? first_guess(kind)
                                : kMargin * known->second.most;
    return kProgram + static_cast<std::uint64_t>(per_byte * static_cast<double>(scan_bytes));
}

void MemoryEstimate::learn(const std::string &scan, std::uint64_t scan_bytes, std::uint64_t peak) {
    if (scan_bytes == 0)
        return;
    Known &known = by_extension_[kind_of(scan)];
    ++known.builds;
    const double more = static_cast<double>(peak > kProgram ? peak - kProgram : 0);
    known.most = std::max(known.most, more / static_cast<double>(scan_bytes));
}

std::uint64_t likely_need(std::span<const std::string> scans) {
    const MemoryEstimate estimate;
    std::uint64_t need = 0;
    for (const std::string &scan : scans) {
        std::error_code error;
        if (const auto bytes = std::filesystem::file_size(scan, error); !error)
            need += estimate.of(scan, bytes);
    }
    return need;
}

} // namespace pbm::batch
