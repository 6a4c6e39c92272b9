#include "pbm_build/report/build_statistics.h"

#include "pbm_scan/surface/refusal.h"
#include "system/processes/this_process.h"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace pbm::build {

double BuildStatistics::bits_per_point() const {
    return points == 0 ? 0 : 8 * static_cast<double>(file_bytes - panorama_bytes) / static_cast<double>(points);
}

double BuildStatistics::ratio() const {
    return input_bytes == 0 ? 0 : static_cast<double>(file_bytes) / static_cast<double>(input_bytes);
}

StepClock::Step::Step(StepClock &of, std::string_view step) : clock(of), name(step) {
    auto &steps = clock.statistics_.steps;
    if (std::none_of(steps.begin(), steps.end(), [&](const StepStatistics &s) { return s.name == name; }))
        steps.push_back({name, 0, 0}); // here, where running out of memory may throw
    if (clock.progress_)
        clock.progress_(name, 0);
}

StepClock::Step::~Step() {
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    auto &steps = clock.statistics_.steps;
    const auto step = std::find_if(steps.begin(), steps.end(), [&](const StepStatistics &s) { return s.name == name; });
    step->seconds += seconds.count();
    step->peak_memory = peak_memory();
    if (clock.progress_)
        clock.progress_(name, 1);
}

std::function<void(double)> StepClock::Step::progress() const {
    if (!clock.progress_)
        return {};
    return [this](double done) { clock.progress_(name, done); };
}

std::string_view to_string(Fate fate) {
    constexpr std::array<std::string_view, 4> kNames{"kept", "converted", "dropped", "estimated"};
    return kNames[static_cast<std::size_t>(fate)];
}

Status refuse_denied(const BuildStatistics &statistics, const WarningSet &denied) {
    for (const AttributeReport &line : statistics.attributes)
        if (const WarningEntry &entry = entry_of(warning_of(line)); contains(denied, warning_of(line)))
            return bad_input((line.input.empty() ? "" : line.input + ": ") + "--deny " + std::string(entry.name) +
                             ": " + line.name + " " + std::string(to_string(line.fate)) +
                             (line.note.empty() ? "" : " (" + line.note + ")") + ". " + std::string(entry.remedy));
    return {};
}

std::string_view to_string(Outcome outcome) {
    constexpr std::array<std::string_view, 4> kNames{"written", "unchanged", "up to date", "from the cache"};
    return kNames[static_cast<std::size_t>(outcome)];
}

namespace {

nlohmann::ordered_json json_of(const MeshFigures &figures) {
    nlohmann::ordered_json json;
    if (!figures.input.empty())
        json["input"] = figures.input;
    json["state"] = figures.state;
    json["positions"] = figures.positions;
    json["vertices"] = figures.vertices;
    json["edges"] = figures.edges;
    json["faces"] = figures.faces;
    json["isolated_vertices"] = figures.isolated_vertices;
    json["repeated_faces"] = figures.repeated_faces;
    json["flat_faces"] = figures.flat_faces;
    json["parts"] = figures.parts;
    json["closed_parts"] = figures.closed_parts;
    json["largest_part_faces"] = figures.largest_part_faces;
    json["largest_part_share"] = figures.largest_part_share;
    json["closed"] = figures.is_closed();
    json["border_edges"] = figures.border_edges;
    json["border_loops"] = figures.border_loops;
    json["longest_loop"] = figures.longest_loop;
    json["complex_edges"] = figures.complex_edges;
    json["complex_vertices"] = figures.complex_vertices;
    json["turned_faces"] = figures.turned_faces;
    json["inward_sheets"] = figures.inward_sheets;
    json["one_sided_sheets"] = figures.one_sided_sheets;
    json["euler_characteristic"] = figures.euler_characteristic;
    json["genus"] = figures.genus ? nlohmann::ordered_json(*figures.genus) : nlohmann::ordered_json(nullptr);
    return json;
}

} // namespace

std::string to_json(const BuildStatistics &statistics, std::span<const std::string> inputs, const std::string &output) {
    nlohmann::ordered_json json;
    json["inputs"] = inputs;
    json["output"] = output;
    json["outcome"] = to_string(statistics.outcome);
    json["input_bytes"] = statistics.input_bytes;
    json["vertices"] = statistics.vertices;
    json["triangles"] = statistics.triangles;
    json["samples"] = statistics.samples;
    json["made_points"] = statistics.made_points;
    json["points"] = statistics.points;
    json["two_sided_points"] = statistics.two_sided_points;
    json["depth"] = statistics.depth;
    json["voxel_size"] = statistics.voxel_size;
    json["file_bytes"] = statistics.file_bytes;
    json["bits_per_point"] = statistics.bits_per_point();
    json["ratio"] = statistics.ratio();
    json["seconds"] = statistics.seconds;
    json["peak_memory"] = peak_memory();
    json["attributes"] = nlohmann::ordered_json::array();
    for (const AttributeReport &line : statistics.attributes) {
        nlohmann::ordered_json entry{{"name", line.name}, {"fate", to_string(line.fate)}, {"note", line.note}};
        if (const Warning warning = warning_of(line); warning != Warning::none)
            entry["warning"] = entry_of(warning).name;
        if (!line.input.empty())
            entry["input"] = line.input;
        json["attributes"].push_back(std::move(entry));
    }
    for (const MeshFigures &figures : statistics.meshes)
        json["meshes"].push_back(json_of(figures));
    json["steps"] = nlohmann::ordered_json::array();
    for (const StepStatistics &step : statistics.steps)
        json["steps"].push_back({{"name", step.name}, {"seconds", step.seconds}, {"peak_memory", step.peak_memory}});
    return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

} // namespace pbm::build
