#include "mutants/count.h"
#include "mutants/count_text.h"

#include <nlohmann/json.hpp>

#include <cstring>

namespace pbm::mutants {
namespace {

// Positions alone: how many triangles follow from them is not announced.
Announced positions_of(std::uint64_t count) {
    return {.vertices = count, .min_triangles = 0, .max_triangles = 2 * count, .something_unknown = false};
}

template <class T> T at(std::string_view bytes, std::size_t offset) {
    T value{};
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

} // namespace

std::optional<Announced> count_ptx(std::string_view bytes) {
    std::vector<Words> rows;
    for (const std::string &line : lines(bytes))
        if (Words w = words(line); !w.empty())
            rows.push_back(std::move(w));
    std::uint64_t count = 0;
    for (std::size_t row = 0; row < rows.size();) {
        long long columns = 0, height = 0;
        if (rows.size() - row < 10 || !whole_number(rows[row][0], columns) || !whole_number(rows[row + 1][0], height))
            return std::nullopt;
        row += 10;
        for (long long i = 0; i < columns * height; ++i, ++row) {
            if (row == rows.size() || rows[row].size() < 3)
                return std::nullopt;
            const bool is_empty = std::all_of(rows[row].begin(), rows[row].begin() + 3, [](const std::string &word) {
                return std::strtod(word.c_str(), nullptr) == 0;
            });
            count += is_empty ? 0U : 1U;
        }
    }
    return positions_of(count);
}

// By the words of the XML section, which the header places by its offset in pages of 1024 bytes.
std::optional<Announced> count_e57(std::string_view bytes) {
    constexpr std::string_view kKey = "recordCount=";
    const std::size_t offset = bytes.size() < 48 ? 0 : at<std::uint64_t>(bytes, 24),
                      begin = offset / 1024 * 1020 + offset % 1024;
    if (begin < 48 || begin > bytes.size())
        return std::nullopt;
    const std::string_view xml = bytes.substr(begin, at<std::uint64_t>(bytes, 32));
    std::uint64_t sum = 0;
    for (std::size_t key = 0; (key = xml.find(kKey, key)) != std::string_view::npos; ++key)
        sum += std::strtoull(std::string(xml.substr(key + kKey.size() + 1, 20)).c_str(), nullptr, 10);
    return positions_of(sum);
}

std::optional<Announced> count_las(std::string_view bytes) {
    if (bytes.size() < 227)
        return std::nullopt;
    const std::size_t first = at<std::uint32_t>(bytes, 96), stride = at<std::uint16_t>(bytes, 105);
    const bool is_14 = bytes[25] >= 4, has_tail = (is_14 && at<std::uint32_t>(bytes, 243) != 0) ||
                                                  (bytes[25] >= 3 && (at<std::uint16_t>(bytes, 6) & 2) != 0);
    std::uint64_t count = at<std::uint32_t>(bytes, 107);
    if (is_14 && at<std::uint64_t>(bytes, 247) != 0)
        count = at<std::uint64_t>(bytes, 247);
    if (static_cast<unsigned char>(bytes[104]) >= 0x80) // LAZ
        return positions_of(count);
    if (stride == 0 || first > bytes.size() || count > (bytes.size() - first) / stride)
        return std::nullopt;
    // The size tells a count that is missing, where nothing may stand behind the points.
    const std::size_t room = bytes.size() - first;
    Announced sum = positions_of(count == 0 && room % stride == 0 && !has_tail ? room / stride : count);
    sum.something_unknown = sum.vertices * stride < room && !has_tail;
    return sum;
}

std::optional<Announced> count_spz(std::string_view bytes) {
    if (bytes.size() < 16)
        return std::nullopt;
    Announced sum = positions_of(at<std::uint32_t>(bytes, 8));
    const auto degree = static_cast<unsigned char>(bytes[12]);
    const std::size_t splat =
        (bytes[4] == 1 ? 6U : 9U) + 1 + 3 + 3 + (bytes[4] <= 2 ? 3U : 4U) + 3U * (degree * (degree + 2U));
    sum.something_unknown = 16 + sum.vertices * splat < bytes.size();
    return sum;
}

std::optional<Announced> count_pcd(std::string_view bytes) {
    std::uint64_t points = 0, width = 0, height = 1, row = 0;
    std::size_t body = 0;
    Words sizes, counts;
    std::string data;
    while (data.empty() && body < bytes.size()) {
        const std::size_t end = std::min(bytes.find('\n', body), bytes.size());
        const Words w = words(std::string(bytes.substr(body, end - body)));
        body = std::min(end + 1, bytes.size());
        if (w.size() < 2)
            continue;
        if (w[0] == "POINTS" || w[0] == "WIDTH" || w[0] == "HEIGHT")
            (w[0] == "POINTS" ? points : w[0] == "WIDTH" ? width : height) = std::strtoull(w[1].c_str(), nullptr, 10);
        else if (w[0] == "SIZE")
            sizes = w;
        else if (w[0] == "COUNT")
            counts = w;
        else if (w[0] == "DATA")
            data = w[1];
    }
    points = points != 0 ? points : width * height;
    Announced sum = positions_of(points);
    for (std::size_t i = 1; i < sizes.size(); ++i)
        row += std::strtoull(sizes[i].c_str(), nullptr, 10) *
               (i < counts.size() ? std::strtoull(counts[i].c_str(), nullptr, 10) : 1);
    const std::size_t end = bytes.find_last_not_of('\0') + 1; // zeros fill a page
    sum.something_unknown = data == "binary" && body + points * row < end;
    if (data == "binary_compressed" && bytes.size() - body >= 8)
        sum.something_unknown = body + 8 + at<std::uint32_t>(bytes, body) < end;
    return sum;
}

// Rows of numbers that hold more than a count. Text behind the first line is something that is no point.
std::optional<Announced> count_table(std::string_view bytes) {
    std::string text(bytes);
    for (char &c : text)
        c = c == ',' || c == ';' ? ' ' : c;
    std::uint64_t rows = 0, texts = 0;
    for (const std::string &line : lines(without_mark(text))) {
        const Words w = words(line.substr(0, std::min(line.find('#'), line.find("//"))));
        if (w.empty())
            continue;
        double value = 0;
        const bool is_row = is_number(w[0], value) && lower(w[0]).find('x') == std::string::npos;
        texts += is_row ? 0U : 1U;
        rows += is_row && w.size() >= 2 ? 1U : 0U;
    }
    Announced sum = positions_of(rows);
    sum.something_unknown = texts > 1;
    return sum;
}

// By the nodes of the scene.
std::optional<Announced> count_gltf(std::string_view bytes) {
    using nlohmann::json;
    const bool is_binary = bytes.starts_with("glTF") && bytes.size() >= 20;
    const std::string_view text = is_binary ? bytes.substr(20, at<std::uint32_t>(bytes, 12)) : bytes;
    const json doc = json::parse(without_mark(text), nullptr, false);
    const auto whole = [](const json &number, double otherwise) { // 1.0 is an integer too
        return static_cast<std::uint64_t>(number.is_number() ? std::max(number.get<double>(), 0.0) : otherwise);
    };
    const auto item = [&](const json &list, const json &index) {
        const std::uint64_t at = whole(index, 1e18);
        return list.is_array() && at < list.size() ? list[at] : json();
    };
    if (!doc.is_object())
        return std::nullopt;
    const auto member = [](const json &of, const char *name) {
        return of.is_object() && of.contains(name) ? of[name] : json();
    };
    const auto count_of = [&](const json &accessor) {
        return whole(member(item(member(doc, "accessors"), accessor), "count"), 0);
    };
    const json scenes = member(doc, "scenes"), scene = member(doc, "scene"), nodes = member(doc, "nodes");
    std::vector<json> shown; // numbers of meshes
    struct Visit {
        json node; // its number
        bool is_hidden;
    };
    std::vector<Visit> left;
    if (!scenes.is_array() || scenes.empty())
        for (std::size_t i = 0; i < member(doc, "meshes").size(); ++i)
            shown.emplace_back(i);
    for (const json &root : member(item(scenes, scene.is_null() ? json(0U) : scene), "nodes"))
        left.push_back({root, false});
    for (std::size_t visits = 0; visits < left.size(); ++visits) {
        constexpr std::uint64_t kMax = 1000;
        if (visits > kMax)
            return std::nullopt;
        const json node = item(nodes, left[visits].node), extensions = member(node, "extensions");
        const json visible = member(member(extensions, "KHR_node_visibility"), "visible");
        const bool is_hidden = left[visits].is_hidden || (visible.is_boolean() && !visible.get<bool>());
        const json instances = member(member(extensions, "EXT_mesh_gpu_instancing"), "attributes");
        std::uint64_t count = 1;
        for (const char *name : {"TRANSLATION", "ROTATION", "SCALE"})
            if (instances.is_object() && instances.contains(name))
                count = count_of(instances[name]);
        if (count > kMax)
            return std::nullopt;
        if (node.contains("mesh") && !is_hidden)
            shown.insert(shown.end(), count, node["mesh"]);
        for (const json &child : member(node, "children"))
            left.push_back({child, is_hidden});
    }
    Announced sum;
    for (const json &mesh : shown)
        for (const json &primitive : member(item(member(doc, "meshes"), mesh), "primitives")) {
            const std::uint64_t kind = whole(member(primitive, "mode"), 4);
            if (kind >= 1 && kind <= 3) { // lines
                sum.something_unknown = true;
                continue;
            }
            const std::uint64_t vertices = count_of(member(member(primitive, "attributes"), "POSITION"));
            const std::uint64_t corners = primitive.contains("indices") ? count_of(primitive["indices"]) : vertices;
            sum.vertices += vertices;
            if (primitive.contains("indices") && (kind == 0 || corners < vertices)) // those that are named
                sum.unnamed_vertices += vertices;
            sum.min_triangles += kind == 4 && vertices != 0 ? (corners + 2) / 3 : 0;
            sum.max_triangles += kind == 4 ? (corners + 2) / 3 : kind > 4 ? corners : 0;
        }
    return sum;
}

} // namespace pbm::mutants
