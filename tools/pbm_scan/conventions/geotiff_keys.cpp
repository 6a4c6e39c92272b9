#include "pbm_scan/conventions/geotiff_keys.h"

#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"

#include <optional>

namespace pbm::build {
namespace {

enum Key : std::uint16_t {
    model_type = 1024,
    citation = 1026,
    geographic_type = 2048,
    geographic_citation = 2049,
    projected_type = 3072,
    projected_citation = 3073,
    length_unit = 3076,
    length_metres = 3077,
    vertical_type = 4096,
    vertical_citation = 4097,
    vertical_unit = 4099,
};
constexpr std::uint16_t kInNumbers = 34736, kInTexts = 34737, kUserDefined = 32767;

class GeotiffKeys {
  public:
    explicit GeotiffKeys(const GeotiffRecords &records) : records_(records) {}

    std::optional<std::uint16_t> number(Key key) const {
        const auto entry = find(key);
        return entry && entry->place == 0 ? std::optional(entry->value) : std::nullopt;
    }
    std::optional<double> real(Key key) const {
        const auto entry = find(key);
        if (!entry || entry->place != kInNumbers || records_.numbers.size() / 8 <= entry->value)
            return std::nullopt;
        return load<double>(records_.numbers.data() + std::size_t{8} * entry->value);
    }
    std::string text(Key key) const {
        const auto entry = find(key);
        const std::string_view all = as_text(records_.texts);
        if (!entry || entry->place != kInTexts || entry->value > all.size())
            return "";
        const std::string_view own = all.substr(entry->value, entry->count);
        return std::string(trimmed(own.substr(0, own.find_first_of(std::string_view("|\0", 2))), " \t\r\n"));
    }

  private:
    struct Entry {
        std::uint16_t place, count, value;
    };
    std::optional<Entry> find(Key key) const {
        constexpr std::size_t kEntry = 8; // also the head: version, revision, and the number of entries
        for (std::size_t at = kEntry; at + kEntry <= records_.keys.size(); at += kEntry) {
            const std::uint8_t *const entry = records_.keys.data() + at;
            if (load<std::uint16_t>(entry) == key)
                return Entry{load<std::uint16_t>(entry + 2), load<std::uint16_t>(entry + 4),
                             load<std::uint16_t>(entry + 6)};
        }
        return std::nullopt;
    }

    const GeotiffRecords &records_;
};

double metres_of_unit(unsigned code) {
    constexpr unsigned kMetre = 9001, kFootCode = 9002, kSurveyFootCode = 9003, kKilometre = 9036;
    return code == kMetre            ? 1
           : code == kFootCode       ? 0.3048
           : code == kSurveyFootCode ? 1200.0 / 3937
           : code == kKilometre      ? 1000
                                     : 0;
}

// "EPSG:25832", or the text that stands for a CRS of the user's own.
std::string crs_name(std::optional<std::uint16_t> code, const std::string &given) {
    if (code && *code != kUserDefined && *code != 0)
        return "EPSG:" + std::to_string(*code) + (given.empty() ? "" : " (" + given + ")");
    return given;
}

} // namespace

GeotiffCrs read_geotiff(const GeotiffRecords &records) {
    const GeotiffKeys keys(records);
    constexpr std::uint16_t kProjected = 1, kGeographic = 2, kGeocentric = 3;
    const auto projected = keys.number(projected_type), geographic = keys.number(geographic_type);
    const std::uint16_t model = keys.number(model_type)
                                    .value_or(projected    ? kProjected
                                              : geographic ? kGeographic
                                                           : std::uint16_t{0});
    GeotiffCrs crs;
    std::vector<std::string> parts;
    const auto add = [&](const std::string &label, const std::string &text) {
        if (!text.empty())
            parts.push_back(label + text);
    };
    if (model == kProjected) {
        const std::string given = keys.text(projected_citation);
        crs.facts = facts_of_epsg(projected.value_or(0));
        crs.facts.kind = CrsKind::projected;
        add("", crs_name(projected, given.empty() ? keys.text(citation) : given));
    } else if (model == kGeographic || model == kGeocentric) {
        const std::string given = keys.text(geographic_citation);
        crs.facts.kind = model == kGeographic ? CrsKind::geographic : CrsKind::geocentric;
        add("", crs_name(geographic, given.empty() ? keys.text(citation) : given));
    }
    if (const auto unit = keys.number(length_unit); unit && model != kGeographic) {
        const double own = keys.real(length_metres).value_or(0);
        crs.facts.metres = *unit == kUserDefined ? own : metres_of_unit(*unit);
        if (crs.facts.metres > 0)
            add("unit ",
                unit_name(crs.facts.metres) + (*unit == kUserDefined ? "" : " (EPSG:" + std::to_string(*unit) + ")"));
    }
    add("heights ", crs_name(keys.number(vertical_type), keys.text(vertical_citation)));
    if (const auto unit = keys.number(vertical_unit)) {
        crs.facts.height_metres = metres_of_unit(*unit);
        if (crs.facts.height_metres > 0 && crs.facts.height_metres != crs.facts.metres)
            add("heights in ", unit_name(crs.facts.height_metres));
    }
    for (const std::string &part : parts)
        (crs.text += crs.text.empty() ? "" : "; ") += part;
    return crs;
}

} // namespace pbm::build
