// How much memory a build will need, by the size of its scan and by what earlier builds of a batch needed.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>

namespace pbm::batch {

class MemoryEstimate {
  public:
    // Bytes of resident memory that the build of this scan is likely to need at most.
    std::uint64_t of(const std::string &scan, std::uint64_t scan_bytes) const;
    // Learns that a build had this much at its peak. After three scans of an extension the largest need per byte among
    // them, and a tenth more, takes the place of the first guess.
    void learn(const std::string &scan, std::uint64_t scan_bytes, std::uint64_t peak);

  private:
    struct Known {
        int builds = 0;
        double most = 0; // bytes of memory per byte of the scan
    };

    std::map<std::string, Known> by_extension_; // the whole one: ".ply.gz"
};

// Bytes that one build of all these scans is likely to need at most; those of a stream are not known.
std::uint64_t likely_need(std::span<const std::string> scans);

} // namespace pbm::batch
