#include "pbm_scan/mesh_text.h"

#include "pbm_scan/text_lines.h"

#include <charconv>
#include <cstdlib>
#include <optional>

namespace pbm::build {
namespace {

constexpr std::uint64_t kMaxVertices = std::numeric_limits<std::int32_t>::max();

class ObjCheck {
  public:
    explicit ObjCheck(std::span<const std::uint8_t> bytes) : lines_(out_.for_openmesh) {
        out_.for_openmesh = as_text(bytes);
    }
    Result<MeshText> run();

  private:
    Status line();
    Status vertex();
    Status normal();
    Status face();
    Status other(std::string_view keyword);
    // 1-based or, if negative, counted from the end, as index 1... of `count` items so far.
    std::optional<std::int64_t> index(std::string_view text, std::uint64_t count) const;

    MeshText out_;
    Lines lines_;
    std::uint64_t normals_ = 0;
    std::int64_t highest_ = 0, highest_normal_ = 0;
    std::optional<Error> highest_error_, highest_normal_error_; // if no such vertex follows
    bool all_coloured_ = true;
    std::vector<std::uint32_t> corners_;
};

Status ObjCheck::vertex() {
    glm::dvec3 position;
    glm::vec3 colour(0.0F);
    int count = 0;
    bool clean = true;
    for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word(), ++count) {
        double value = 0;
        if (!is_number(word, value))
            return lines_.refuse(quoted(word) + " is not a number");
        clean = clean && fits_float(value);
        if (count < 3)
            position[count] = value;
        else if (count < 6)
            colour[count - 3] = static_cast<float>(value);
    }
    if (count < 3)
        return lines_.refuse("a vertex of fewer than three numbers: the file is cut short or damaged");
    if (!clean)
        lines_.replace("v 0 0 0");
    if (out_.positions.size() == kMaxVertices)
        return lines_.refuse("more than 2^31 - 1 vertices; split the scan", ErrorCode::too_large);
    out_.positions.push_back(position);
    all_coloured_ = all_coloured_ && count >= 6;
    if (all_coloured_)
        out_.colours.push_back(colour);
    else if (count >= 6 || !out_.colours.empty())
        drop_once(out_.report, "vertex colours", "not every vertex has one");
    if (count == 4)
        drop_once(out_.report, "vertex weights", "not used by PBM");
    return {};
}

Status ObjCheck::normal() {
    bool clean = true;
    for (int i = 0; i < 3; ++i) {
        double value = 0;
        const std::string_view word = lines_.word();
        if (!is_number(word, value))
            return lines_.refuse(word.empty() ? "a normal of fewer than three numbers: the file is cut short or damaged"
                                              : quoted(word) + " is not a number");
        clean = clean && fits_float(value);
    }
    ++normals_;
    if (!clean)
        lines_.replace("vn 0 0 0");
    return {};
}

std::optional<std::int64_t> ObjCheck::index(std::string_view text, std::uint64_t count) const {
    std::int64_t value = 0;
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (status != std::errc{} || end != text.data() + text.size() || value == 0 ||
        std::abs(value) > std::int64_t{kMaxVertices})
        return std::nullopt;
    if (value < 0)
        value += static_cast<std::int64_t>(count) + 1;
    return value > 0 ? std::optional(value) : std::nullopt;
}

Status ObjCheck::face() {
    corners_.clear();
    for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word()) {
        const std::size_t slash = word.find('/');
        const std::size_t second = slash == std::string_view::npos ? slash : word.find('/', slash + 1);
        const std::optional<std::int64_t> vertex = index(word.substr(0, slash), out_.positions.size());
        if (!vertex)
            return lines_.refuse(quoted(word) + " is not a vertex of this file");
        if (*vertex > highest_) {
            highest_ = *vertex;
            highest_error_ = lines_.refuse("vertex " + std::to_string(*vertex) + " does not exist");
        }
        if (slash != std::string_view::npos) {
            const std::string_view texture =
                word.substr(slash + 1, second == std::string_view::npos ? second : second - slash - 1);
            if (!texture.empty() && texture.find_first_not_of("-0123456789") != std::string_view::npos)
                return lines_.refuse(quoted(word) + " is not a vertex of this file");
        }
        if (second != std::string_view::npos && second + 1 < word.size()) {
            const std::optional<std::int64_t> normal = index(word.substr(second + 1), normals_);
            if (!normal)
                return lines_.refuse(quoted(word) + " names a normal that does not exist");
            if (*normal > highest_normal_) {
                highest_normal_ = *normal;
                highest_normal_error_ = lines_.refuse("normal " + std::to_string(*normal) + " does not exist");
            }
        }
        if (corners_.size() == kMaxCorners)
            return lines_.refuse("a face of more than " + std::to_string(kMaxCorners) + " corners; triangulate it",
                                 ErrorCode::too_large);
        corners_.push_back(static_cast<std::uint32_t>(*vertex));
    }
    if (corners_.size() < 3 && !lines_.terminated())
        return lines_.refuse("the file ends inside a face: it is cut short; copy or export it again");
    if (different(corners_) >= 3) {
        ++out_.faces;
        out_.triangles += corners_.size() - 2;
    } else {
        ++out_.dropped_triangles;
        lines_.blank();
    }
    return {};
}

Status ObjCheck::other(std::string_view keyword) {
    if (keyword == "mtllib")
        drop_once(out_.report, "materials and textures named by " + quoted(lines_.word()), "PBM stores point colours");
    else if (keyword == "vt")
        drop_once(out_.report, "texture coordinates", "PBM stores point colours");
    else if (keyword == "l" || keyword == "p")
        drop_once(out_.report, keyword == "l" ? "lines" : "points of lines 'p'",
                  "not used by PBM; their vertices are kept");
    else if (keyword == "vp" || keyword == "curv" || keyword == "curv2" || keyword == "surf" || keyword == "cstype")
        drop_once(out_.report, "free-form curves and surfaces", "PBM reads polygons; convert them");
    lines_.blank();
    return {};
}

Status ObjCheck::line() {
    lines_.strip_comment();
    const std::string_view keyword = lines_.word();
    if (keyword.empty())
        return {};
    if (keyword == "v")
        return vertex();
    if (keyword == "vn")
        return normal();
    if (keyword == "f" || keyword == "fo") {
        if (keyword == "fo") // the old spelling, unknown to OpenMesh
            out_.for_openmesh[static_cast<std::size_t>(keyword.data() - out_.for_openmesh.data()) + 1] = ' ';
        return face();
    }
    return other(keyword);
}

Result<MeshText> ObjCheck::run() {
    std::string &text = out_.for_openmesh;
    if (const Status status = refuse_nul(text); !status)
        return status.error();
    unify_white_space(text);
    for (std::size_t i = 0; i + 1 < text.size(); ++i) // a line that goes on in the next one
        if (text[i] == '\\') {
            const std::size_t end = text.find_first_not_of(" \t", i + 1);
            if (end != std::string::npos && text[end] == '\n')
                text[i] = text[end] = ' ';
        }
    while (lines_.next())
        if (const Status status = line(); !status)
            return status.error();
    if (highest_ > static_cast<std::int64_t>(out_.positions.size()))
        return *highest_error_;
    if (highest_normal_ > static_cast<std::int64_t>(normals_))
        return *highest_normal_error_;
    out_.vertices = out_.positions.size();
    if (!all_coloured_)
        out_.colours.clear();
    return std::move(out_);
}

} // namespace

Result<MeshText> check_obj(std::span<const std::uint8_t> bytes) { return ObjCheck(bytes).run(); }

} // namespace pbm::build
