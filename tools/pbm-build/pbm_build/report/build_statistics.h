// What a build did: for the lines at its end and for --json.
#pragma once

#include "pbm_scan/surface/surface.h"

#include <chrono>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace pbm::build {

// Called with the step's name and how much of it is done, 0..1; may be empty.
using Progress = std::function<void(std::string_view step, double done)>;

struct StepStatistics {
    std::string name;
    double seconds = 0;
    std::uint64_t peak_memory = 0; // bytes, of the process so far, at the end of the step
};

// What became of the output; the latter two with --if-changed only.
enum class Outcome { written, unchanged, up_to_date };

struct BuildStatistics {
    Outcome outcome = Outcome::written;
    std::vector<AttributeReport> attributes;
    std::vector<StepStatistics> steps; // in order; a step done several times (--max-points) is summed
    std::uint64_t input_bytes = 0, vertices = 0, triangles = 0;
    std::uint64_t samples = 0; // votes that were averaged
    std::uint64_t points = 0, two_sided_points = 0;
    int depth = 0;
    double voxel_size = 0;
    std::uint64_t file_bytes = 0;
    std::uint64_t panorama_bytes = 0; // of those; not counted as bits of points

    double seconds() const;
    double bits_per_point() const;
    double ratio() const; // file to input
};

// Times the steps of a build and passes their progress on.
class StepClock {
  public:
    // Both must outlive the clock.
    StepClock(BuildStatistics &statistics, const Progress &progress) : statistics_(statistics), progress_(progress) {}

    // Does `work`, which may take a std::function<void(double)> to call with 0..1.
    template <class Work> auto run(std::string_view name, Work &&work) {
        const Step step(*this, name);
        if constexpr (std::is_invocable_v<Work>)
            return work();
        else
            return work(step.progress());
    }

  private:
    struct Step {
        StepClock &clock;
        std::string name;
        std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();

        Step(StepClock &of, std::string_view step);
        ~Step();
        std::function<void(double)> progress() const;
    };
    BuildStatistics &statistics_;
    const Progress &progress_;
};

std::string_view to_string(AttributeReport::Fate fate);
std::string_view to_string(Outcome outcome);

// One JSON object, indented, with a final newline.
std::string to_json(const BuildStatistics &statistics, std::span<const std::string> inputs, const std::string &output);

} // namespace pbm::build
