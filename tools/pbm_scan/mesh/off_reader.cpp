#include "pbm_scan/mesh/mesh_attributes.h"
#include "pbm_scan/mesh/mesh_reader.h"
#include "pbm_scan/surface/polygon.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"

#include <bit>
#include <optional>

namespace pbm::build {
namespace {

// What the first word of the file says, and the counts behind it.
struct OffHeader {
    bool has_normals = false, has_colours = false, has_texture = false, is_binary = false;
    std::uint64_t vertices = 0, faces = 0;

    std::size_t numbers_before_colour() const { return has_normals ? 6 : 3; }
    // Of a vertex, if a colour has `colour` of them.
    std::size_t numbers(std::size_t colour) const {
        return numbers_before_colour() + (has_colours ? colour : 0) + (has_texture ? 2 : 0);
    }
};

std::string ends_early(std::uint64_t row, std::uint64_t rows) {
    return "the file ends after " + std::to_string(row) + " of " + std::to_string(rows) +
           " vertices and faces: it is cut short; copy or export it again";
}

std::string too_small(std::uint64_t vertices, std::uint64_t faces) {
    return "the file is too small for " + std::to_string(vertices) + " vertices and " + std::to_string(faces) +
           " faces: it is cut short or damaged";
}

// Refuses `word` if it does not begin an OFF file. Removes the keyword from it: what is left is the first count, which
// some writers do not separate ("OFF8 12 0").
Status read_keyword(std::string_view &word, const Lines &lines, OffHeader &header) {
    std::string_view keyword = word;
    const auto take = [&keyword](std::string_view prefix) {
        const bool there = keyword.starts_with(prefix);
        keyword.remove_prefix(there ? prefix.size() : 0);
        return there;
    };
    for (bool found = true; found;) { // some writers ignore the fixed order
        const bool texture = take("ST"), colours = take("C"), normals = take("N");
        header.has_texture |= texture;
        header.has_colours |= colours;
        header.has_normals |= normals;
        found = texture || colours || normals;
    }
    if (take("4") || take("n"))
        return lines.refuse(printable_in_quotes(word) + ": only three-dimensional OFF is read",
                            ErrorCode::unsupported_feature);
    if (!take("OFF") || keyword.find_first_not_of("0123456789") != std::string_view::npos)
        return lines.refuse("not an OFF file: it begins with " + printable_in_quotes(word));
    word = keyword;
    return {};
}

// Collects the vertices and faces of either encoding.
class OffSurface {
  public:
    OffSurface(const OffHeader &header, const ReadOptions &options) : header_(header), options_(options) {
        surface_.positions.reserve(header.vertices);
    }

    std::uint64_t vertices() const { return surface_.positions.size(); }
    const OffHeader &header() const { return header_; }

    // `numbers`: at least OffHeader::numbers_before_colour() of them.
    void add_vertex(std::span<const double> numbers) {
        surface_.positions.emplace_back(numbers[0], numbers[1], numbers[2]);
        if (header_.has_normals)
            surface_.normals.emplace_back(numbers[3], numbers[4], numbers[5]);
        const std::size_t colour = header_.numbers_before_colour();
        if (numbers.size() == colour)
            return;
        // Colours also stand in files that do not announce them.
        if (numbers.size() >= colour + 3 && (header_.has_colours || !header_.has_texture)) {
            colours_.emplace_back(numbers[colour], numbers[colour + 1], numbers[colour + 2]);
            note_opacity(numbers.subspan(colour));
        } else if (!header_.has_texture) {
            drop_once(report_, "further numbers of vertices", "no colour, which has three or more");
        }
    }

    // `rest`: the numbers behind the corners: none, an index into a table of colours that is not in the file, or a
    // colour.
    void add_face(std::span<const std::uint32_t> corners, std::span<const double> rest) {
        const std::size_t first = surface_.triangles.size();
        surface_.dropped_triangles += triangulator_.triangulate(corners, surface_.positions, surface_.triangles);
        if (!rest.empty())
            add_face_colour(first, rest);
    }

    // `bytes_behind`: the last face.
    Result<Surface> finish(bool has_open_end, std::size_t bytes_behind) {
        surface_.report.push_back({"positions", Fate::kept, ""});
        if (header_.faces != 0)
            surface_.report.push_back({"faces", Fate::kept, "polygons as triangles"});
        if (header_.has_texture)
            drop_once(report_, "texture coordinates", "no image belongs to them");
        if (colours_.size() != surface_.positions.size() && (!colours_.empty() || header_.has_colours)) {
            drop_once(report_, "vertex colours", "not every vertex has one");
            colours_.clear();
        }
        if (!face_colours_.empty())
            face_colours_.resize(surface_.triangles.size(), kNoColour);
        if (has_open_end)
            report_open_end(report_);
        report_trailing(report_, bytes_behind, "behind the last face");
        surface_.report.insert(surface_.report.end(), report_.begin(), report_.end());
        keep_normals(surface_, "normals");
        keep_colours(colours_, surface_, [this](std::size_t) { return options_.default_material.colour; });
        keep_face_colours(face_colours_, surface_);
        return finished(std::move(surface_), options_);
    }

  private:
    // `colour`: three numbers and what is behind them.
    void note_opacity(std::span<const double> colour) {
        constexpr double kOpaque = 1, kOpaqueByte = 255;
        if (colour.size() > 3 && colour[3] != kOpaque && colour[3] != kOpaqueByte)
            drop_once(report_, "opacity", "points are opaque");
    }

    // Of the triangles from `first` on.
    void add_face_colour(std::size_t first, std::span<const double> rest) {
        if (rest.size() < 3) {
            drop_once(report_, "colour indices of faces", "the table of colours is not in the file");
        } else if (colours_.size() == surface_.positions.size()) {
            drop_once(report_, "face colours", "the vertices have colours of their own");
        } else {
            note_opacity(rest);
            if (face_colours_.size() < first)
                face_colours_.resize(first, kNoColour);
            face_colours_.insert(face_colours_.end(), surface_.triangles.size() - first,
                                 glm::vec3(rest[0], rest[1], rest[2]));
        }
    }

    const OffHeader &header_;
    const ReadOptions &options_;
    Surface surface_;
    std::vector<AttributeReport> report_;
    std::vector<glm::vec3> colours_;      // of the vertices
    std::vector<glm::vec3> face_colours_; // of the triangles, or kNoColour; empty: no face has one
    PolygonTriangulator triangulator_;
};

// A text with a line for each vertex and face, or with words anywhere.
class OffText {
  public:
    // `colour_numbers`: of a vertex with a colour, in a text with words anywhere, whose faces then have no colours;
    // absent: lines divide vertices and faces.
    OffText(std::string_view text, const ReadOptions &options, std::optional<std::size_t> colour_numbers = {})
        : size_(text.size()), options_(options), lines_(text), colour_numbers_(colour_numbers) {}

    Result<Surface> run() {
        OffHeader header;
        if (const Status status = read_header(header); !status)
            return status.error();
        OffSurface out(header, options_);
        const std::uint64_t rows = header.vertices + header.faces;
        bool open_end = false;
        for (std::uint64_t row = 0; row < rows; ++row) {
            if (!next())
                return lines_.refuse(ends_early(row, rows));
            if (const Status status = row < header.vertices ? vertex(out) : face(header.vertices, out); !status)
                return status.error();
            open_end = !lines_.terminated();
            constexpr std::uint64_t kReported = 1 << 13;
            if (options_.progress && (row % kReported == 0 || row + 1 == rows))
                options_.progress(static_cast<double>(row + 1) / static_cast<double>(rows));
        }
        const std::size_t behind = next() ? size_ - lines_.offset() : 0;
        double number = 0;
        if (behind != 0 && (colour_numbers_ || is_number(lines_.word(), number)))
            return lines_.refuse("rows after the last face: the counts do not fit the file; export it again");
        return out.finish(open_end && behind == 0, behind);
    }

  private:
    // Goes to the next row, or to the next word of a text with words anywhere.
    bool next() { return colour_numbers_ ? next_word() : lines_.next_with_words(true); }
    // Not inlined, as free_vertex: that keeps the loop over lines short.
    [[gnu::noinline]] bool next_word() { return lines_.to_word() || lines_.next_with_words(true); }
    std::string_view word() {
        if (colour_numbers_)
            next();
        return lines_.word();
    }

    Status read_header(OffHeader &header) {
        if (!lines_.next_with_words(true))
            return bad_input("the file has no OFF header");
        std::string_view first = lines_.word();
        if (Status status = read_keyword(first, lines_, header); !status)
            return status;
        if (first.empty())
            first = lines_.word();
        if (first.empty()) { // the counts may stand on the same line
            if (!lines_.next_with_words(true))
                return lines_.refuse("the file ends before its counts");
            first = lines_.word();
        }
        std::array<std::uint64_t, 3> counts{};
        for (std::size_t i = 0; i < counts.size(); ++i) {
            const std::string_view digits = i == 0 ? first : word();
            if (i == 2 && digits.empty())
                return lines_.refuse("expected the numbers of vertices, faces and edges");
            const auto count = parse_all<std::uint64_t>(digits);
            if (!count)
                return lines_.refuse(printable_in_quotes(digits) + " is not a count");
            counts[i] = *count;
        }
        // A vertex takes at least "0 0 0\n", a face "0\n"; the last line may lack its end.
        const std::uint64_t left = size_ - lines_.offset() + 1;
        if (counts[0] > left / 6 || counts[1] > left / 2)
            return lines_.refuse(too_small(counts[0], counts[1]));
        if (counts[0] > kMaxVertices)
            return lines_.refuse("more than 2^31 - 1 vertices; split the scan", ErrorCode::too_large);
        header.vertices = counts[0];
        header.faces = counts[1];
        return {};
    }

    static std::span<const double> span_of(const Lines::Numbers &numbers) {
        return std::span(numbers.first).first(std::min(numbers.count, numbers.first.size()));
    }

    Status vertex(OffSurface &out) {
        Lines::Numbers numbers;
        if (colour_numbers_)
            return free_vertex(out);
        if (Status status = lines_.numbers(numbers); !status)
            return status;
        if (numbers.count < out.header().numbers_before_colour())
            return lines_.refuse("vertex " + std::to_string(out.vertices()) + " needs " +
                                 std::to_string(out.header().numbers_before_colour()) + " numbers");
        out.add_vertex(span_of(numbers));
        return {};
    }

    // Its numbers stand on any lines.
    [[gnu::noinline]] Status free_vertex(OffSurface &out) {
        std::array<double, 12> numbers{};
        const std::size_t count = out.header().numbers(*colour_numbers_);
        for (std::size_t i = 0; i < count; ++i)
            if (!is_number(word(), numbers.at(i)))
                return lines_.refuse("vertex " + std::to_string(out.vertices()) + " needs " + counted(count, "number"));
        out.add_vertex(std::span(numbers).first(count));
        return {};
    }

    Status face(std::uint64_t vertices, OffSurface &out) {
        std::uint64_t count = 0, corner = 0;
        if (!lines_.count(count))
            return lines_.refuse("a face must begin with the number of its corners");
        corners_.clear();
        while (corners_.size() < count) {
            if (!lines_.count(corner) && !(colour_numbers_ && next() && lines_.count(corner)))
                return lines_.refuse("a face of " + std::to_string(count) +
                                     " corners ends early or has one that is no index");
            if (corner >= vertices)
                return lines_.refuse("vertex index " + std::to_string(corner) + ", but there are " +
                                     std::to_string(vertices) + " vertices");
            corners_.push_back(static_cast<std::uint32_t>(corner));
        }
        if (!lines_.to_word() || colour_numbers_) {
            out.add_face(corners_, {});
            return {};
        }
        Lines::Numbers rest;
        if (Status status = lines_.numbers(rest); !status)
            return status;
        out.add_face(corners_, span_of(rest));
        return {};
    }

    std::size_t size_;
    const ReadOptions &options_;
    Lines lines_;
    std::optional<std::size_t> colour_numbers_;
    std::vector<std::uint32_t> corners_;
};

// By lines, as nearly all programs write it; else with words anywhere, as the format allows.
Result<Surface> read_text(std::string_view text, const ReadOptions &options) {
    Result<Surface> by_lines = OffText(text, options).run();
    if (by_lines || by_lines.error().code != ErrorCode::bad_input)
        return by_lines;
    for (const std::size_t numbers : {4U, 3U}) // with an opacity or without
        if (Result<Surface> by_words = OffText(text, options, numbers).run())
            return by_words;
    return by_lines;
}

// The rows of a binary file: big-endian floats and 32-bit integers.
// Based on: Geomview manual, section OFF files (the encoding "BINARY")
class OffBinary {
  public:
    // `bytes`: the file; `at`: the first byte behind the header's line.
    OffBinary(std::span<const std::uint8_t> bytes, std::size_t at, const ReadOptions &options)
        : bytes_(bytes), at_(at), options_(options) {}

    Result<Surface> run(OffHeader header) {
        if (left() < 3)
            return cut("before its counts");
        header.vertices = word();
        header.faces = word();
        word(); // edges
        constexpr std::size_t kColourNumbers = 4;
        const std::size_t numbers = header.numbers(kColourNumbers);
        // A face takes at least its number of corners and its number of colour components.
        if (header.vertices > left() / numbers || header.faces > (left() - header.vertices * numbers) / 2)
            return bad_input(too_small(header.vertices, header.faces), at_);
        OffSurface out(header, options_);
        std::array<double, 12> values{};
        for (std::uint64_t i = 0; i < header.vertices; ++i) {
            for (std::size_t k = 0; k < numbers; ++k)
                values[k] = static_cast<double>(std::bit_cast<float>(word()));
            out.add_vertex(std::span(values).first(numbers));
        }
        for (std::uint64_t i = 0; i < header.faces; ++i)
            if (const Status status = face(i, header.vertices, out); !status)
                return status.error();
        if (left() >= 2 && (bytes_.size() - at_) % 4 == 0) // room for a face
            return bad_input(std::to_string(bytes_.size() - at_) +
                                 " bytes after the last face: the counts do not fit the file; export it again",
                             at_);
        if (options_.progress)
            options_.progress(1.0);
        return out.finish(false, bytes_.size() - at_);
    }

  private:
    std::uint64_t left() const { return (bytes_.size() - at_) / 4; } // words
    std::uint32_t word() {
        const std::uint32_t value = std::uint32_t{bytes_[at_]} << 24 | std::uint32_t{bytes_[at_ + 1]} << 16 |
                                    std::uint32_t{bytes_[at_ + 2]} << 8 | bytes_[at_ + 3];
        at_ += 4;
        return value;
    }
    Error cut(const std::string &where) const {
        return bad_input("the file ends " + where + ": it is cut short; copy or export it again", at_);
    }

    Status face(std::uint64_t index, std::uint64_t vertices, OffSurface &out) {
        const auto ends = [&] { return cut("in face " + std::to_string(index)); };
        if (left() < 1)
            return ends();
        const std::uint32_t count = word();
        if (left() < std::uint64_t{count} + 1)
            return ends();
        corners_.resize(count);
        for (std::uint32_t &corner : corners_) {
            corner = word();
            if (corner >= vertices)
                return bad_input("face " + std::to_string(index) + " has vertex index " + std::to_string(corner) +
                                     ", but there are " + std::to_string(vertices) + " vertices",
                                 at_ - 4);
        }
        const std::uint32_t components = word();
        if (left() < components)
            return ends();
        colour_.resize(components);
        for (double &value : colour_)
            value = static_cast<double>(std::bit_cast<float>(word()));
        out.add_face(corners_, colour_);
        return {};
    }

    std::span<const std::uint8_t> bytes_;
    std::size_t at_;
    const ReadOptions &options_;
    std::vector<std::uint32_t> corners_;
    std::vector<double> colour_;
};

// The header of a binary file and the offset behind its line; nothing for a text.
std::optional<std::pair<OffHeader, std::size_t>> binary_header(std::string_view file) {
    constexpr std::size_t kLongest = 64;
    const std::size_t end = file.substr(0, kLongest).find('\n');
    if (end == std::string_view::npos)
        return std::nullopt;
    Lines lines(file.substr(0, end));
    OffHeader header;
    if (!lines.next())
        return std::nullopt;
    std::string_view word = lines.word();
    if (!read_keyword(word, lines, header) || !word.empty() || lines.word() != "BINARY")
        return std::nullopt;
    return std::pair(header, end + 1);
}

} // namespace

bool is_off(std::span<const std::uint8_t> bytes) {
    const std::string_view text = as_text(bytes).substr(0, 64);
    const std::size_t off = text.find("OFF");
    if (off == std::string_view::npos || text.substr(0, off).find_first_not_of("STCN4n") != std::string_view::npos)
        return false;
    const std::string_view rest = text.substr(off + 3),
                           behind = rest.substr(std::min(rest.find_first_not_of("0123456789"), rest.size()));
    return behind.empty() || ends_word(behind.front()) || behind.front() == '#';
}

Result<Surface> read_off(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    const std::string_view text = as_text(bytes);
    if (const auto binary = binary_header(text))
        return OffBinary(bytes, binary->second, options).run(binary->first);
    if (const Status status = refuse_nul(text); !status)
        return status.error();
    std::string storage;
    return read_text(with_line_feeds(text, storage), options);
}

} // namespace pbm::build
