#include "pbm_format/checking/advice.h"

#include "pbm_format/law/catalogue.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <functional>

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
    constexpr std::uint64_t kKnown = kFieldsFeature | kClosedFeature;
    if ((header.optional_features & ~kKnown) != 0)
        advice.push_back(
            {broken("header.optional_feature", 48, "optional features that this program does not know are ignored",
                    kKnown, header.optional_features)});
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

void UsedParameters::add(const UsedParameters &other) {
    const auto add_all = [](auto &to, const auto &from) {
        std::transform(to.begin(), to.end(), from.begin(), to.begin(), std::logical_or<>());
    };
    add_all(materials, other.materials);
    add_all(lit, other.lit);
    octants |= other.octants;
}

UsedParameters used_parameters(const PointAttributes &points) {
    UsedParameters used;
    for (const std::uint8_t material : points.materials)
        used.materials[material] = true;
    for (std::size_t light = 0; light < points.shadows.size(); ++light)
        used.lit[light] = std::any_of(points.shadows[light].begin(), points.shadows[light].end(),
                                      [](std::uint8_t lit) { return lit != 0; });
    return used;
}

namespace {

void advise_on_materials(const SectionEntry &section, const ModelParameters &parameters, const UsedParameters &used,
                         std::vector<Advice> &advice) {
    for (std::size_t m = 0; m < parameters.materials.size(); ++m)
        if (!(parameters.attributes.material ? used.materials[m] : m == 0) &&
            !(parameters.ground && parameters.ground->material == m))
            advice.push_back({broken("parameter.unused_material", section.offset + m * section.element_bytes,
                                     "material " + std::to_string(m) + " is used by nothing")});
}

void advise_on_lights(const SectionEntry *section, const ModelParameters &parameters, const UsedParameters &used,
                      const std::array<bool, kMaxLights> &lit_ground, std::vector<Advice> &advice) {
    for (std::size_t i = 0; i < parameters.lights.size(); ++i) {
        const std::uint64_t at = section->offset + i * section->element_bytes;
        const auto &intensity = parameters.lights[i].intensity;
        const bool has_stream = static_cast<int>(i) < parameters.attributes.lights;
        if (std::all_of(intensity.begin(), intensity.end(), [](float channel) { return channel == 0; }))
            advice.push_back({broken("parameter.dark_light", at + 4, "light " + std::to_string(i) + " has no intensity",
                                     "above 0", 0)});
        else if (has_stream && !lit_ground[i] && !used.lit[i])
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

std::vector<Advice> advise_on_parameters(std::span<const SectionEntry> sections, const ModelParameters &parameters,
                                         const UsedParameters &used, const std::array<bool, kMaxLights> &lit_ground) {
    std::vector<Advice> advice;
    const std::uint64_t grid_at = find_section(sections, SectionType::grid)->offset;
    if (const int octants = std::popcount(used.octants); octants == 1)
        advice.push_back(
            {broken("parameter.loose_grid", grid_at, "all points lie in one octant of the grid", "2..8", octants)});
    if (const double farthest = farthest_coordinate(parameters.grid); farthest > kMaxUsualCoordinate)
        advice.push_back(
            {broken("parameter.far_grid", grid_at, "the grid reaches too far from the origin to be computed with",
                    "at most 1e30", farthest)});
    advise_on_materials(*find_section(sections, SectionType::materials), parameters, used, advice);
    advise_on_lights(find_section(sections, SectionType::lights), parameters, used, lit_ground, advice);
    return advice;
}

Advice advise_on_cone(std::span<const SectionEntry> sections, const AttributeSet &set, const LooseCone &cone) {
    const std::uint64_t at =
        find_section(sections, SectionType::level_directory, static_cast<std::uint32_t>(cone.level))->offset;
    return {.what = broken("point.loose_cone", at + cone.chunk * chunk_entry_bytes(set) + 36,
                           "the normal cone is wider than its normals need", cone.narrowest, cone.stored),
            .chunk = static_cast<std::int64_t>(cone.chunk)};
}

} // namespace pbm
