#include "pbm_scan/conventions/crs.h"

#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace pbm::build {
namespace {

constexpr double kFoot = 0.3048, kSurveyFoot = 1200.0 / 3937;

// KEYWORD["name",1.5,...] with its first text and number.
struct WktNode {
    std::string_view keyword, name;
    std::optional<double> number;
    std::size_t parent = 0; // its own index: none
};

// The nodes of a text in their order; those that damaged texts still have.
std::vector<WktNode> nodes_of(std::string_view text) {
    constexpr std::size_t kMaxNodes = 4096;
    std::vector<WktNode> nodes;
    std::vector<std::size_t> open; // parents, the innermost last
    for (std::size_t at = 0; at < text.size() && nodes.size() < kMaxNodes;) {
        const char c = text[at];
        if (c == '"') {
            const std::size_t end = std::min(text.find('"', at + 1), text.size());
            if (!open.empty() && nodes[open.back()].name.empty())
                nodes[open.back()].name = text.substr(at + 1, end - at - 1);
            at = std::min(end + 1, text.size());
        } else if (c == ']' || c == ')') {
            if (!open.empty())
                open.pop_back();
            ++at;
        } else if (c == ',' || ends_word(c) || c == '[' || c == '(') {
            ++at;
        } else {
            const std::size_t end = std::min(text.find_first_of(",[]()\" \t\r\n", at), text.size());
            const std::string_view word = text.substr(at, end - at);
            double number = 0;
            if (end < text.size() && (text[end] == '[' || text[end] == '(')) {
                nodes.push_back({word, {}, {}, open.empty() ? nodes.size() : open.back()});
                open.push_back(nodes.size() - 1);
                at = end + 1;
                continue;
            }
            if (!open.empty() && !nodes[open.back()].number && is_number(word, number))
                nodes[open.back()].number = number;
            else if (!open.empty() && nodes[open.back()].name.empty())
                nodes[open.back()].name = word; // CS[ellipsoidal,2]
            at = std::max(end, at + 1);
        }
    }
    return nodes;
}

bool is_any(const WktNode &node, std::initializer_list<std::string_view> keywords) {
    return std::any_of(keywords.begin(), keywords.end(),
                       [&](auto keyword) { return same_word(node.keyword, keyword); });
}

std::optional<std::size_t> find(const std::vector<WktNode> &nodes, std::initializer_list<std::string_view> keywords) {
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (is_any(nodes[i], keywords))
            return i;
    return std::nullopt;
}

// The unit of length of a node, or of one of its axes; 0: none.
double metres_of(const std::vector<WktNode> &nodes, std::size_t of) {
    for (std::size_t i = of + 1; i < nodes.size(); ++i) {
        const std::size_t parent = nodes[i].parent;
        const bool is_own = parent == of || (is_any(nodes[parent], {"axis"}) && nodes[parent].parent == of);
        if (is_own && is_any(nodes[i], {"unit", "lengthunit"}) && nodes[i].number && *nodes[i].number > 0)
            return *nodes[i].number;
    }
    return 0;
}

} // namespace

CrsFacts facts_of_epsg(unsigned code) {
    const auto within = [code](unsigned first, unsigned last) { return code >= first && code <= last; };
    if (within(32601, 32660) || within(32701, 32760) || within(25828, 25838) || code == 3857) // UTM; of web maps
        return {CrsKind::projected, 1, 0};
    constexpr std::array<unsigned, 8> kGeographic{4258, 4269, 4326, 4937, 4979, 6318, 6319, 9057};
    if (std::find(kGeographic.begin(), kGeographic.end(), code) != kGeographic.end())
        return {CrsKind::geographic, 0, 0};
    return code == 4978 ? CrsFacts{CrsKind::geocentric, 1, 0} : CrsFacts{};
}

CrsFacts facts_of(std::string_view crs) {
    constexpr std::string_view kEpsg = "EPSG:";
    crs = trimmed(crs, " \t\r\n");
    if (crs.starts_with(kEpsg)) {
        std::uint64_t code = 0;
        append_digits(crs.data() + kEpsg.size(), crs.data() + std::min(crs.size(), kEpsg.size() + 9), code);
        return facts_of_epsg(static_cast<unsigned>(code));
    }
    const std::vector<WktNode> nodes = nodes_of(crs);
    CrsFacts facts;
    if (const auto heights = find(nodes, {"vert_cs", "vertcrs", "verticalcrs"}))
        facts.height_metres = metres_of(nodes, *heights);
    if (const auto map = find(nodes, {"projcs", "projcrs", "projectedcrs", "local_cs", "engcrs", "engineeringcrs"})) {
        facts.kind = CrsKind::projected;
        facts.metres = metres_of(nodes, *map);
        return facts;
    }
    const auto earth = find(nodes, {"geogcs", "geogcrs", "geographiccrs", "geodcrs", "geodeticcrs", "geoccs"});
    if (!earth)
        return facts;
    const auto system = find(nodes, {"cs"});
    const bool is_cartesian = system && same_word(nodes[*system].name, "cartesian");
    facts.kind = is_any(nodes[*earth], {"geoccs"}) || is_cartesian ? CrsKind::geocentric : CrsKind::geographic;
    facts.metres = facts.kind == CrsKind::geocentric ? metres_of(nodes, *earth) : 0;
    return facts;
}

Unit unit_of_metres(double metres) {
    struct Known {
        double metres;
        Unit unit;
    };
    constexpr std::array<Known, 7> kKnown{{{1, Unit::metre},
                                           {kFoot, Unit::foot},
                                           {kSurveyFoot, Unit::foot},
                                           {0.0254, Unit::inch},
                                           {0.01, Unit::centimetre},
                                           {0.001, Unit::millimetre},
                                           {1000, Unit::kilometre}}};
    for (const Known &known : kKnown)
        if (std::abs(metres - known.metres) <= 1e-7 * known.metres)
            return known.unit;
    return Unit::unknown;
}

std::string unit_name(double metres) {
    if (std::abs(metres - kSurveyFoot) <= 1e-7 * kSurveyFoot)
        return "US survey foot";
    const Unit unit = unit_of_metres(metres);
    return unit == Unit::unknown ? number_text(metres) + " m" : std::string(to_string(unit));
}

std::string short_crs(std::string_view wkt) {
    const std::vector<WktNode> nodes = nodes_of(wkt);
    if (nodes.empty() || nodes.front().name.empty())
        return "";
    std::string text = printable(nodes.front().name);
    for (std::size_t i = 1; i < nodes.size(); ++i)
        if (nodes[i].parent == 0 && is_any(nodes[i], {"id"}) && nodes[i].number)
            return text + " (" + printable(nodes[i].name) + ":" + number_text(*nodes[i].number) + ")";
    return text;
}

} // namespace pbm::build
