#include "pbm_scan/ply/ply_header.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"

#include <algorithm>
#include <optional>

namespace pbm::build {
namespace {

// Both spellings of each PlyScalar.
constexpr std::array<std::array<std::string_view, 2>, 8> kScalarNames{{{"char", "int8"},
                                                                       {"uchar", "uint8"},
                                                                       {"short", "int16"},
                                                                       {"ushort", "uint16"},
                                                                       {"int", "int32"},
                                                                       {"uint", "uint32"},
                                                                       {"float", "float32"},
                                                                       {"double", "float64"}}};

std::optional<PlyScalar> scalar_named(std::string_view name) {
    for (std::size_t type = 0; type < kScalarNames.size(); ++type)
        if (name == kScalarNames[type][0] || name == kScalarNames[type][1])
            return static_cast<PlyScalar>(type);
    return std::nullopt;
}

class HeaderReader {
  public:
    explicit HeaderReader(std::span<const std::uint8_t> bytes)
        : text_(reinterpret_cast<const char *>(bytes.data()), bytes.size()) {}

    Result<PlyHeader> read() {
        if (!is_ply(as_bytes(text_)))
            return bad_input("not a PLY file: the first line is not 'ply'");
        const std::size_t first_end = text_.find_first_of("\r\n");
        const bool crlf = first_end + 1 < text_.size() && text_.substr(first_end, 2) == "\r\n";
        line_end_ = text_[first_end] == '\r' && !crlf ? '\r' : '\n';

        std::string_view line;
        while (take_line(line)) {
            const std::string_view keyword = take_word(line);
            Status status;
            if (line_number_ == 1 || keyword.empty())
                continue;
            if (keyword == "end_header") {
                if (!has_format_)
                    return refuse("the header has no format line");
                header_.body_offset = at_;
                header_.body_line = line_number_ + 1;
                return std::move(header_);
            }
            if (keyword == "comment")
                comment(line);
            else if (keyword == "obj_info")
                obj_info(line);
            else if (keyword == "format")
                status = format(line);
            else if (keyword == "element")
                status = element(line);
            else if (keyword == "property")
                status = property(line);
            else
                status = unknown(keyword);
            if (!status)
                return status.error();
        }
        if (text_.size() >= kMaxPlyHeaderBytes)
            return too_large("no end_header within the first MiB: the file is damaged", at_);
        const std::string where = header_.unknown_lines == 0
                                      ? std::string()
                                      : " (line " + std::to_string(first_unknown_line_) + " begins with " +
                                            printable_in_quotes(header_.first_unknown) + ")";
        return bad_input("the header has no end_header: the file is cut short or damaged" + where, at_);
    }

  private:
    bool take_line(std::string_view &line) {
        const std::size_t limit = std::min(text_.size(), kMaxPlyHeaderBytes);
        const std::size_t end = text_.substr(0, limit).find(line_end_, at_);
        if (end == std::string_view::npos)
            return false;
        line_offset_ = at_;
        ++line_number_;
        line = trimmed(text_.substr(at_, end - at_), kBlanks);
        at_ = end + 1;
        return true;
    }

    Status format(std::string_view line) {
        if (has_format_)
            return refuse("a second format line; the file is damaged");
        has_format_ = true;
        const std::string_view name = take_word(line);
        const std::string_view version = take_word(line);
        const auto *const encoding = std::find(kEncodingNames.begin(), kEncodingNames.end(), name);
        header_.encoding = static_cast<PlyEncoding>(encoding - kEncodingNames.begin());
        if (encoding == kEncodingNames.end())
            return refuse("format " + printable_in_quotes(name) +
                          " is none of ascii, binary_little_endian, binary_big_endian");
        if (version != "1.0")
            return refuse("PLY version " + printable_in_quotes(version) +
                              " is not known (only 1.0 is); export the scan again",
                          version.empty() ? ErrorCode::bad_input : ErrorCode::unsupported_version);
        return {};
    }

    Status element(std::string_view line) {
        const std::string_view name = take_word(line);
        const std::string_view count_text = take_word(line);
        if (count_text.empty() || !trimmed(line, kBlanks).empty())
            return refuse("expected: element NAME COUNT");
        const auto count = parse_all<std::uint64_t>(count_text);
        if (!count)
            return refuse("element " + printable_in_quotes(name) + " has the impossible count " +
                          printable_in_quotes(count_text));
        for (const PlyElement &other : header_.elements)
            if (other.name == name)
                return refuse("element " + printable_in_quotes(name) + " is announced twice; the file is damaged");
        if (header_.elements.size() == kMaxPlyElements)
            return refuse("more than " + std::to_string(kMaxPlyElements) + " elements", ErrorCode::too_large);
        header_.elements.push_back({.name = std::string(name),
                                    .count = *count,
                                    .properties = {},
                                    .line = line_number_,
                                    .offset = line_offset_});
        return {};
    }

    Status property(std::string_view line) {
        if (header_.elements.empty())
            return refuse("a property before the first element");
        PlyElement &element = header_.elements.back();
        PlyProperty property;
        std::string_view type_name = take_word(line);
        if (type_name == "list") {
            property.is_list = true;
            const std::string_view count_name = take_word(line);
            const std::optional<PlyScalar> count_type = scalar_named(count_name);
            if (!count_type)
                return refuse("unknown type " + printable_in_quotes(count_name) + " of a list count in element " +
                              printable_in_quotes(element.name));
            property.count_type = *count_type;
            type_name = take_word(line);
        }
        const std::optional<PlyScalar> type = scalar_named(type_name);
        if (!type)
            return refuse("unknown property type " + printable_in_quotes(type_name) + " in element " +
                          printable_in_quotes(element.name));
        property.type = *type;
        property.name = std::string(take_word(line));
        if (property.name.empty() || !trimmed(line, kBlanks).empty())
            return refuse("expected: property TYPE NAME, or property list TYPE TYPE NAME");
        for (const PlyProperty &other : element.properties)
            if (other.name == property.name)
                return refuse("element " + printable_in_quotes(element.name) + " has two properties " +
                              printable_in_quotes(property.name));
        if (element.properties.size() == kMaxPlyProperties)
            return refuse("more than " + std::to_string(kMaxPlyProperties) + " properties in element " +
                              printable_in_quotes(element.name),
                          ErrorCode::too_large);
        element.properties.push_back(std::move(property));
        return {};
    }

    Status unknown(std::string_view keyword) {
        if (!has_format_ || header_.encoding != PlyEncoding::ascii)
            return refuse("unknown keyword " + printable_in_quotes(keyword) + " in the header; the file is damaged");
        if (header_.unknown_lines++ == 0) {
            header_.first_unknown = keyword;
            first_unknown_line_ = line_number_;
        }
        return {};
    }

    void comment(std::string_view line) {
        if (!same_word(take_word(line), "texturefile") || trimmed(line, kBlanks).empty())
            return;
        if (header_.texture_files.size() < kMaxPlyTextures)
            header_.texture_files.emplace_back(trimmed(line, kBlanks));
        else
            ++header_.further_textures;
    }

    // Stanford's scanners write the width and height of a range image here. Other lines are ignored.
    void obj_info(std::string_view line) {
        const std::string_view name = take_word(line), value = take_word(line);
        const auto number = parse_all<std::uint64_t>(value);
        if (number && name == "num_cols")
            header_.grid_columns = *number;
        if (number && name == "num_rows")
            header_.grid_rows = *number;
    }

    Error refuse(const std::string &what, ErrorCode code = ErrorCode::bad_input) const {
        return Error{code, line_offset_, "line " + std::to_string(line_number_) + ": " + what};
    }

    std::string_view text_;
    std::size_t at_ = 0;          // of the next line
    std::size_t line_offset_ = 0; // of the current line
    std::uint64_t line_number_ = 0;
    char line_end_ = '\n';
    std::uint64_t first_unknown_line_ = 0;
    bool has_format_ = false;
    PlyHeader header_;
};

} // namespace

std::size_t size_of(PlyScalar type) {
    constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
    return kSizes[static_cast<std::size_t>(type)];
}

std::string_view to_string(PlyScalar type) { return kScalarNames[static_cast<std::size_t>(type)][0]; }

bool has_lists(const PlyElement &element) {
    return std::any_of(element.properties.begin(), element.properties.end(),
                       [](const PlyProperty &property) { return property.is_list; });
}

std::size_t min_row_size(const PlyElement &element, bool text) {
    std::size_t size = 0;
    for (const PlyProperty &property : element.properties)
        size += text ? 2 : size_of(property.is_list ? property.count_type : property.type);
    return size;
}

bool is_ply(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < 4 || bytes[0] != 'p' || bytes[1] != 'l' || bytes[2] != 'y')
        return false;
    std::size_t at = 3;
    while (at < bytes.size() && (bytes[at] == ' ' || bytes[at] == '\t'))
        ++at;
    return at < bytes.size() && (bytes[at] == '\n' || bytes[at] == '\r');
}

Result<PlyHeader> read_ply_header(std::span<const std::uint8_t> bytes) { return HeaderReader(bytes).read(); }

std::string in_line(const PlyElement &element) { return "line " + std::to_string(element.line) + ": "; }

} // namespace pbm::build
