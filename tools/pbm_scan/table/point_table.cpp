#include "pbm_scan/table/point_table.h"

#include "pbm_scan/clouds/intensity.h"
#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/words.h"
#include "system/files/file_names.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace pbm::build {
namespace {

struct Spelling {
    std::string_view name;
    ColumnRole role;
};
constexpr std::array<Spelling, 27> kSpellings{{{"x", ColumnRole::x},
                                               {"y", ColumnRole::y},
                                               {"z", ColumnRole::z},
                                               {"nx", ColumnRole::nx},
                                               {"ny", ColumnRole::ny},
                                               {"nz", ColumnRole::nz},
                                               {"normal_x", ColumnRole::nx},
                                               {"normal_y", ColumnRole::ny},
                                               {"normal_z", ColumnRole::nz},
                                               {"normalx", ColumnRole::nx},
                                               {"normaly", ColumnRole::ny},
                                               {"normalz", ColumnRole::nz},
                                               {"r", ColumnRole::red},
                                               {"g", ColumnRole::green},
                                               {"b", ColumnRole::blue},
                                               {"rf", ColumnRole::red},
                                               {"gf", ColumnRole::green},
                                               {"bf", ColumnRole::blue},
                                               {"red", ColumnRole::red},
                                               {"green", ColumnRole::green},
                                               {"blue", ColumnRole::blue},
                                               {"rgb", ColumnRole::packed_colour},
                                               {"rgba", ColumnRole::packed_colour},
                                               {"intensity", ColumnRole::intensity},
                                               {"reflectance", ColumnRole::intensity},
                                               {"i", ColumnRole::intensity},
                                               {"scalar_intensity", ColumnRole::intensity}}};

bool has(const std::vector<ColumnRole> &roles, ColumnRole role) {
    return std::find(roles.begin(), roles.end(), role) != roles.end();
}

// The role of a column of degrees, or of the heights beside them.
ColumnRole geographic_role(std::string_view name) {
    const std::string known = lower_case(name);
    const auto is_any = [&](std::initializer_list<std::string_view> words) {
        return std::find(words.begin(), words.end(), known) != words.end();
    };
    if (is_any({"lon", "long", "lng", "longitude"}))
        return ColumnRole::x;
    if (is_any({"lat", "latitude"}))
        return ColumnRole::y;
    return is_any({"h", "height", "alt", "altitude", "elevation"}) ? ColumnRole::z : ColumnRole::none;
}

int axis_of(ColumnRole role, ColumnRole first) { return static_cast<int>(role) - static_cast<int>(first); }

// The bits of a packed colour: the low ones of a whole number, with a sign or without, and of any other number those
// of a float, as PCL writes them.
std::optional<std::uint32_t> packed_bits(double value) {
    constexpr double kMaxExact = 9007199254740992; // 2^53
    if (std::abs(value) <= kMaxExact && value == std::floor(value))
        return static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
    if (std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max()))
        return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    return std::nullopt;
}

// What is said of points without a colour.
std::string black_note(std::uint64_t missing) {
    return missing == 0
               ? ""
               : "; " + counted(missing, "point") + " without a colour " + (missing == 1 ? "is" : "are") + " black";
}

void keep_colours(PointTable &table, Surface &surface) {
    if (!table.packed.empty()) {
        for (const std::uint32_t packed : table.packed)
            surface.colours.push_back({static_cast<std::uint8_t>(packed >> 16), static_cast<std::uint8_t>(packed >> 8),
                                       static_cast<std::uint8_t>(packed)});
        surface.report.push_back({"colours", Fate::kept, "sRGB, 8 bits" + black_note(table.missing_packed)});
        return;
    }
    const ColourRange range = colour_range(table.colours, ColourNumbers::any);
    if (range.white == 0) {
        surface.report.push_back({"colours", Fate::dropped, "nearly all are above 65,535: these are no colours"});
        return;
    }
    std::uint64_t missing = 0;
    for (const glm::vec3 &c : table.colours) {
        const bool is_missing = !is_finite(glm::dvec3(c));
        missing += is_missing ? 1U : 0U;
        surface.colours.push_back(is_missing ? Rgb8{} : colour_bytes(c, range.factor()));
    }
    const char *const kept = range.white == 1     ? "sRGB, 0..1 to 8 bits"
                             : range.white == 255 ? "sRGB, 8 bits"
                                                  : "sRGB, 16 bits to 8";
    surface.report.push_back({"colours", Fate::kept, kept + range.note() + black_note(missing)});
}

} // namespace

std::vector<ColumnRole> roles_of(const std::vector<std::string> &names) {
    std::vector<ColumnRole> roles;
    for (const std::string &name : names) {
        const std::string known = lower_case(name);
        const auto found = std::find_if(kSpellings.begin(), kSpellings.end(),
                                        [&](const Spelling &spelling) { return spelling.name == known; });
        const ColumnRole role = found == kSpellings.end() ? ColumnRole::none : found->role;
        roles.push_back(has(roles, role) ? ColumnRole::none : role);
    }
    if (!has(roles, ColumnRole::x) && !has(roles, ColumnRole::y))
        for (std::size_t i = 0; i < names.size(); ++i)
            if (const ColumnRole role = geographic_role(names[i]); role != ColumnRole::none && !has(roles, role))
                roles[i] = role;
    for (const ColumnRole first : {ColumnRole::nx, ColumnRole::red}) {
        const auto next = [first](int i) { return static_cast<ColumnRole>(static_cast<int>(first) + i); };
        if (has(roles, first) && has(roles, next(1)) && has(roles, next(2)))
            continue;
        for (ColumnRole &role : roles)
            if (role >= first && role <= next(2))
                role = ColumnRole::none;
    }
    if (has(roles, ColumnRole::packed_colour))
        for (ColumnRole &role : roles)
            if (role >= ColumnRole::red && role <= ColumnRole::blue)
                role = ColumnRole::none;
    return roles;
}

void PointTable::resize(std::size_t count, const std::vector<ColumnRole> &roles) {
    positions.resize(count);
    normals.resize(has(roles, ColumnRole::nx) ? count : 0);
    colours.resize(has(roles, ColumnRole::red) ? count : 0);
    packed.resize(has(roles, ColumnRole::packed_colour) ? count : 0);
    intensities.resize(has(roles, ColumnRole::intensity) ? count : 0);
    fields.resize(static_cast<std::size_t>(
        std::count_if(roles.begin(), roles.end(), [](ColumnRole role) { return role >= ColumnRole::field; })));
    for (std::vector<double> &field : fields)
        field.resize(count);
}

std::vector<KeptColumn> keep_fields(const std::vector<std::string> &names, std::vector<ColumnRole> &roles,
                                    const ReadOptions &options, Surface &surface) {
    std::vector<std::size_t> free; // columns that could be fields
    std::vector<FieldOffer> offers;
    for (std::size_t i = 0; i < names.size(); ++i)
        if ((roles[i] == ColumnRole::none || roles[i] == ColumnRole::intensity) && names[i] != kSkippedColumn) {
            free.push_back(i);
            offers.push_back({names[i]});
        }
    const std::vector<FieldColumn> columns = field_columns(surface, options, offers, options.usual_fields);
    std::vector<KeptColumn> kept;
    int fields = 0;
    for (std::size_t k = 0; k < free.size(); ++k) {
        if (!columns[k].is_wanted())
            continue;
        ColumnRole &role = roles[free[k]];
        kept.push_back({free[k], columns[k]});
        if (role == ColumnRole::none)
            role = static_cast<ColumnRole>(static_cast<int>(ColumnRole::field) + fields++);
    }
    return kept;
}

void PointTable::set(std::size_t point, ColumnRole role, double value) {
    if (role >= ColumnRole::field) {
        fields[static_cast<std::size_t>(axis_of(role, ColumnRole::field))][point] = value;
        return;
    }
    switch (role) {
    case ColumnRole::none:
    case ColumnRole::field: return;
    case ColumnRole::x:
    case ColumnRole::y:
    case ColumnRole::z: positions[point][axis_of(role, ColumnRole::x)] = value; return;
    case ColumnRole::nx:
    case ColumnRole::ny:
    case ColumnRole::nz: normals[point][axis_of(role, ColumnRole::nx)] = static_cast<float>(value); return;
    case ColumnRole::red:
    case ColumnRole::green:
    case ColumnRole::blue: colours[point][axis_of(role, ColumnRole::red)] = static_cast<float>(value); return;
    case ColumnRole::packed_colour:
        if (const auto bits = packed_bits(value))
            packed[point] = *bits;
        else
            ++missing_packed;
        return;
    case ColumnRole::intensity: intensities[point] = value; return;
    }
}

void fill_surface(PointTable table, const std::vector<std::string> &names, const std::vector<ColumnRole> &roles,
                  std::span<const KeptColumn> kept, Surface &surface) {
    std::vector<bool> is_kept(table.positions.size());
    std::size_t missing = 0;
    for (std::size_t i = 0; i < is_kept.size(); ++i) {
        is_kept[i] = is_finite(table.positions[i]);
        missing += is_kept[i] ? 0U : 1U;
    }
    if (missing != 0) {
        const auto keep = [&](std::size_t i) { return is_kept[i]; };
        keep_from(table.positions, 0, keep);
        keep_from(table.normals, 0, keep);
        keep_from(table.colours, 0, keep);
        keep_from(table.packed, 0, keep);
        keep_from(table.intensities, 0, keep);
        for (std::vector<double> &field : table.fields)
            keep_from(field, 0, keep);
    }
    surface.report.push_back(
        {"x y z", Fate::kept,
         missing == 0 ? "positions" : "positions; " + counted(missing, "row") + " without coordinates left out"});
    surface.positions = std::move(table.positions);
    const auto x = static_cast<std::size_t>(std::find(roles.begin(), roles.end(), ColumnRole::x) - roles.begin());
    surface.convention.is_geographic = x < names.size() && geographic_role(names[x]) == ColumnRole::x;
    for (glm::vec3 &n : table.normals)
        n = is_finite(glm::dvec3(n)) ? n : glm::vec3(0);
    if (std::any_of(table.normals.begin(), table.normals.end(), [](const auto &n) { return n != glm::vec3(0); })) {
        surface.normals = std::move(table.normals);
        surface.report.push_back({"normals", Fate::kept, "normals"});
    } else if (!table.normals.empty()) {
        surface.report.push_back({"normals", Fate::converted, "all are zero: estimated anew"});
    }
    if (!table.colours.empty() || !table.packed.empty())
        keep_colours(table, surface);
    std::vector<std::string> fields;
    bool has_intensity = false;
    for (const KeptColumn &column : kept) {
        const ColumnRole role = roles[column.column];
        has_intensity = has_intensity || (role == ColumnRole::intensity && column.values.is_kept());
        if (role == ColumnRole::intensity)
            std::for_each(table.intensities.begin(), table.intensities.end(), [&](double v) { column.values.add(v); });
        else
            for (const double value : table.fields[static_cast<std::size_t>(axis_of(role, ColumnRole::field))])
                column.values.add(value);
        if (column.values.is_kept())
            fields.push_back(names[column.column]);
        else
            surface.report.push_back(field_report("column " + printable(names[column.column]), column.values, ""));
    }
    if (const auto at = std::find(roles.begin(), roles.end(), ColumnRole::intensity);
        at != roles.end() && !has_intensity) {
        const std::vector<float> intensities(table.intensities.begin(), table.intensities.end());
        use_intensities(names[static_cast<std::size_t>(at - roles.begin())], intensities, surface);
    }
    if (!fields.empty())
        surface.report.push_back({"columns " + listed(fields), Fate::kept, "fields"});
    std::vector<std::string> unused;
    for (std::size_t i = 0; i < names.size(); ++i)
        if (roles[i] == ColumnRole::none && names[i] != kSkippedColumn)
            unused.push_back(names[i]);
    if (!unused.empty())
        surface.report.push_back(
            {"columns " + listed(unused), Fate::dropped, "measurements that are not shown; --field NAME keeps one"});
}

} // namespace pbm::build
