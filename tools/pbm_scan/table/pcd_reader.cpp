#include "pbm_scan/table/pcd_reader.h"

#include "pbm_scan/clouds/stations.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/table/point_table.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"
#include "system/bytes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace pbm::build {
namespace {

struct PcdField {
    std::string name;
    std::size_t size = 4, count = 1;
    char type = 'F';
    ColumnRole role = ColumnRole::none;
    bool is_packed() const { return role == ColumnRole::packed_colour; }
};

struct Header {
    std::vector<PcdField> fields;
    std::uint64_t points = 0;
    std::string data;
    std::size_t body = 0;
    std::uint64_t body_line = 0;
    std::uint64_t rows = 1;
    glm::dvec3 station{0};
    std::array<double, 4> turn{1, 0, 0, 0}; // quaternion, w first
    bool has_odd_viewpoint = false;
    std::size_t values() const { // of a point; at least three
        std::size_t count = 0;
        for (const PcdField &field : fields)
            count += field.count;
        return count;
    }
    std::size_t row_size() const {
        std::size_t size = 0;
        for (const PcdField &field : fields)
            size += field.size * field.count;
        return size;
    }
};

class HeaderReader {
  public:
    explicit HeaderReader(std::string_view text) : lines_(text) {}

    Result<Header> run() {
        std::uint64_t width = 0, height = 1;
        std::vector<std::string> names, sizes, types, counts;
        std::optional<std::uint64_t> points;
        while (lines_.next()) {
            const std::string_view keyword = lines_.word();
            if (keyword.empty() || keyword.starts_with('#'))
                continue;
            if (keyword == "FIELDS" || keyword == "COLUMNS")
                names = words();
            else if (keyword == "SIZE")
                sizes = words();
            else if (keyword == "TYPE")
                types = words();
            else if (keyword == "COUNT")
                counts = words();
            else if (keyword == "VIEWPOINT")
                viewpoint();
            else if (keyword == "WIDTH" || keyword == "HEIGHT" || keyword == "POINTS") {
                const auto count = parse_all<std::uint64_t>(lines_.word());
                if (!count || *count > kMaxVertices)
                    return lines_.refuse("expected a number of points behind " + std::string(keyword));
                if (keyword == "POINTS")
                    points = *count;
                else
                    (keyword == "WIDTH" ? width : height) = *count;
            } else if (keyword == "DATA") {
                header_.data = lines_.word();
                if (header_.data != "ascii" && header_.data != "binary" && header_.data != "binary_compressed")
                    return lines_.refuse("DATA " + printable_in_quotes(header_.data) + " is not known");
                header_.body = lines_.next_offset();
                header_.body_line = lines_.number();
                header_.points = points.value_or(width * height);
                header_.rows = height;
                if (points && width != 0 && *points != width * height)
                    return lines_.refuse("POINTS is not WIDTH x HEIGHT: the file is damaged");
                if (Status made = make_fields(names, sizes, types, counts); !made)
                    return made.error();
                return std::move(header_);
            } else if (keyword != "VERSION")
                return lines_.refuse(printable_in_quotes(keyword) + " begins no line of a PCD header");
        }
        return bad_input("the PCD header has no DATA: it is cut short");
    }

  private:
    std::vector<std::string> words() {
        std::vector<std::string> all;
        constexpr std::size_t kMax = 256;
        for (std::string_view word = lines_.word(); !word.empty() && all.size() < kMax; word = lines_.word())
            all.emplace_back(word);
        return all;
    }

    void viewpoint() {
        Lines::Numbers numbers;
        header_.has_odd_viewpoint = !lines_.numbers(numbers) || numbers.count != 7;
        if (header_.has_odd_viewpoint)
            return;
        header_.station = {numbers.first[0], numbers.first[1], numbers.first[2]};
        std::copy_n(numbers.first.begin() + 3, header_.turn.size(), header_.turn.begin());
    }

    Status make_fields(std::vector<std::string> names, const std::vector<std::string> &sizes,
                       const std::vector<std::string> &types, const std::vector<std::string> &counts) {
        const auto fits = [&](const auto &of_fields) { return of_fields.empty() || of_fields.size() == names.size(); };
        if (names.empty() || !fits(sizes) || !fits(types) || !fits(counts))
            return lines_.refuse("FIELDS, SIZE, TYPE and COUNT have different lengths");
        std::replace(names.begin(), names.end(), std::string("_"), std::string(kSkippedColumn)); // PCL's padding
        make_distinct(names);
        const std::vector<ColumnRole> roles = roles_of(names);
        for (std::size_t i = 0; i < names.size(); ++i) {
            PcdField field{.name = names[i], .role = roles[i]};
            const auto size = sizes.empty() ? std::optional<std::size_t>(4) : parse_all<std::size_t>(sizes[i]);
            const auto count = counts.empty() ? std::optional<std::size_t>(1) : parse_all<std::size_t>(counts[i]);
            field.type = types.empty() ? 'F' : types[i].front();
            const bool is_known =
                size && (field.type == 'F' ? *size == 4 || *size == 8
                                           : (field.type == 'I' || field.type == 'U') &&
                                                 (*size == 1 || *size == 2 || *size == 4 || *size == 8));
            constexpr std::size_t kMaxCount = 65536;
            if (!is_known || !count || *count > kMaxCount)
                return lines_.refuse("field " + printable_in_quotes(names[i]) + " has no type that PCD knows");
            field.size = *size;
            field.count = *count;
            if (*count != 1)
                field.role = ColumnRole::none;
            header_.fields.push_back(std::move(field));
        }
        for (const ColumnRole axis : {ColumnRole::x, ColumnRole::y, ColumnRole::z})
            if (std::none_of(header_.fields.begin(), header_.fields.end(),
                             [&](const PcdField &f) { return f.role == axis; }))
                return lines_.refuse("the fields have no x, y and z");
        return {};
    }

    Lines lines_;
    Header header_;
};

template <class T> double number(const std::uint8_t *at) { return static_cast<double>(load<T>(at)); }

using Loader = double (*)(const std::uint8_t *);
Loader loader_of(const PcdField &field) {
    if (field.is_packed() && field.size == 4) // the bits, whatever the type says
        return number<std::uint32_t>;
    const std::size_t at = field.size == 1 ? 0 : field.size == 2 ? 1 : field.size == 4 ? 2 : 3;
    constexpr std::array<Loader, 4> kUnsigned{number<std::uint8_t>, number<std::uint16_t>, number<std::uint32_t>,
                                              number<std::uint64_t>};
    constexpr std::array<Loader, 4> kSigned{number<std::int8_t>, number<std::int16_t>, number<std::int32_t>,
                                            number<std::int64_t>};
    if (field.type == 'F')
        return field.size == 4 ? Loader(number<float>) : Loader(number<double>);
    return field.type == 'U' ? kUnsigned[at] : kSigned[at];
}

// Fills the column of a field, whose first value is at `from`.
void fill(const PcdField &field, const std::uint8_t *from, std::size_t stride, PointTable &table) {
    if (field.role == ColumnRole::none)
        return;
    const bool is_place = field.role <= ColumnRole::z;
    if (is_place && field.type == 'F' && field.size == 4) { // nearly all files
        const int axis = static_cast<int>(field.role) - static_cast<int>(ColumnRole::x);
        for (std::size_t i = 0; i < table.positions.size(); ++i, from += stride)
            table.positions[i][axis] = load<float>(from);
        return;
    }
    const Loader value = loader_of(field);
    for (std::size_t i = 0; i < table.positions.size(); ++i, from += stride)
        table.set(i, field.role, value(from));
}

// Unpacks LZF, which copies earlier bytes or literal ones.
bool unpack_lzf(std::span<const std::uint8_t> in, std::span<std::uint8_t> out) {
    std::size_t at = 0, to = 0;
    while (at < in.size()) {
        const std::size_t control = in[at++];
        if (control < 32) {
            const std::size_t count = control + 1;
            if (count > in.size() - at || count > out.size() - to)
                return false;
            std::memcpy(out.data() + to, in.data() + at, count);
            at += count;
            to += count;
            continue;
        }
        std::size_t count = control >> 5;
        if (count == 7) {
            if (at == in.size())
                return false;
            count += in[at++];
        }
        if (at == in.size())
            return false;
        const std::size_t back = ((control & 31) << 8 | in[at++]) + 1;
        count += 2;
        if (back > to || count > out.size() - to)
            return false;
        for (std::size_t i = 0; i < count; ++i, ++to)
            out[to] = out[to - back];
    }
    return to == out.size();
}

Error cut_short(const std::string &what, std::size_t offset) {
    return bad_input(what + ": it is cut short or damaged; copy or export it again", offset);
}

// Those behind the last point, without zeros that fill a page.
std::size_t bytes_behind(std::span<const std::uint8_t> bytes) {
    const auto last = std::find_if(bytes.rbegin(), bytes.rend(), [](std::uint8_t byte) { return byte != 0; });
    return static_cast<std::size_t>(bytes.rend() - last);
}

// These readers return the number of bytes behind the last point.
Result<std::size_t> read_binary(std::span<const std::uint8_t> bytes, const Header &header, PointTable &table) {
    const std::size_t row = header.row_size(), left = bytes.size() - header.body;
    if (header.points > left / row)
        return cut_short("the file announces " + std::to_string(header.points) + " points and has room for " +
                             std::to_string(left / row),
                         bytes.size());
    std::size_t at = header.body;
    for (const PcdField &field : header.fields) {
        fill(field, bytes.data() + at, row, table);
        at += field.size * field.count;
    }
    return bytes_behind(bytes.subspan(header.body + static_cast<std::size_t>(header.points) * row));
}

Result<std::size_t> read_compressed(std::span<const std::uint8_t> bytes, const Header &header, PointTable &table) {
    constexpr std::size_t kSizes = 8;
    if (bytes.size() - header.body < kSizes)
        return cut_short("the sizes of the compressed data are missing", bytes.size());
    const std::uint8_t *const sizes = bytes.data() + header.body;
    const auto packed = load<std::uint32_t>(sizes), unpacked = load<std::uint32_t>(sizes + 4);
    const std::size_t begin = header.body + kSizes;
    if (packed > bytes.size() - begin)
        return cut_short("the file announces " + std::to_string(packed) + " compressed bytes and has " +
                             std::to_string(bytes.size() - begin),
                         header.body);
    // LZF makes 264 bytes of 3 at best.
    if (unpacked != header.points * header.row_size() || unpacked / 88 > packed)
        return bad_input("the size of the unpacked data does not fit the header: the file is damaged", header.body + 4);
    std::vector<std::uint8_t> columns(unpacked);
    if (!unpack_lzf(bytes.subspan(begin, packed), columns))
        return bad_input("the compressed data (LZF) is damaged; export the scan again", begin);
    std::size_t at = 0;
    for (const PcdField &field : header.fields) {
        fill(field, columns.data() + at, field.size * field.count, table);
        at += field.size * field.count * header.points;
    }
    return bytes_behind(bytes.subspan(begin + packed));
}

// `open_end`: whether the last line has no end.
Result<std::size_t> read_ascii(std::string_view text, const Header &header, const ReadOptions &options,
                               PointTable &table, bool &open_end) {
    Lines lines(text, header.body, header.body_line);
    for (std::uint64_t i = 0; i < header.points; ++i) {
        if (!lines.next_with_words(false))
            return cut_short("the file ends after " + std::to_string(i) + " of " + std::to_string(header.points) +
                                 " points",
                             text.size());
        for (const PcdField &field : header.fields)
            for (std::size_t k = 0; k < field.count; ++k) {
                const std::string_view word = lines.word();
                double value = 0;
                if (!is_number(word, value))
                    return lines.refuse(word.empty() ? "a point of fewer numbers than there are fields"
                                                     : printable_in_quotes(word) + " is not a number");
                table.set(i, field.role, value);
            }
        if (!lines.word().empty())
            return lines.refuse("a point of more numbers than there are fields");
        open_end = !lines.terminated();
        if (options.progress && i % 65536 == 65535)
            options.progress(static_cast<double>(i) / static_cast<double>(header.points));
    }
    if (!lines.next_with_words(false))
        return std::size_t{0};
    double number = 0;
    if (is_number(lines.word(), number))
        return lines.refuse("rows behind the last point: the counts do not fit the file");
    return text.size() - lines.offset();
}

} // namespace

bool is_pcd(std::span<const std::uint8_t> bytes) {
    const std::string_view text = as_text(bytes).substr(0, 64);
    return text.starts_with("# .PCD") || (text.starts_with("VERSION") && text.size() > 7 && ends_word(text[7]) &&
                                          text.find("\nFIELDS") != std::string_view::npos);
}

Result<Surface> read_pcd(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    const std::string_view text = as_text(bytes);
    Result<Header> header = HeaderReader(text).run();
    if (!header)
        return header.error();
    if (header->body > bytes.size())
        return cut_short("the file ends with its header", bytes.size());
    // A number takes two characters, a byte of LZF makes 88 at best.
    const bool is_compressed = header->data == "binary_compressed";
    const std::uint64_t left = (bytes.size() - header->body) * (is_compressed ? 88U : 1U) + 1;
    if (header->points > left / (header->data == "ascii" ? 2 * header->values() : header->row_size()))
        return cut_short("the file announces " + std::to_string(header->points) + " points and is too small for them",
                         bytes.size());
    std::vector<std::string> names, of_no_number, of_several_numbers;
    std::vector<ColumnRole> roles;
    for (const PcdField &field : header->fields) {
        names.push_back(field.count == 1 ? field.name : std::string(kSkippedColumn));
        if (field.count != 1 && field.name != kSkippedColumn)
            (field.count == 0 ? of_no_number : of_several_numbers).push_back(field.name);
        roles.push_back(field.role);
    }
    Surface surface;
    const std::vector<KeptColumn> kept = keep_fields(names, roles, options, surface);
    for (std::size_t i = 0; i < roles.size(); ++i)
        header->fields[i].role = roles[i];
    PointTable table;
    table.resize(header->points, roles);
    bool open_end = false;
    const Result<std::size_t> trailing = is_compressed ? read_compressed(bytes, *header, table)
                                         : header->data == "binary"
                                             ? read_binary(bytes, *header, table)
                                             : read_ascii(text, *header, options, table, open_end);
    if (!trailing)
        return trailing.error();
    fill_surface(std::move(table), names, roles, kept, surface);
    if (!of_several_numbers.empty())
        surface.report.push_back(
            {"columns " + listed(of_several_numbers), Fate::dropped, "descriptors: each value has several numbers"});
    if (!of_no_number.empty())
        surface.report.push_back(
            {"columns " + listed(of_no_number), Fate::kept, "they hold nothing: their COUNT is 0"});
    if (header->station != glm::dvec3(0) && add_station(surface, 0, header->station))
        surface.report.push_back({"VIEWPOINT", Fate::kept, "where the scanner stood"});
    if (const auto &[w, x, y, z] = header->turn; x != 0 || y != 0 || z != 0)
        surface.report.push_back({"rotation of VIEWPOINT", Fate::dropped, "points are where the file has them"});
    if (header->has_odd_viewpoint)
        surface.report.push_back({"VIEWPOINT", Fate::dropped, "it needs seven numbers"});
    if (header->rows > 1)
        surface.report.push_back({"rows and columns", Fate::converted, "to points; no surface is made of them"});
    complete_station_ids(surface);
    report_trailing(surface.report, *trailing, "behind the last point");
    if (open_end)
        report_open_end(surface.report);
    return finished(std::move(surface), options);
}

} // namespace pbm::build
