// What a run of pbm-render drew and cost, as text and as JSON.
#pragma once

#include "arguments.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_render/detail/streamed_model.h"
#include "web_page.h"

#include <cstdint>
#include <optional>
#include <string>

namespace pbm {

struct BenchStatistics {
    double min_ms = 0, median_ms = 0;
    std::uint64_t drawn_points = 0; // mean
};

struct VideoStatistics {
    std::uint64_t bytes = 0; // of the file, or of all frames
    double ms = 0;
};

struct RunStatistics {
    LookOptions look; // as drawn
    RenderStatistics drawn;
    double load_ms = 0, frame_ms = 0;
    double encode_ms = 0;                // after the picture was drawn
    bool is_encoded_while_drawn = false; // most of it
    StreamingStatistics cost;            // until the picture was drawn
    std::uint64_t file_bytes = 0;
    std::optional<BenchStatistics> bench;
    std::optional<VideoStatistics> video;
    std::optional<SequenceStatistics> sequence;
    std::optional<WebPageSizes> page;
};

// The lines for people; `camera` is that of the first picture.
std::string report(const RenderArguments &arguments, const Camera &camera, const RunStatistics &statistics);
// For programs: report.schema.json
std::string to_json(const RenderArguments &arguments, const RunStatistics &statistics);

} // namespace pbm
