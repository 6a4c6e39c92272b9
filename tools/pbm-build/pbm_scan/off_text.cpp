#include "pbm_scan/mesh_text.h"

#include "pbm_scan/text_lines.h"

#include <array>
#include <charconv>

namespace pbm::build {
namespace {

constexpr std::uint64_t kMaxVertices = std::numeric_limits<std::int32_t>::max();

class OffCheck {
  public:
    explicit OffCheck(std::span<const std::uint8_t> bytes) : lines_(out_.for_openmesh) {
        out_.for_openmesh = as_text(bytes);
    }
    Result<MeshText> run();

  private:
    bool next_line(); // that says something
    Status header();
    Status vertex();
    Status face();

    MeshText out_;
    Lines lines_;
    bool has_normals_ = false, has_colours_ = false, has_texture_ = false;
    std::uint64_t face_lines_ = 0;
    std::vector<std::uint32_t> corners_;
    std::vector<double> numbers_;
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
    has_texture_ = take("ST");
    has_colours_ = take("C");
    has_normals_ = take("N");
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
    if (numbers_.size() >= before_colour + 3 && !has_texture_)
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
    if (!lines_.word().empty())
        drop_once(out_.report, "face colours", "PBM stores point colours");
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
    }
    if (next_line())
        return lines_.refuse("text after the last face: the counts do not fit the file; export it again");
    if (has_texture_)
        drop_once(out_.report, "texture coordinates", "PBM stores point colours");
    if (!out_.colours.empty() && out_.colours.size() != out_.positions.size()) {
        drop_once(out_.report, "vertex colours", "not every vertex has one");
        out_.colours.clear();
    }
    return std::move(out_);
}

} // namespace

Result<MeshText> check_off(std::span<const std::uint8_t> bytes) { return OffCheck(bytes).run(); }

} // namespace pbm::build
