#include "pbm_scan/mesh/mesh_text.h"

#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"

#include <glm/vec4.hpp>

#include <array>
#include <charconv>

namespace pbm::build {
namespace {

constexpr std::uint64_t kMaxVertices = std::numeric_limits<std::int32_t>::max();

class OffCheck {
  public:
    explicit OffCheck(std::span<const std::uint8_t> bytes) : lines_(out_.for_openmesh) {
        out_.for_openmesh = as_unmarked_text(bytes);
    }
    Result<MeshText> run();

  private:
    bool next_line(); // that says something
    Status header();
    Status vertex();
    Status face();
    Status face_colour();
    void finish_colours();

    MeshText out_;
    Lines lines_;
    bool has_normals_ = false, has_colours_ = false, has_texture_ = false;
    std::uint64_t face_lines_ = 0;
    std::vector<std::uint32_t> corners_;
    std::vector<double> numbers_;
    std::vector<glm::vec4> face_colours_; // per vertex: sum of those of its faces, and how many
    bool open_end_ = false;
};

bool OffCheck::next_line() {
    while (lines_.next()) {
        lines_.strip_comment();
        const bool empty = lines_.word().empty();
        lines_.rewind();
        if (!empty)
            return true;
    }
    return false;
}

Status OffCheck::header() {
    if (!next_line())
        return Error{ErrorCode::bad_input, 0, "the file has no OFF header"};
    std::string_view keyword = lines_.word();
    const std::string_view whole = keyword;
    const auto take = [&keyword](std::string_view prefix) {
        const bool there = keyword.substr(0, prefix.size()) == prefix;
        keyword.remove_prefix(there ? prefix.size() : 0);
        return there;
    };
    bool found = true;
    while (found) { // the order is fixed, but not everybody keeps it
        const bool texture = take("ST"), colours = take("C"), normals = take("N");
        has_texture_ = has_texture_ || texture;
        has_colours_ = has_colours_ || colours;
        has_normals_ = has_normals_ || normals;
        found = texture || colours || normals;
    }
    if (take("4") || take("n"))
        return lines_.refuse(quoted(whole) + ": only three-dimensional OFF is read", ErrorCode::unsupported_feature);
    if (keyword != "OFF")
        return lines_.refuse("not an OFF file: it begins with " + quoted(whole));
    const std::size_t line = lines_.offset();
    lines_.break_line(); // the counts may stand on the same line; OpenMesh wants them on the next
    std::fill(out_.for_openmesh.begin(), out_.for_openmesh.begin() + static_cast<std::ptrdiff_t>(line), ' ');
    std::string_view first = lines_.word();
    if (first == "BINARY")
        return lines_.refuse("binary OFF is not read; convert it to PLY", ErrorCode::unsupported_feature);
    if (first.empty()) {
        if (!next_line())
            return lines_.refuse("the file ends before its counts");
        first = lines_.word();
    }
    std::array<std::uint64_t, 3> counts{};
    for (std::size_t i = 0; i < counts.size(); ++i) {
        const std::string_view word = i == 0 ? first : lines_.word();
        if (i == 2 && word.empty())
            return lines_.refuse("expected the numbers of vertices, faces and edges");
        const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), counts[i]);
        if (status != std::errc{} || end != word.data() + word.size())
            return lines_.refuse(quoted(word) + " is not a count");
    }
    lines_.blank_rest();
    // A vertex takes at least "0 0 0\n", a face "0\n"; the last line may lack its end.
    const std::uint64_t left = out_.for_openmesh.size() - lines_.offset() + 1;
    if (counts[0] > left / 6 || counts[1] > left / 2)
        return lines_.refuse("the file is too small for " + std::to_string(counts[0]) + " vertices and " +
                             std::to_string(counts[1]) + " faces: it is cut short or damaged");
    if (counts[0] > kMaxVertices)
        return lines_.refuse("more than 2^31 - 1 vertices; split the scan", ErrorCode::too_large);
    out_.vertices = counts[0];
    face_lines_ = counts[1];
    return {};
}

Status OffCheck::vertex() {
    numbers_.clear();
    for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word()) {
        double value = 0;
        if (!is_number(word, value))
            return lines_.refuse(quoted(word) + " is not a number");
        if (numbers_.size() < 16)
            numbers_.push_back(value);
    }
    const std::size_t before_colour = has_normals_ ? 6 : 3;
    if (numbers_.size() < before_colour)
        return lines_.refuse("vertex " + std::to_string(out_.positions.size()) + " needs " +
                             std::to_string(before_colour) + " numbers");
    out_.positions.emplace_back(numbers_[0], numbers_[1], numbers_[2]);
    if (has_normals_)
        out_.normals.emplace_back(numbers_[3], numbers_[4], numbers_[5]);
    // Colours also stand in files that do not announce them.
    if (numbers_.size() >= before_colour + 3 && (has_colours_ || !has_texture_))
        out_.colours.emplace_back(numbers_[before_colour], numbers_[before_colour + 1], numbers_[before_colour + 2]);
    if (std::all_of(numbers_.begin(), numbers_.end(), fits_float)) {
        lines_.rewind();
        for (int i = 0; i < 3; ++i)
            lines_.word();
        lines_.blank_rest();
    } else {
        lines_.replace("0 0 0");
    }
    return {};
}

Status OffCheck::face() {
    const auto number = [this](std::uint64_t &value) {
        const std::string_view word = lines_.word();
        const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
        return !word.empty() && status == std::errc{} && end == word.data() + word.size();
    };
    std::uint64_t count = 0;
    if (!number(count))
        return lines_.refuse("a face must begin with the number of its corners");
    if (count > kMaxCorners)
        return lines_.refuse("a face of " + std::to_string(count) + " corners; triangulate it", ErrorCode::too_large);
    corners_.clear();
    for (std::uint64_t i = 0; i < count; ++i) {
        std::uint64_t corner = 0;
        if (!number(corner))
            return lines_.refuse("a face of " + std::to_string(count) +
                                 " corners ends early or has one that is no index");
        if (corner >= out_.vertices)
            return lines_.refuse("vertex index " + std::to_string(corner) + ", but there are " +
                                 std::to_string(out_.vertices) + " vertices");
        corners_.push_back(static_cast<std::uint32_t>(corner));
    }
    if (Status status = face_colour(); !status)
        return status;
    lines_.rewind();
    for (std::uint64_t i = 0; i <= count; ++i)
        lines_.word();
    lines_.blank_rest();
    if (different(corners_) >= 3) {
        ++out_.faces;
        out_.triangles += corners_.size() - 2;
    } else {
        ++out_.dropped_triangles;
    }
    return {};
}

// What follows the corners of a face: nothing, an index into a table of colours that nobody has, or a colour.
Status OffCheck::face_colour() {
    glm::vec4 colour(0.0F, 0.0F, 0.0F, 1.0F);
    int count = 0;
    for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word(), ++count) {
        double value = 0;
        if (!is_number(word, value))
            return lines_.refuse(quoted(word) + " is not a number");
        if (count < 3)
            colour[count] = static_cast<float>(value);
    }
    if (count == 1 || count == 2)
        drop_once(out_.report, "colour indices of faces", "the table of colours is not in the file");
    if (count < 3)
        return {};
    if (out_.colours.size() == out_.positions.size()) {
        drop_once(out_.report, "face colours", "the vertices have colours of their own");
        return {};
    }
    face_colours_.resize(out_.positions.size(), glm::vec4(0.0F));
    for (const std::uint32_t corner : corners_)
        face_colours_[corner] += colour;
    return {};
}

void OffCheck::finish_colours() {
    if (out_.colours.size() == out_.positions.size())
        return;
    if (!out_.colours.empty() || has_colours_)
        drop_once(out_.report, "vertex colours", "not every vertex has one");
    out_.colours.clear();
    std::size_t without = 0;
    for (const glm::vec4 &sum : face_colours_) {
        out_.colours.push_back(sum.w > 0 ? glm::vec3(sum) / sum.w : glm::vec3(0.0F));
        without += sum.w > 0 ? 0U : 1U;
    }
    if (out_.colours.empty())
        return;
    out_.colour_note = "each vertex has the mean of its faces, sRGB, 8 bits";
    if (without != 0)
        out_.colour_note += "; " + std::to_string(without) + " vertices without a coloured face are black";
}

Result<MeshText> OffCheck::run() {
    if (const Status status = refuse_nul(out_.for_openmesh); !status && out_.for_openmesh.find("BINARY") > 80)
        return status.error();
    unify_white_space(out_.for_openmesh);
    if (const Status status = header(); !status)
        return status.error();
    const std::uint64_t rows = out_.vertices + face_lines_;
    out_.positions.reserve(out_.vertices);
    for (std::uint64_t row = 0; row < rows; ++row) {
        if (!next_line())
            return lines_.refuse("the file ends after " + std::to_string(row) + " of " + std::to_string(rows) +
                                 " vertices and faces: it is cut short; copy or export it again");
        if (const Status status = row < out_.vertices ? vertex() : face(); !status)
            return status.error();
        open_end_ = !lines_.terminated();
    }
    if (next_line())
        return lines_.refuse("text after the last face: the counts do not fit the file; export it again");
    if (has_texture_)
        drop_once(out_.report, "texture coordinates", "PBM stores point colours");
    finish_colours();
    if (open_end_)
        report_open_end(out_.report);
    return std::move(out_);
}

} // namespace

Result<MeshText> check_off(std::span<const std::uint8_t> bytes) { return OffCheck(bytes).run(); }

} // namespace pbm::build
