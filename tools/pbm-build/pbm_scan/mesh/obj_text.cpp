#include "pbm_scan/mesh/mesh_text.h"

#include "pbm_scan/text/text_lines.h"

#include <array>
#include <map>
#include <optional>

namespace pbm::build {
namespace {

// Statements with names, which may end in a backslash without continuing the line.
constexpr std::array<std::string_view, 9> kNaming{"g",      "o",   "mtllib",     "usemtl",   "usemap",
                                                  "maplib", "lod", "shadow_obj", "trace_obj"};
// The other statements of the format. Based on: Alias|Wavefront. Advanced Visualizer manual, appendix B1. 1995
constexpr std::array<std::string_view, 31> kOther{
    "v",     "vt",   "vn",     "vp",       "f",        "fo",    "l",     "p",    "s",    "mg",   "curv",
    "curv2", "surf", "cstype", "deg",      "bmat",     "step",  "parm",  "trim", "hole", "scrv", "sp",
    "end",   "con",  "bevel",  "c_interp", "d_interp", "ctech", "stech", "call", "csh"};

template <std::size_t Count> bool is_one_of(std::string_view word, const std::array<std::string_view, Count> &words) {
    return std::find(words.begin(), words.end(), word) != words.end();
}

std::string_view first_word(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
    return text.substr(0, text.find_first_of(" \t\n"));
}

// Joins continued lines: replaces a backslash and the line end behind it by spaces, except in comments. A name that
// ends in a backslash (a Windows folder) does not continue if the next line begins with a statement.
void join_lines(std::string &text) {
    if (text.find('\\') == std::string::npos)
        return;
    for (std::size_t line = 0; line < text.size();) {
        std::size_t begin = line; // of the part that was joined last
        std::size_t end = std::min(text.find('\n', line), text.size());
        const bool naming = is_one_of(first_word(std::string_view(text).substr(line, end - line)), kNaming);
        while (end < text.size()) {
            const std::string_view part = std::string_view(text).substr(begin, end - begin);
            const std::size_t last = part.find_last_not_of(" \t");
            if (last == std::string_view::npos || part[last] != '\\' || part.find('#') != std::string_view::npos)
                break;
            const std::string_view next = first_word(std::string_view(text).substr(end + 1));
            if (naming && (is_one_of(next, kNaming) || is_one_of(next, kOther)))
                break;
            text[begin + last] = text[end] = ' ';
            begin = end + 1;
            end = std::min(text.find('\n', begin), text.size());
        }
        line = end + 1;
    }
}

// A count that a comment announces.
struct Announcement {
    std::uint64_t count = 0;
    std::uint64_t line = 0;
    std::size_t offset = 0;
};

class ObjCheck {
  public:
    explicit ObjCheck(std::span<const std::uint8_t> bytes) : lines_(out_.for_openmesh) {
        out_.for_openmesh = as_unmarked_text(bytes);
    }

    Result<MeshText> run() {
        std::string &text = out_.for_openmesh;
        if (const Status status = refuse_nul(text); !status)
            return status.error();
        unify_white_space(text);
        join_lines(text);
        while (lines_.next())
            if (const Status status = line(); !status)
                return status.error();
        if (highest_.index > static_cast<std::int64_t>(out_.positions.size()))
            return *highest_.error;
        if (highest_normal_.index > static_cast<std::int64_t>(normals_))
            return *highest_normal_.error;
        out_.vertices = out_.positions.size();
        for (const Status &status :
             {compare(vertices_, out_.vertices, "vertices"), compare(face_lines_, face_lines_found_, "faces"),
              compare(triangles_, std::max(face_lines_found_, out_.triangles), "triangles")})
            if (!status)
                return status.error();
        finish_attributes();
        return std::move(out_);
    }

  private:
    Status line() {
        if (first_word(lines_.rest()).starts_with('#'))
            comment();
        lines_.strip_comment();
        const std::string_view keyword = lines_.word();
        if (keyword.empty())
            return {};
        open_end_ = !lines_.terminated() && (keyword == "v" || keyword == "vn" || keyword == "f" || keyword == "fo");
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

    // "# Vertices: 507", "#114 vertices, 224 faces": only a word and a number between commas are a count.
    void comment() {
        std::string_view text = lines_.rest();
        text.remove_prefix(text.find('#'));
        text.remove_prefix(std::min(text.find_first_not_of('#'), text.size()));
        while (!text.empty()) {
            const std::size_t comma = std::min(text.find(','), text.size());
            announced(text.substr(0, comma));
            text.remove_prefix(std::min(comma + 1, text.size()));
        }
    }

    void announced(std::string_view item) {
        std::string_view name;
        std::optional<std::uint64_t> count;
        while (true) {
            item.remove_prefix(std::min(item.find_first_not_of(" \t:="), item.size()));
            const std::string_view word = item.substr(0, item.find_first_of(" \t:="));
            if (word.empty())
                break;
            item.remove_prefix(word.size());
            const auto value = parse_all<std::uint64_t>(word);
            if (value && !count)
                count = value;
            else if (name.empty())
                name = word;
            else
                return;
        }
        if (!count)
            return;
        Announcement *announcement = same_word(name, "vertices")                               ? &vertices_
                                     : same_word(name, "faces") || same_word(name, "polygons") ? &face_lines_
                                     : same_word(name, "triangles")                            ? &triangles_
                                                                                               : nullptr;
        if (announcement != nullptr && *count > announcement->count)
            *announcement = {*count, lines_.number(), lines_.offset()};
    }

    Status compare(const Announcement &announcement, std::uint64_t found, const char *what) const {
        if (found >= announcement.count)
            return {};
        return bad_input("line " + std::to_string(announcement.line) + ": the comment announces " +
                             std::to_string(announcement.count) + " " + what + ", but the file has " +
                             std::to_string(found) + ": it is cut short; copy or export it again",
                         announcement.offset);
    }

    // Normals that no face names belong to the vertices if their numbers are equal, as in point clouds.
    void finish_attributes() {
        if (names_normals_)
            out_.normals.clear();
        else if (out_.normals.size() != out_.positions.size() && !out_.normals.empty()) {
            drop_once(out_.report, "normals", "no face names them, and they are not as many as the vertices");
            out_.normals.clear();
        }
        if (!all_coloured_)
            out_.colours.clear();
        if (has_points_ && face_lines_found_ != 0)
            drop_once(out_.report, "points 'p'", "the model has faces; their vertices are kept");
        if (open_end_)
            report_open_end(out_.report);
    }

    Status vertex() {
        Lines::Numbers numbers;
        if (Status status = lines_.numbers(numbers); !status)
            return status;
        const auto &[count, number, fit_floats] = numbers;
        if (count < 3 || (!lines_.terminated() && count < numbers_))
            return lines_.refuse("a vertex of fewer than " + std::string(count < 3 ? "three" : "its neighbours'") +
                                 " numbers: the file is cut short or damaged");
        numbers_ = count;
        if (fit_floats)
            lines_.blank_after(4); // OpenMesh reads only the position
        else
            lines_.replace("v 0 0 0");
        if (out_.positions.size() == kMaxVertices)
            return lines_.refuse("more than 2^31 - 1 vertices; split the scan", ErrorCode::too_large);
        out_.positions.emplace_back(number[0], number[1], number[2]);
        all_coloured_ = all_coloured_ && count >= 6;
        if (all_coloured_)
            out_.colours.emplace_back(number[3], number[4], number[5]);
        else if (count >= 6 || !out_.colours.empty())
            drop_once(out_.report, "vertex colours", "not every vertex has one");
        if (count == 4 || count == 5)
            drop_once(out_.report, count == 4 ? "vertex weights" : "a fourth and a fifth number of vertices",
                      "not used by PBM");
        return {};
    }

    Status normal() {
        bool clean = true;
        glm::vec3 normal(0.0F);
        for (int i = 0; i < 3; ++i) {
            double value = 0;
            const std::string_view word = lines_.word();
            if (!is_number(word, value))
                return lines_.refuse(word.empty()
                                         ? "a normal of fewer than three numbers: the file is cut short or damaged"
                                         : printable_in_quotes(word) + " is not a number");
            clean = clean && fits_float(value);
            normal[i] = static_cast<float>(value);
        }
        ++normals_;
        if (!names_normals_)
            out_.normals.push_back(clean ? normal : glm::vec3(0.0F));
        if (!clean)
            lines_.replace("vn 0 0 0");
        return {};
    }

    Status face() {
        corners_.clear();
        for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word()) {
            const std::size_t slash = word.find('/');
            const std::size_t second = slash == std::string_view::npos ? slash : word.find('/', slash + 1);
            const std::optional<std::int64_t> vertex = index(word.substr(0, slash), out_.positions.size());
            if (!vertex)
                return lines_.refuse(printable_in_quotes(word) + " is not a vertex of this file");
            note_highest("vertex ", *vertex, out_.positions.size(), highest_);
            if (slash != std::string_view::npos) {
                const std::string_view texture =
                    word.substr(slash + 1, second == std::string_view::npos ? second : second - slash - 1);
                if (!texture.empty() && texture.find_first_not_of("-0123456789") != std::string_view::npos)
                    return lines_.refuse(printable_in_quotes(word) + " is not a vertex of this file");
            }
            if (second != std::string_view::npos && second + 1 < word.size()) {
                names_normals_ = true;
                const std::optional<std::int64_t> normal = index(word.substr(second + 1), normals_);
                if (!normal)
                    return lines_.refuse(printable_in_quotes(word) + " names a normal that does not exist");
                note_highest("normal ", *normal, normals_, highest_normal_);
            }
            corners_.push_back(static_cast<std::uint32_t>(*vertex));
        }
        if (corners_.size() < 3 && !lines_.terminated())
            return lines_.refuse("the file ends inside a face: it is cut short; copy or export it again");
        ++face_lines_found_;
        if (const std::size_t count = different(corners_); count >= 3) {
            if (corners_.size() > kMaxCorners) {
                const auto three = three_different(corners_);
                lines_.replace("f " + std::to_string(three[0]) + ' ' + std::to_string(three[1]) + ' ' +
                               std::to_string(three[2]));
                if (names_normals_)
                    drop_once(out_.report, "normals of large faces",
                              "of more than " + std::to_string(kMaxCorners) + " corners: taken from the faces");
            }
            if (count < corners_.size() || corners_.size() > kMaxCorners) {
                for (std::uint32_t &corner : corners_)
                    --corner; // from 0
                out_.outlines.push_back({out_.faces, corners_});
            }
            ++out_.faces;
            out_.triangles += corners_.size() - 2;
        } else {
            ++out_.dropped_triangles;
            lines_.blank();
        }
        return {};
    }

    void use_material(std::string name) {
        const auto [found, is_new] =
            materials_.try_emplace(std::move(name), static_cast<std::uint16_t>(out_.materials.size()));
        if (is_new && out_.materials.size() < kNoMaterial)
            out_.materials.push_back(found->first);
        out_.material_runs.push_back({out_.faces, found->second});
    }

    Status other(std::string_view keyword) {
        constexpr std::uint64_t kMaxNamed = 16; // a file may name a million
        if (keyword == "usemtl")
            use_material(std::string(lines_.trimmed_rest()));
        else if (keyword == "mtllib")
            drop_once(out_.report,
                      std::string(kMaterialsLine) + (++material_files_ > kMaxNamed
                                                         ? "of further files"
                                                         : "named by " + printable_in_quotes(lines_.trimmed_rest())),
                      "no material is read from there");
        else if (keyword == "vt")
            drop_once(out_.report, "texture coordinates", "PBM stores point colours");
        else if (keyword == "l")
            drop_once(out_.report, "lines", "not used by PBM; their vertices are kept");
        else if (keyword == "p")
            has_points_ = true;
        else if (keyword == "vp" || keyword.starts_with("curv") || keyword == "surf" || keyword == "cstype")
            drop_once(out_.report, "free-form curves and surfaces", "PBM reads polygons; convert them");
        else if (!is_one_of(keyword, kNaming) && !is_one_of(keyword, kOther) &&
                 keyword != "\x1a") { // DOS ends files so
            const bool word =
                keyword.size() > 1 && keyword.find_first_not_of("abcdefghijklmnopqrstuvwxyz_"
                                                                "ABCDEFGHIJKLMNOPQRSTUVWXYZ") == std::string_view::npos;
            if (!word)
                return lines_.refuse(printable_in_quotes(keyword) + " begins no statement of OBJ: the file is damaged");
            drop_once(out_.report,
                      ++unknown_statements_ > kMaxNamed ? "further statements"
                                                        : "statements " + printable_in_quotes(keyword),
                      "not known to OBJ");
        }
        lines_.blank();
        return {};
    }

    // 1-based or, if negative, counted from the end, as index 1... of `count` items so far.
    std::optional<std::int64_t> index(std::string_view text, std::uint64_t count) const {
        auto value = parse_all<std::int64_t>(text);
        if (!value || *value > std::int64_t{kMaxVertices} || *value < -std::int64_t{kMaxVertices})
            return std::nullopt;
        if (*value < 0)
            *value += static_cast<std::int64_t>(count) + 1;
        return *value > 0 ? value : std::nullopt;
    }

    struct Highest {
        std::int64_t index = 0;
        std::optional<Error> error; // if no vertex of this index follows
    };
    // `count`: vertices or normals so far.
    void note_highest(const char *what, std::int64_t index, std::uint64_t count, Highest &highest) const {
        if (index <= highest.index)
            return;
        highest.index = index;
        if (count < static_cast<std::uint64_t>(index))
            highest.error = lines_.refuse(what + std::to_string(index) + " does not exist");
    }

    MeshText out_;
    Lines lines_;
    std::uint64_t normals_ = 0;
    Highest highest_, highest_normal_;
    Announcement vertices_, face_lines_, triangles_; // the highest of each
    std::uint64_t face_lines_found_ = 0, material_files_ = 0, unknown_statements_ = 0;
    std::size_t numbers_ = 0; // of the last vertex
    bool all_coloured_ = true, names_normals_ = false, has_points_ = false, open_end_ = false;
    std::vector<std::uint32_t> corners_;
    std::map<std::string, std::uint16_t> materials_; // numbers of names; kNoMaterial: too many
};

} // namespace

Result<MeshText> check_obj(std::span<const std::uint8_t> bytes) { return ObjCheck(bytes).run(); }

} // namespace pbm::build
