#include "pbm_format/checking/advice.h"

#include "pbm_format/chunks/normal_cone.h"
#include "pbm_format/law/catalogue.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <optional>

namespace pbm {

namespace {

// "/home/..", "~/..", "C:\..", "\\server\..", "file:..".
bool looks_like_path(std::string_view text) {
    const auto drive = [&] {
        return text.size() > 2 && std::isalpha(static_cast<unsigned char>(text[0])) != 0 && text[1] == ':' &&
               (text[2] == '\\' || text[2] == '/');
    };
    return (text.starts_with('/') && text.find('/', 1) != std::string_view::npos) || text.starts_with("~/") ||
           text.starts_with("\\\\") || text.starts_with("file:") || drive();
}

// Keys whose values differ between runs.
bool tells_of_the_run(std::string key) {
    constexpr std::array<std::string_view, 16> kKeys{
        "time", "date",     "timestamp", "created",      "modified", "host", "hostname",   "machine",
        "user", "username", "threads",   "thread_count", "pid",      "cwd",  "build_time", "build_date"};
    std::transform(key.begin(), key.end(), key.begin(),
                   [](unsigned char c) { return c == '-' || c == ' ' ? '_' : static_cast<char>(std::tolower(c)); });
    return std::find(kKeys.begin(), kKeys.end(), key) != kKeys.end();
}

} // namespace

std::vector<Advice> advise_on_header(const FileHeader &header) {
    std::vector<Advice> advice;
    if ((header.optional_features & ~kFieldsFeature) != 0)
        advice.push_back(
            {broken("header.optional_feature", 48, "optional features that this program does not know are ignored",
                    kFieldsFeature, header.optional_features)});
    if (header.chunk_points != kDefaultChunkPoints)
        advice.push_back({broken("header.chunk_limit", 104, "the chunk limit is not the one that writers use",
                                 kDefaultChunkPoints, header.chunk_points)});
    return advice;
}

std::vector<Advice> advise_on_table(std::span<const SectionEntry> sections) {
    std::vector<Advice> advice;
    for (std::size_t i = 0; i < sections.size(); ++i) {
        const SectionEntry &entry = sections[i];
        const std::uint64_t at = kHeaderBytes + i * kSectionEntryBytes;
        if (!is_known(entry.type))
            advice.push_back(
                {broken("table.optional_section", at, "a section of a type that this program does not know is ignored",
                        {}, static_cast<std::uint32_t>(entry.type))});
        else if ((entry.flags & kCriticalFlag) == 0 && !traits_of(entry.type)->is_optional)
            advice.push_back({broken("table.not_critical", at + 6,
                                     std::string(to_string(entry.type)) + ": the critical flag is not set",
                                     kCriticalFlag, entry.flags)});
    }
    return advice;
}

std::vector<Advice> advise_on_metadata(ByteView metadata, std::uint64_t offset) {
    std::vector<Advice> advice;
    for (const MetadataMember &member : list_metadata(metadata)) {
        if (member.again)
            advice.push_back({broken("metadata.twice", offset, "a key is there twice", {}, member.key)});
        if (tells_of_the_run(member.key))
            advice.push_back(
                {broken("metadata.run", offset, "a key tells of the run, not of the model", {}, member.key)});
        if (looks_like_path(member.text))
            advice.push_back({broken("metadata.path", offset, "the value of " + member.key + " looks like a path", {},
                                     member.text)});
    }
    return advice;
}

namespace {

void advise_on_materials(const FileContents &contents, std::vector<Advice> &advice) {
    const ModelParameters &parameters = contents.model.parameters;
    std::array<bool, 256> used{};
    if (parameters.attributes.material)
        for (const std::uint8_t material : contents.model.levels.back().points.materials)
            used[material] = true;
    else
        used[0] = true;
    if (parameters.ground)
        used[parameters.ground->material] = true;
    const SectionEntry &section = *find_section(contents.sections, SectionType::materials);
    for (std::size_t m = 0; m < parameters.materials.size(); ++m)
        if (!used[m])
            advice.push_back({broken("parameter.unused_material", section.offset + m * section.element_bytes,
                                     "material " + std::to_string(m) + " is used by nothing")});
}

void advise_on_lights(const FileContents &contents, std::vector<Advice> &advice) {
    const Model &model = contents.model;
    const auto dark = [](std::span<const std::uint8_t> fractions) {
        return std::all_of(fractions.begin(), fractions.end(), [](std::uint8_t lit) { return lit == 0; });
    };
    for (std::size_t i = 0; i < model.parameters.lights.size(); ++i) {
        const SectionEntry &section = *find_section(contents.sections, SectionType::lights);
        const std::uint64_t at = section.offset + i * section.element_bytes;
        const auto &intensity = model.parameters.lights[i].intensity;
        const bool has_stream = static_cast<int>(i) < model.parameters.attributes.lights;
        const bool on_ground = i < model.images.ground_lit.size() && !dark(model.images.ground_lit[i].texels);
        if (std::all_of(intensity.begin(), intensity.end(), [](float channel) { return channel == 0; }))
            advice.push_back({broken("parameter.dark_light", at + 4, "light " + std::to_string(i) + " has no intensity",
                                     "above 0", 0)});
        else if (has_stream && !on_ground && dark(model.levels.back().points.shadows[i]))
            advice.push_back(
                {broken("parameter.dark_light", at, "everything lies in the shadow of light " + std::to_string(i))});
    }
}

constexpr double kMaxUsualCoordinate = 1e30;

// The largest absolute coordinate of the grid's corners.
double farthest_coordinate(const Grid &grid) {
    double farthest = 0;
    for (const double corner : grid.origin)
        farthest = std::max({farthest, std::abs(corner), std::abs(corner + grid.edge())});
    return farthest;
}

} // namespace

std::vector<Advice> advise_on_parameters(const FileContents &contents) {
    std::vector<Advice> advice;
    if (const int octants = std::popcount(contents.model.levels[1].masks[0]); octants == 1)
        advice.push_back({broken("parameter.loose_grid", find_section(contents.sections, SectionType::grid)->offset,
                                 "all points lie in one octant of the grid", "2..8", octants)});
    if (const double farthest = farthest_coordinate(contents.model.parameters.grid); farthest > kMaxUsualCoordinate)
        advice.push_back(
            {broken("parameter.far_grid", find_section(contents.sections, SectionType::grid)->offset,
                    "the grid reaches too far from the origin to be computed with", "at most 1e30", farthest)});
    advise_on_materials(contents, advice);
    advise_on_lights(contents, advice);
    return advice;
}

std::vector<Advice> advise_on_cones(const FileContents &contents, int threads) {
    std::vector<Advice> advice;
    const std::uint64_t entry_bytes = chunk_entry_bytes(contents.model.parameters.attributes);
    for (std::size_t level = 1; level < contents.directories.size(); ++level) {
        const std::vector<ChunkEntry> &chunks = contents.directories[level].chunks;
        const std::span<const std::uint16_t> normals = contents.model.levels[level].points.normals;
        const std::uint64_t at =
            find_section(contents.sections, SectionType::level_directory, static_cast<std::uint32_t>(level))->offset;
        std::vector<NormalCone> narrowest(chunks.size());
        parallel_for(chunks.size(), threads, [&](std::size_t i) {
            narrowest[i] = bound_normals(normals.subspan(chunks[i].first_point, chunks[i].shape.points));
        });
        for (std::size_t i = 0; i < chunks.size(); ++i)
            if (narrowest[i].cosine > chunks[i].cone.cosine)
                advice.push_back({.what = broken("point.loose_cone", at + i * entry_bytes + 36,
                                                 "the normal cone is wider than its normals need", narrowest[i].cosine,
                                                 chunks[i].cone.cosine),
                                  .chunk = static_cast<std::int64_t>(i)});
    }
    return advice;
}

} // namespace pbm
