// Statistics of a build, for the report on the terminal and for --json.
#pragma once

#include "pbm_build/report/mesh_figures.h"
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

// The latter two with --if-changed only.
enum class Outcome { written, unchanged, up_to_date, cached };

struct BuildStatistics {
    Outcome outcome = Outcome::written;
    std::vector<AttributeReport> attributes;
    std::vector<MeshFigures> meshes;   // on request (--mesh-report)
    std::vector<StepStatistics> steps; // in order; a step done several times (--max-points) is summed
    std::uint64_t input_bytes = 0, vertices = 0, triangles = 0;
    std::uint64_t samples = 0;     // pairs of a voxel and a triangle or point
    std::uint64_t made_points = 0; // by up-sampling, part of the samples
    std::uint64_t points = 0, two_sided_points = 0;
    int depth = 0;
    double voxel_size = 0;
    double seconds = 0; // from the start of the program until it reports
    std::uint64_t file_bytes = 0;
    std::uint64_t panorama_bytes = 0; // of file_bytes; excluded from bits_per_point

    void report(std::string name, Fate fate, std::string note, std::string input = {}) {
        attributes.push_back({std::move(name), fate, std::move(note), std::move(input)});
    }
    void report(Warning warning, std::string name, std::string note, std::string input = {}) {
        attributes.push_back(line_of(warning, std::move(name), std::move(note), std::move(input)));
    }
    double bits_per_point() const;
    double ratio() const; // file to input
};

// Measures the steps of a build and forwards their progress.
class StepClock {
  public:
    // Refers to both.
    StepClock(BuildStatistics &statistics, const Progress &progress) : statistics_(statistics), progress_(progress) {}

    // Runs `work`, which may take a std::function<void(double)> for its progress, 0..1.
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

std::string_view to_string(Fate fate);
std::string_view to_string(Outcome outcome);

// errors  bad_input  a line is of a kind in `denied`; the message names the input, where there are several
Status refuse_denied(const BuildStatistics &statistics, const WarningSet &denied);

// One JSON object, indented, with a final newline.
std::string to_json(const BuildStatistics &statistics, std::span<const std::string> inputs, const std::string &output);

} // namespace pbm::build
