#include "mutants/count.h"

#include "mutants/count_text.h"

#include <cstring>
#include <map>
#include <set>

namespace pbm::mutants {
namespace {

void add_face(Announced &sum, const std::vector<long long> &corners) {
    const std::size_t different = std::set<long long>(corners.begin(), corners.end()).size();
    const std::uint64_t most = corners.size() < 3 ? 1 : corners.size() - 2;
    sum.max_triangles += most;
    sum.min_triangles += different == corners.size() ? most : 1;
}

const std::map<std::string, int> kStatements{
    {"v", 0},      {"vt", 0},     {"vn", 0},   {"vp", 0},         {"f", 0},        {"fo", 0},       {"l", 0},
    {"p", 0},      {"s", 0},      {"mg", 0},   {"curv", 0},       {"curv2", 0},    {"surf", 0},     {"cstype", 0},
    {"deg", 0},    {"bmat", 0},   {"step", 0}, {"parm", 0},       {"trim", 0},     {"hole", 0},     {"scrv", 0},
    {"sp", 0},     {"end", 0},    {"con", 0},  {"bevel", 0},      {"c_interp", 0}, {"d_interp", 0}, {"ctech", 0},
    {"stech", 0},  {"call", 0},   {"csh", 0},  {"g", 1},          {"o", 1},        {"mtllib", 1},   {"usemtl", 1},
    {"usemap", 1}, {"maplib", 1}, {"lod", 1},  {"shadow_obj", 1}, {"trace_obj", 1}}; // 1: the statement takes names

} // namespace

std::optional<Announced> count_obj(std::string_view bytes) {
    Announced sum;
    const std::vector<std::string> all = lines(without_mark(bytes));
    for (std::size_t i = 0; i < all.size(); ++i) {
        std::string line = all[i];
        const Words first = words(line);
        const auto known = first.empty() ? kStatements.end() : kStatements.find(first[0]);
        const bool naming = known != kStatements.end() && known->second == 1;
        while (i + 1 < all.size() && line.find('#') == std::string::npos) {
            const std::size_t last = line.find_last_not_of(" \t\v\f\r");
            if (last == std::string::npos || line[last] != '\\')
                break;
            const Words next = words(all[i + 1]);
            if (naming && !next.empty() && kStatements.count(next[0]) != 0)
                break;
            line = line.substr(0, last) + " " + all[++i];
        }
        const Words w = words(line.substr(0, line.find('#')));
        if (w.empty())
            continue;
        if (w[0] == "v")
            ++sum.vertices;
        if (w[0] != "f" && w[0] != "fo")
            continue;
        std::vector<long long> corners;
        for (std::size_t k = 1; k < w.size(); ++k) {
            long long corner = 0;
            if (!whole_number(w[k].substr(0, w[k].find('/')), corner))
                return std::nullopt;
            corners.push_back(corner < 0 ? corner + 1 + static_cast<long long>(sum.vertices) : corner);
        }
        add_face(sum, corners);
    }
    return sum;
}

namespace {

// With words anywhere; a vertex has so many numbers, and nothing stands behind the last face.
std::optional<Announced> count_off_words(const Words &all, std::size_t numbers) {
    std::size_t at = 0;
    const auto next = [&](long long &value) { return at < all.size() && whole_number(all[at++], value) && value >= 0; };
    long long vertices = 0, faces = 0, edges = 0;
    if (!next(vertices) || !next(faces) || !next(edges) ||
        all.size() - at < static_cast<std::size_t>(vertices) * numbers)
        return std::nullopt;
    Announced sum{.vertices = static_cast<std::uint64_t>(vertices)};
    at += static_cast<std::size_t>(vertices) * numbers;
    for (long long i = 0; i < faces; ++i) {
        long long size = 0;
        if (!next(size) || all.size() - at < static_cast<std::size_t>(size))
            return std::nullopt;
        std::vector<long long> corners(static_cast<std::size_t>(size));
        for (long long &corner : corners)
            if (!next(corner))
                return std::nullopt;
        add_face(sum, corners);
    }
    return at == all.size() ? std::optional(sum) : std::nullopt;
}

std::optional<Announced> count_off_lines(std::string_view bytes) {
    std::vector<Words> rows; // without comments and empty lines
    for (const std::string &line : lines(without_mark(bytes)))
        if (Words w = words(line.substr(0, line.find('#'))); !w.empty())
            rows.push_back(std::move(w));
    const std::size_t off = rows.empty() ? std::string::npos : rows[0][0].find("OFF");
    if (off == std::string::npos)
        return std::nullopt;
    std::size_t row = 0;
    rows[0][0].erase(0, off + 3); // "OFF8 12 0"
    if (rows[0][0].empty())
        rows[0].erase(rows[0].begin());
    if (rows[0].empty())
        ++row;
    long long vertices = 0, faces = 0;
    if (row == rows.size() || rows[row].size() < 2 || !whole_number(rows[row][0], vertices) ||
        !whole_number(rows[row][1], faces) || vertices < 0 || faces < 0)
        return std::nullopt;
    ++row;
    const std::size_t rows_of_scan = static_cast<std::size_t>(vertices) + static_cast<std::size_t>(faces);
    if (rows.size() - row < rows_of_scan)
        return std::nullopt;
    Announced sum{.vertices = static_cast<std::uint64_t>(vertices)};
    if (rows.size() - row > rows_of_scan) { // text behind the last face, but no further row
        if (double value = 0; is_number(rows[row + rows_of_scan][0], value))
            return std::nullopt;
        sum.something_unknown = true;
        rows.resize(row + rows_of_scan);
    }
    for (row += static_cast<std::size_t>(vertices); row < rows.size(); ++row) {
        long long size = 0;
        if (!whole_number(rows[row][0], size) || size < 0 || rows[row].size() < static_cast<std::size_t>(size) + 1)
            return std::nullopt;
        std::vector<long long> corners(static_cast<std::size_t>(size));
        for (std::size_t k = 0; k < corners.size(); ++k)
            if (!whole_number(rows[row][k + 1], corners[k]))
                return std::nullopt;
        add_face(sum, corners);
    }
    return sum;
}

} // namespace

std::optional<Announced> count_off(std::string_view bytes) {
    if (const std::optional<Announced> by_lines = count_off_lines(bytes))
        return by_lines;
    std::string text;
    for (const std::string &line : lines(without_mark(bytes)))
        text += line.substr(0, line.find('#')) + "\n";
    const std::size_t off = text.find("OFF");
    if (off == std::string::npos)
        return std::nullopt;
    const auto has = [&](const char *letters) { return text.substr(0, off).find(letters) != std::string::npos; };
    const Words all = words(text.substr(off + 3));
    const std::size_t numbers = (has("N") ? 6U : 3U) + (has("ST") ? 2U : 0U);
    const std::optional<Announced> with_opacity = count_off_words(all, numbers + (has("C") ? 4 : 0));
    return with_opacity || !has("C") ? with_opacity : count_off_words(all, numbers + 3);
}

std::optional<Announced> count_stl(std::string_view bytes) {
    Announced sum;
    if (bytes.size() >= 84) {
        std::uint64_t facets = 0;
        for (const std::size_t at : {83U, 82U, 81U, 80U})
            facets = facets << 8 | static_cast<unsigned char>(bytes[at]);
        const std::uint64_t size = 84 + 50 * facets;
        const bool is_longer = facets != 0 && size < bytes.size() && (bytes.size() - size) % 50 != 0 &&
                               bytes.substr(0, 84).find('\0') != std::string_view::npos;
        if (size == bytes.size() || is_longer) {
            sum.min_triangles = sum.max_triangles = facets;
            sum.something_unknown = is_longer;
            return sum;
        }
    }
    std::size_t begun = 0, ended = 0;
    std::uint64_t anywhere = 0; // facets of a text that does not keep to lines
    for (const std::string &line : lines(without_mark(bytes))) {
        const Words w = words(line);
        for (const std::string &word : w)
            anywhere += lower(word) == "facet" ? 1U : 0U;
        const bool is_end = w.size() > 1 && lower(w[0]) == "end"; // "end solid"
        const std::string keyword = w.empty() ? "" : is_end ? "end" + lower(w[1]) : lower(w[0]);
        begun += keyword == "solid" ? 1U : 0U;
        ended += keyword == "endsolid" ? 1U : 0U;
        sum.max_triangles += keyword == "facet" ? 1U : 0U;
    }
    sum.min_triangles = begun == ended ? sum.max_triangles : anywhere;
    sum.max_triangles = anywhere;
    return begun != 0 ? std::optional(sum) : std::nullopt;
}

namespace {

struct Property {
    std::string name, type, count_type; // count_type: of lists only
};

bool is_corners(const Property &p) {
    return !p.count_type.empty() && (lower(p.name) == "vertex_indices" || lower(p.name) == "vertex_index");
}

struct Element {
    std::string name;
    long long rows = 0;
    std::vector<Property> properties;
};

// Reads the numbers of a PLY body in order.
class Numbers {
  public:
    Numbers(std::string_view body, const std::string &format) : body_(body), format_(format) {}

    bool next(const std::string &type, double &value) { return format_ == "ascii" ? text(value) : binary(type, value); }
    bool at_end() {
        if (format_ != "ascii")
            return at_ == body_.size();
        return body_.find_first_not_of(kWhite, at_) == std::string_view::npos;
    }

  private:
    bool text(double &value) {
        at_ = std::min(body_.find_first_not_of(kWhite, at_), body_.size());
        const std::size_t end = std::min(body_.find_first_of(kWhite, at_), body_.size());
        const std::string word(body_.substr(at_, end - at_));
        at_ = end;
        return is_number(word, value);
    }
    bool binary(const std::string &type, double &value) {
        static const std::map<std::string, std::size_t> kSizes{
            {"char", 1},   {"int8", 1},    {"uchar", 1},  {"uint8", 1},  {"short", 2}, {"int16", 2},
            {"ushort", 2}, {"uint16", 2},  {"int", 4},    {"int32", 4},  {"uint", 4},  {"uint32", 4},
            {"float", 4},  {"float32", 4}, {"double", 8}, {"float64", 8}};
        const auto found = kSizes.find(type);
        if (found == kSizes.end() || found->second > body_.size() - at_)
            return false;
        const std::size_t size = found->second;
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < size; ++i) {
            const std::size_t from = format_ == "binary_big_endian" ? i : size - 1 - i;
            bits = bits << 8 | static_cast<unsigned char>(body_[at_ + from]);
        }
        at_ += size;
        if (type == "float" || type == "float32") {
            float f = 0;
            const auto low = static_cast<std::uint32_t>(bits);
            std::memcpy(&f, &low, sizeof f);
            value = static_cast<double>(f);
        } else if (size == 8) {
            std::memcpy(&value, &bits, sizeof value);
        } else if (type[0] == 'u') {
            value = static_cast<double>(bits);
        } else {
            const std::uint64_t sign = std::uint64_t{1} << (8 * size - 1);
            value = static_cast<double>(static_cast<std::int64_t>((bits ^ sign) - sign));
        }
        return true;
    }

    std::string_view body_;
    std::string format_;
    std::size_t at_ = 0;
};

// The header's elements; `body` is where it ends, `format` its encoding.
std::optional<std::vector<Element>> ply_elements(std::string_view bytes, std::size_t &body, std::string &format) {
    const std::size_t first_end = bytes.find_first_of("\r\n");
    if (first_end == std::string_view::npos)
        return std::nullopt;
    const char end_of_line = bytes.substr(first_end, 2) == "\r\n" || bytes[first_end] == '\n' ? '\n' : '\r';
    std::vector<Element> elements;
    for (std::size_t at = 0;;) {
        const std::size_t end = bytes.find(end_of_line, at);
        if (end == std::string_view::npos)
            return std::nullopt;
        const Words w = words(std::string(bytes.substr(at, end - at)));
        at = body = end + 1;
        if (w.empty())
            continue;
        if (w[0] == "end_header")
            return elements;
        if (w[0] == "format" && w.size() > 1)
            format = w[1];
        if (w[0] == "element" && w.size() == 3) {
            elements.push_back({w[1], 0, {}});
            if (!whole_number(w[2], elements.back().rows))
                return std::nullopt;
        }
        if (w[0] == "property" && !elements.empty() && w.size() >= 3)
            elements.back().properties.push_back(w[1] == "list" && w.size() == 5 ? Property{w[4], w[3], w[2]}
                                                                                 : Property{w[2], w[1], ""});
    }
}

} // namespace

std::optional<Announced> count_ply(std::string_view bytes) {
    std::size_t body = 0;
    std::string format;
    const std::optional<std::vector<Element>> elements = ply_elements(bytes, body, format);
    if (!elements)
        return std::nullopt;
    Announced sum;
    Numbers numbers(bytes.substr(body), format);
    for (const Element &element : *elements) {
        if (element.properties.empty())
            continue;
        const std::string name = lower(element.name);
        if (name == "vertex")
            sum.vertices = static_cast<std::uint64_t>(element.rows);
        else if (name != "face")
            sum.something_unknown = sum.something_unknown || element.rows != 0;
        bool has_corners = false;
        for (const Property &p : element.properties)
            has_corners = has_corners || is_corners(p);
        if (name == "face" && !has_corners)
            sum.something_unknown = sum.something_unknown || element.rows != 0;
        for (long long row = 0; row < element.rows; ++row)
            for (const Property &p : element.properties) {
                double value = 0;
                if (!numbers.next(p.count_type.empty() ? p.type : p.count_type, value))
                    return std::nullopt;
                if (p.count_type.empty())
                    continue;
                std::vector<long long> corners;
                for (double left = value; left > 0; --left) {
                    if (!numbers.next(p.type, value))
                        return std::nullopt;
                    corners.push_back(value > -1e9 && value < 1e10 ? static_cast<long long>(value) : -1);
                }
                if (name == "face" && is_corners(p))
                    add_face(sum, corners);
            }
    }
    sum.something_unknown = sum.something_unknown || !numbers.at_end();
    return sum;
}

} // namespace pbm::mutants
