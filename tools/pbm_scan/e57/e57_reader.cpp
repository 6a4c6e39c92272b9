#include "pbm_scan/e57/e57_reader.h"

#include "pbm_scan/clouds/intensity.h"
#include "pbm_scan/clouds/scan_grids.h"
#include "pbm_scan/clouds/stations.h"
#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/e57/e57_records.h"
#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/surface/placeholders.h"
#include "pbm_scan/surface/range_grid.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/text_number.h"

#include <glm/common.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace pbm::build {
namespace {

constexpr std::string_view kSignature = "ASTM-E57";

// What the report says of all scans.
struct Counts {
    std::uint64_t only_directions = 0, invalid = 0, without_colour = 0, without_normal = 0;
    std::size_t moved = 0;    // scans whose pose is not the identity
    std::size_t stations = 0; // scans of which the scanner's position is known
    bool wide_colours = false;
};

class E57Reader {
  public:
    E57Reader(E57Pages pages, E57Description description, const ReadOptions &options)
        : pages_(std::move(pages)), description_(std::move(description)), options_(options) {
        for (const E57Scan &scan : description_.scans) {
            has_colours_ = has_colours_ || (scan.has_colours() && scan.records > 0);
            has_normals_ = has_normals_ || (scan.has_normals() && scan.records > 0);
            has_turns_ = has_turns_ || (scan.pose && turns(*scan.pose));
            records_ += scan.records;
        }
    }

    Result<Surface> read() {
        if (Status checked = check(); !checked)
            return checked.error();
        choose_fields();
        for (const E57Scan &scan : description_.scans)
            if (scan.records > 0)
                if (Status status = read_scan(scan); !status)
                    return status.error();
        complete_station_ids(surface_);
        if (surface_.positions.empty() && records_ > 0)
            return bad_input("none of the " + std::to_string(records_) +
                             " points has a position: there is nothing to build");
        std::optional<std::string> grey;
        if (!has_colours_ && !intensities_.empty()) {
            GreyColours greys = grey_colours(intensities_);
            surface_.colours = std::move(greys.colours);
            grey = std::move(greys.note);
        }
        if (has_cells_)
            triangulated_ = triangulate_scans(surface_, grids_);
        intensity_ = settle_intensities("intensity", grey, keeps_intensity(), surface_);
        surface_.crs = description_.coordinates.substr(0, crs_bytes());
        report();
        return finished(std::move(surface_), options_);
    }

  private:
    // Whole characters of UTF-8, which expat has verified.
    std::size_t crs_bytes() const {
        const std::string &text = description_.coordinates;
        std::size_t bytes = std::min(text.size(), kMaxCrsBytes);
        while (bytes < text.size() && (static_cast<unsigned char>(text[bytes]) & 0xC0) == 0x80)
            --bytes;
        return bytes;
    }

    Status check() const {
        if (records_ == 0)
            return bad_input(description_.images > 0 && description_.scans.empty()
                                 ? "the file has images, but no scans: there is nothing to build"
                                 : "the file has no points: there is nothing to build");
        for (const E57Scan &scan : description_.scans)
            if (scan.records > 0 && !scan.is_cartesian() && !scan.is_spherical())
                return bad_input(scan.label + ": its points have neither cartesianX, Y and Z nor sphericalRange, "
                                              "Azimuth and Elevation; export the scan again",
                                 scan.offset);
        if (records_ >= std::numeric_limits<std::uint32_t>::max())
            return too_large(std::to_string(records_) + " points, the limit is 2^32 - 2: export fewer scans");
        return check_e57_records(description_.scans, pages_);
    }

    static bool turns(const E57Scan::Pose &pose) {
        return glm::dvec3(pose.rotation.x, pose.rotation.y, pose.rotation.z) != glm::dvec3(0);
    }

    // Sets a component of the vectors from index `first` on.
    template <class Vectors>
    static void set(Vectors &vectors, std::size_t first, E57Role role, E57Role x, std::span<const double> values) {
        using Number = typename Vectors::value_type::value_type;
        const auto axis = static_cast<glm::length_t>(static_cast<int>(role) - static_cast<int>(x));
        for (std::size_t i = 0; i < values.size(); ++i)
            vectors[first + i][axis] = static_cast<Number>(values[i]);
    }

    static bool is_numeric(const E57Field &field) { return field.type != E57Type::text; }

    // Of all scans that have it.
    void choose_fields() {
        std::vector<FieldOffer> offers;
        for (const E57Scan &scan : description_.scans)
            for (const E57Field &field : scan.fields) {
                const bool is_offered =
                    is_numeric(field) && (field.role == E57Role::none || field.role == E57Role::intensity);
                const auto is_same = [&](const FieldOffer &known) { return known.name == field.name; };
                if (is_offered && std::none_of(offers.begin(), offers.end(), is_same))
                    offers.push_back({field.name});
            }
        const std::vector<FieldColumn> columns = field_columns(surface_, options_, offers, options_.usual_fields);
        for (std::size_t i = 0; i < offers.size(); ++i)
            if (columns[i].is_wanted())
                columns_.emplace_back(offers[i].name, columns[i]);
    }

    bool keeps_intensity() const {
        return std::any_of(columns_.begin(), columns_.end(),
                           [](const auto &column) { return column.first == "intensity" && column.second.is_kept(); });
    }

    // The column of a field that is kept, or null.
    const FieldColumn *column_of(const E57Field &field) const {
        const auto found = std::find_if(columns_.begin(), columns_.end(),
                                        [&](const auto &column) { return column.first == field.name; });
        return found == columns_.end() || !is_numeric(field) ? nullptr : &found->second;
    }

    void take(const E57Field &field, std::size_t first, std::span<const double> values) {
        const std::size_t at = first_ + first;
        if (const FieldColumn *const column = column_of(field)) {
            for (std::size_t i = 0; i < values.size(); ++i)
                column->set(at + i, values[i]);
        }
        const E57Role role = field.role;
        if (role == E57Role::none)
            return;
        if (role <= E57Role::z) {
            if (cartesian_)
                set(surface_.positions, at, role, E57Role::x, values);
        } else if (role <= E57Role::elevation) {
            if (!cartesian_)
                set(surface_.positions, at, role, E57Role::range, values);
        } else if (role == (cartesian_ ? E57Role::cartesian_state : E57Role::spherical_state)) {
            for (std::size_t i = 0; i < values.size(); ++i)
                states_[first + i] = values[i] == 0 ? 0 : values[i] == 1 ? 1 : 2;
        } else if (role >= E57Role::red && role <= E57Role::blue) {
            if (colours_)
                take_colours(field, at, values);
        } else if (role == E57Role::colour_state) {
            for (std::size_t i = 0; i < values.size(); ++i)
                colourless_[first + i] = values[i] != 0;
        } else if (role == E57Role::intensity && !intensities_.empty()) {
            std::copy(values.begin(), values.end(), intensities_.begin() + static_cast<std::ptrdiff_t>(at));
        } else if (role == E57Role::row || role == E57Role::column) {
            if (!cells_.empty())
                set(cells_, first, role, E57Role::row, values);
        } else if (role >= E57Role::nx && role <= E57Role::nz && normals_) {
            set(surface_.normals, at, role, E57Role::nx, values);
        }
    }

    void take_colours(const E57Field &field, std::size_t at, std::span<const double> values) {
        const auto channel = static_cast<std::size_t>(static_cast<int>(field.role) - static_cast<int>(E57Role::red));
        if (!field.high) {
            for (std::size_t i = 0; i < values.size(); ++i)
                open_colours_[at - first_ + i][static_cast<int>(channel)] = static_cast<float>(values[i]);
            return;
        }
        counts_.wide_colours = counts_.wide_colours || *field.low != 0 || *field.high != 255;
        const double factor = 255 / (*field.high - *field.low);
        for (std::size_t i = 0; i < values.size(); ++i)
            surface_.colours[at + i][channel] = colour_byte((values[i] - *field.low) * factor);
    }

    static std::uint8_t colour_byte(double value) {
        return value + 0.5 >= 0 ? static_cast<std::uint8_t>(std::min(value + 0.5, 255.0)) : std::uint8_t{0};
    }

    // Colours of fields without limits have the range of nearly all.
    void convert_open_colours(const E57Scan &scan) {
        const ColourRange range = colour_range(open_colours_, ColourNumbers::any);
        open_ranges_.emplace_back(&scan, range);
        if (range.white == 0) {
            std::fill(surface_.colours.begin() + static_cast<std::ptrdiff_t>(first_), surface_.colours.end(),
                      options_.default_material.colour);
            return;
        }
        const double factor = static_cast<double>(range.factor());
        for (int channel = 0; channel < 3; ++channel)
            if (!scan.field(static_cast<E57Role>(static_cast<int>(E57Role::red) + channel))->high)
                for (std::size_t i = 0; i < open_colours_.size(); ++i)
                    surface_.colours[first_ + i][static_cast<std::size_t>(channel)] =
                        colour_byte(static_cast<double>(open_colours_[i][channel]) * factor);
    }

    Status read_scan(const E57Scan &scan) {
        first_ = surface_.positions.size();
        const std::size_t count = first_ + static_cast<std::size_t>(scan.records);
        cartesian_ = scan.is_cartesian();
        colours_ = scan.has_colours();
        normals_ = scan.has_normals();
        surface_.positions.resize(count);
        if (has_colours_)
            surface_.colours.resize(count, options_.default_material.colour);
        else if (scan.field(E57Role::intensity) != nullptr || !intensities_.empty())
            intensities_.resize(count, std::numeric_limits<float>::quiet_NaN());
        if (has_normals_)
            surface_.normals.resize(count, glm::vec3(0.0F));
        for (const auto &column : columns_)
            column.second.resize(count);
        open_colours_.assign(scan.has_open_colours() ? count - first_ : 0, glm::vec3(0));
        const bool has_states = scan.field(cartesian_ ? E57Role::cartesian_state : E57Role::spherical_state) != nullptr;
        states_.assign(has_states ? count - first_ : 0, 0);
        colourless_.assign(scan.field(E57Role::colour_state) != nullptr ? count - first_ : 0, 0);
        const bool has_cells = scan.has_all({E57Role::row, E57Role::column});
        has_cells_ = has_cells_ || has_cells;
        cells_.assign(has_cells ? count - first_ : 0, glm::dvec2(0));
        E57Sink sink;
        sink.values = [this](const E57Field &field, std::uint64_t first, std::span<const double> values) {
            take(field, static_cast<std::size_t>(first), values);
        };
        sink.wants = [this](const E57Field &field) { return column_of(field) != nullptr; };
        if (options_.progress)
            sink.progress = [&](double done) {
                options_.progress((static_cast<double>(first_) + done * static_cast<double>(scan.records)) /
                                  static_cast<double>(records_));
            };
        const Result<bool> more = read_e57_records(scan, pages_, sink);
        if (!more)
            return more.error();
        if (*more)
            surface_.report.push_back(
                {scan.label, Fate::dropped,
                 "it has points beyond the " + std::to_string(scan.records) + " that the XML section counts"});
        if (!cartesian_)
            from_spherical();
        if (!open_colours_.empty())
            convert_open_colours(scan);
        if (!colourless_.empty() && colours_)
            remove_colours();
        if (has_states)
            leave_out_invalid();
        if (!options_.keep_placeholders)
            leave_out_placeholders();
        move(scan);
        if (surface_.positions.size() > first_)
            grids_.push_back(grid_of_cells());
        return {};
    }

    // Without columns where points share a cell, or where most cells are empty.
    ScanGrid grid_of_cells() const {
        constexpr double kMaxCellsPerPoint = 16;
        if (cells_.empty())
            return {};
        glm::dvec2 lowest(std::numeric_limits<double>::infinity()), highest(-lowest);
        for (const glm::dvec2 &cell : cells_) {
            lowest = glm::min(lowest, cell);
            highest = glm::max(highest, cell);
        }
        const glm::dvec2 size = highest - lowest + 1.0; // rows, columns
        if (!(size.x * size.y <= kMaxCellsPerPoint * static_cast<double>(cells_.size())))
            return {};
        ScanGrid grid{{}, static_cast<std::size_t>(size.y)};
        grid.cells.resize(static_cast<std::size_t>(size.x) * grid.columns, kEmptyCell);
        for (std::size_t i = 0; i < cells_.size(); ++i) {
            const glm::dvec2 at = cells_[i] - lowest;
            std::uint32_t &cell =
                grid.cells[static_cast<std::size_t>(at.x) * grid.columns + static_cast<std::size_t>(at.y)];
            if (cell != kEmptyCell)
                return {};
            cell = static_cast<std::uint32_t>(first_ + i);
        }
        return grid;
    }

    void from_spherical() {
        for (std::size_t i = first_; i < surface_.positions.size(); ++i) {
            glm::dvec3 &p = surface_.positions[i];
            const double range = p.x, azimuth = p.y, elevation = p.z;
            p = range * glm::dvec3(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                   std::sin(elevation));
        }
    }

    void remove_colours() {
        for (std::size_t i = 0; i < colourless_.size(); ++i)
            if (colourless_[i] != 0) {
                surface_.colours[first_ + i] = options_.default_material.colour;
                ++counts_.without_colour;
            }
    }

    void leave_out_invalid() {
        counts_.only_directions += static_cast<std::uint64_t>(std::count(states_.begin(), states_.end(), 1));
        counts_.invalid += static_cast<std::uint64_t>(std::count(states_.begin(), states_.end(), 2));
        keep_records([this](std::size_t i) { return states_[i] == 0; });
    }

    // In the scanner's coordinates, of which 0 0 0 is the scanner itself.
    void leave_out_placeholders() {
        Placeholders found;
        const Bytes marks = mark_placeholders(surface_.positions, first_, found);
        if (marks.empty())
            return;
        placeholders_.at_zero += found.at_zero;
        placeholders_.at_sentinels += found.at_sentinels;
        keep_records([&](std::size_t i) { return marks[first_ + i] == 0; });
    }

    // Removes the records of the scan for which keep(record) is false.
    template <class Keep> void keep_records(const Keep &keep) {
        const auto keep_position = [&](std::size_t i) { return keep(i - first_); };
        keep_from(surface_.positions, first_, keep_position);
        for_vertex_attributes([&](auto &values) { keep_from(values, first_, keep_position); }, surface_);
        keep_from(intensities_, first_, keep_position);
        keep_from(cells_, 0, keep);
    }

    void move(const E57Scan &scan) {
        const E57Scan::Pose pose = scan.pose.value_or(E57Scan::Pose{});
        const bool shifts = pose.translation != glm::dvec3(0);
        counts_.moved += turns(pose) || shifts ? 1U : 0U;
        if (turns(pose)) {
            const glm::dmat3 turn = glm::mat3_cast(pose.rotation);
            for (std::size_t i = first_; i < surface_.positions.size(); ++i)
                surface_.positions[i] = turn * surface_.positions[i];
            for (std::size_t i = first_; i < surface_.normals.size(); ++i)
                surface_.normals[i] = glm::vec3(turn * glm::dvec3(surface_.normals[i]));
        }
        if (normals_)
            clear_bad_normals();
        if (shifts)
            for (std::size_t i = first_; i < surface_.positions.size(); ++i)
                surface_.positions[i] += pose.translation;
        if ((has_turns_ && scan.pose) || !cartesian_ || scan.has_all({E57Role::row, E57Role::column}))
            counts_.stations += add_station(surface_, first_, pose.translation) ? 1U : 0U;
    }

    void clear_bad_normals() {
        for (std::size_t i = first_; i < surface_.normals.size(); ++i) {
            glm::vec3 &normal = surface_.normals[i];
            if (!is_finite(glm::dvec3(normal)))
                normal = glm::vec3(0.0F);
            counts_.without_normal += normal == glm::vec3(0.0F) ? 1U : 0U;
        }
    }

    // The fate of a field.
    AttributeReport outcome(const E57Field &field, const E57Scan &scan) const {
        using enum Fate;
        const E57Role role = field.role;
        if (const FieldColumn *const column = column_of(field);
            column != nullptr && (role == E57Role::none || !column->is_kept()))
            return {field.name, kept, column->note()};
        if (role == E57Role::none)
            return {field.name, dropped,
                    std::string(field.name.find(':') == std::string::npos ? "a measurement that is not shown"
                                                                          : "of an extension that PBM does not know") +
                        (field.type == E57Type::text ? "" : "; --field keeps it")};
        if (role <= E57Role::elevation) {
            if (role <= E57Role::z && scan.is_cartesian())
                return {field.name, kept, "positions"};
            if (role > E57Role::z && scan.is_spherical() && !scan.is_cartesian())
                return {field.name, converted, "to positions"};
            return {field.name, dropped, "the scan has whole positions in other coordinates"};
        }
        if (role <= E57Role::spherical_state) {
            if ((role == E57Role::cartesian_state) != scan.is_cartesian())
                return {field.name, dropped, "the scan has whole positions in other coordinates"};
            return {field.name, converted,
                    counted(counts_.only_directions, "point") + " with a direction only and " +
                        counted(counts_.invalid, "point") + " without a position left out"};
        }
        if (role <= E57Role::blue) {
            if (!scan.has_colours())
                return {field.name, dropped, "a colour needs red, green and blue"};
            if (!field.high)
                return open_colour_outcome(field, scan);
            return counts_.wide_colours ? AttributeReport{field.name, converted, "sRGB, from its limits to 8 bits"}
                                        : AttributeReport{field.name, kept, "sRGB"};
        }
        if (role == E57Role::colour_state)
            return {field.name, converted,
                    counted(counts_.without_colour, "point") + " without a colour have the default one"};
        if (role == E57Role::intensity)
            return intensity_;
        if (role >= E57Role::nx && role <= E57Role::nz)
            return scan.has_normals() ? AttributeReport{field.name, kept, normals_note()}
                                      : AttributeReport{field.name, dropped, "a normal needs three numbers"};
        return {field.name, triangulated_.fate, triangulated_.note}; // rows and columns
    }

    AttributeReport open_colour_outcome(const E57Field &field, const E57Scan &scan) const {
        const auto found = std::find_if(open_ranges_.begin(), open_ranges_.end(),
                                        [&](const auto &known) { return known.first == &scan; });
        const ColourRange range = found == open_ranges_.end() ? ColourRange{} : found->second;
        if (range.white == 0)
            return {field.name, Fate::dropped, "nearly all are above 65,535: these are no colours"};
        return {field.name, Fate::converted,
                "sRGB, from 0.." + number_text(static_cast<double>(range.white)) +
                    " to 8 bits: the file has no limits of them" + range.note()};
    }

    std::string normals_note() const {
        return counts_.without_normal == 0
                   ? "normals"
                   : std::to_string(counts_.without_normal) + " have no length: taken from their neighbours";
    }

    // One line for each run of fields with the same fate.
    void report_fields() {
        std::vector<AttributeReport> lines;
        const auto same = [](const AttributeReport &a, const AttributeReport &b) {
            return a.fate == b.fate && a.note == b.note;
        };
        std::vector<AttributeReport> fields;
        for (const E57Scan &scan : description_.scans)
            for (const E57Field &field : scan.fields) {
                AttributeReport line = outcome(field, scan);
                const bool is_new = std::none_of(fields.begin(), fields.end(), [&](const AttributeReport &other) {
                    return other.name == line.name && same(other, line);
                });
                if (is_new)
                    fields.push_back(std::move(line));
            }
        constexpr std::size_t kMaxLines = 256;
        if (fields.size() > kMaxLines)
            fields.resize(kMaxLines);
        for (AttributeReport &field : fields) {
            field.name = printable(field.name);
            if (!lines.empty() && same(lines.back(), field))
                lines.back().name += " " + field.name;
            else
                lines.push_back({"points." + field.name, field.fate, field.note});
        }
        surface_.report.insert(surface_.report.end(), lines.begin(), lines.end());
    }

    void report() {
        std::vector<AttributeReport> &lines = surface_.report;
        const std::size_t scans = description_.scans.size();
        lines.push_back(
            {"data3D", Fate::kept,
             counted(scans, "scan") +
                 (counts_.moved > 0 ? ", " + std::to_string(counts_.moved) + " moved by their poses" : "")});
        report_fields();
        if (placeholders_.sum() != 0)
            lines.push_back({"placeholders", Fate::converted, placeholders_.note()});
        if (counts_.stations > 0)
            lines.push_back(
                {"scanner positions", Fate::kept, std::to_string(counts_.stations) + " of " + counted(scans, "scan")});
        const auto groups = std::count_if(description_.scans.begin(), description_.scans.end(),
                                          [](const E57Scan &scan) { return scan.has_groups; });
        if (groups > 0)
            lines.push_back({"pointGroupingSchemes", Fate::dropped, "points have no groups in PBM"});
        if (description_.images > 0)
            lines.push_back(
                {"images2D", Fate::dropped, counted(description_.images, "image") + ": PBM stores point colours"});
        if (description_.coordinates.size() > kMaxCrsBytes)
            lines.push_back({"coordinateMetadata", Fate::converted,
                             "cut off after " + std::to_string(surface_.crs.size()) + " bytes"});
        else if (!description_.coordinates.empty())
            lines.push_back({"coordinateMetadata", Fate::kept, "coordinate reference system"});
        for (const std::string &extension : description_.extensions)
            if (extension != "nor")
                lines.push_back({"extension " + printable_in_quotes(extension), Fate::dropped, "not known to PBM"});
        const auto elements = [](const std::set<std::string> &names) {
            return "elements " + listed(std::vector<std::string>(names.begin(), names.end()));
        };
        if (!description_.about.empty())
            lines.push_back({elements(description_.about), Fate::kept, "not needed: they describe no single points"});
        if (!description_.unused.empty())
            lines.push_back({elements(description_.unused), Fate::dropped, "not known to PBM"});
        report_trailing(lines, pages_.trailing_bytes(), "after the last page");
    }

    E57Pages pages_;
    const E57Description description_;
    const ReadOptions &options_;
    Surface surface_;
    Counts counts_;
    std::vector<std::pair<const E57Scan *, ColourRange>> open_ranges_; // of scans whose colours have no limits
    Placeholders placeholders_;
    bool has_colours_ = false, has_normals_ = false;                // in one of the scans
    bool has_turns_ = false;                                        // the pose of a scan turns it
    std::uint64_t records_ = 0;                                     // of all scans
    std::vector<float> intensities_;                                // [positions], or empty; NaN: none
    std::vector<std::pair<std::string_view, FieldColumn>> columns_; // of fields that are kept, by their names
    bool has_cells_ = false;                                        // a scan has rows and columns
    std::vector<ScanGrid> grids_;                                   // of the scans with positions
    AttributeReport intensity_{};
    AttributeReport triangulated_{"", Fate::dropped, "a grid needs rows and columns"};

    // Of the scan that is read:
    std::size_t first_ = 0; // its first position
    bool cartesian_ = false, colours_ = false, normals_ = false;
    Bytes states_;                        // [records] 1: a direction only, 2: invalid; or empty
    Bytes colourless_;                    // [records] 1: no colour; or empty
    std::vector<glm::vec3> open_colours_; // [records] of fields without limits; or empty
    std::vector<glm::dvec2> cells_;       // [records] row and column; or empty
};

} // namespace

bool is_e57(std::span<const std::uint8_t> bytes) { return as_text(bytes).starts_with(kSignature); }

Result<Surface> read_e57(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    Result<E57Pages> pages = E57Pages::open(bytes);
    if (!pages)
        return pages.error();
    const Result<E57Xml> xml = read_e57_xml(*pages);
    if (!xml)
        return xml.error();
    Result<E57Description> description = describe_e57(*xml, *pages);
    if (!description)
        return description.error();
    return E57Reader(std::move(*pages), std::move(*description), options).read();
}

} // namespace pbm::build
