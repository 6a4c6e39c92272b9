#include "pbm_scan/mesh/obj_text.h"

#include "pbm_scan/mesh/mesh_attributes.h"
#include "pbm_scan/mesh/mesh_reader.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/words.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

namespace pbm::build {
namespace {

// The line of the report about statements that are not used.
struct UnusedPart {
    const char *name;
    Fate fate;
    const char *note;
};
constexpr UnusedPart kLines{"lines", Fate::dropped, "not used by PBM; their vertices are kept"},
    kFreeForm{"free-form curves and surfaces", Fate::dropped, "PBM reads polygons; convert them"},
    kGroups{"groups and objects", Fate::converted, "all are one surface"},
    kDisplay{"display attributes", Fate::dropped, "not used by PBM"},
    kMaps{"texture maps of 'usemap' and 'maplib'", Fate::dropped, "PBM uses images of materials"},
    kCalls{"calls", Fate::dropped, "PBM reads no further statements and runs no commands"};

// The statements of the format. Based on: Alias|Wavefront. Advanced Visualizer manual, appendix B1. 1995
struct Statement {
    std::string_view keyword;
    const UnusedPart *unused = nullptr;
    bool has_names = false; // the line may end in a backslash without continuing
};
constexpr std::array kStatements = std::to_array<Statement>({
    {"v"},
    {"vt"},
    {"vn"},
    {"f"},
    {"fo"},
    {"s"},
    {"p"},
    {"mtllib", nullptr, true},
    {"usemtl", nullptr, true},
    {"l", &kLines},
    {"g", &kGroups, true},
    {"o", &kGroups, true},
    {"vp", &kFreeForm},
    {"mg", &kFreeForm},
    {"curv", &kFreeForm},
    {"curv2", &kFreeForm},
    {"surf", &kFreeForm},
    {"cstype", &kFreeForm},
    {"deg", &kFreeForm},
    {"bmat", &kFreeForm},
    {"step", &kFreeForm},
    {"parm", &kFreeForm},
    {"trim", &kFreeForm},
    {"hole", &kFreeForm},
    {"scrv", &kFreeForm},
    {"sp", &kFreeForm},
    {"end", &kFreeForm},
    {"con", &kFreeForm},
    {"ctech", &kFreeForm},
    {"stech", &kFreeForm},
    {"bevel", &kDisplay},
    {"c_interp", &kDisplay},
    {"d_interp", &kDisplay},
    {"lod", &kDisplay, true},
    {"shadow_obj", &kDisplay, true},
    {"trace_obj", &kDisplay, true},
    {"usemap", &kMaps, true},
    {"maplib", &kMaps, true},
    {"call", &kCalls},
    {"csh", &kCalls},
});

// Null: it begins no statement of OBJ.
const Statement *statement_of(std::string_view keyword) {
    const auto *const found = std::find_if(kStatements.begin(), kStatements.end(),
                                           [&](const Statement &each) { return each.keyword == keyword; });
    return found == kStatements.end() ? nullptr : found;
}

std::string_view first_word(std::string_view text) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
    return text.substr(0, text.find_first_of(" \t\n"));
}

// Joins continued lines: replaces a backslash and the line end behind it by spaces, except in comments. A name that
// ends in a backslash (a Windows folder) does not continue if the next line begins with a statement.
std::string_view with_joined_lines(std::string_view text, std::string &storage) {
    if (text.find('\\') == std::string_view::npos)
        return text;
    if (text.data() != storage.data())
        storage = text;
    for (std::size_t line = 0; line < storage.size();) {
        std::size_t begin = line; // of the part that was joined last
        std::size_t end = std::min(storage.find('\n', line), storage.size());
        const Statement *const first = statement_of(first_word(std::string_view(storage).substr(line, end - line)));
        const bool naming = first != nullptr && first->has_names;
        while (end < storage.size()) {
            const std::string_view part = std::string_view(storage).substr(begin, end - begin);
            const std::size_t last = part.find_last_not_of(" \t\r");
            if (last == std::string_view::npos || part[last] != '\\' || part.find('#') != std::string_view::npos)
                break;
            if (naming && statement_of(first_word(std::string_view(storage).substr(end + 1))) != nullptr)
                break;
            storage[begin + last] = storage[end] = ' ';
            begin = end + 1;
            end = std::min(storage.find('\n', begin), storage.size());
        }
        line = end + 1;
    }
    return storage;
}

constexpr std::string_view kPolypaint = "#MRGB ";
constexpr std::uint32_t kAbsent = ObjText::kNone - 1; // index of a normal or of texture coordinates

// A count that a comment announces.
struct Announcement {
    std::uint64_t count = 0;
    std::uint64_t line = 0;
    std::size_t offset = 0;
};

bool has_three_different(std::span<const std::uint32_t> corners) {
    if (corners.size() < 3)
        return false;
    if (corners.size() == 3)
        return corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0];
    const std::uint32_t first = corners.front();
    const auto second = std::find_if(corners.begin(), corners.end(), [&](auto c) { return c != first; });
    return std::any_of(second, corners.end(), [&](auto c) { return c != first && c != *second; });
}

class ObjParser {
  public:
    ObjParser(std::string_view text, const ReadOptions &options)
        : size_(text.size()), progress_(options.progress), lines_(text) {}

    Result<ObjText> run() {
        constexpr std::uint64_t kReported = 1 << 18;
        while (lines_.next()) {
            if (const Status status = line(); !status)
                return status.error();
            if (progress_ && lines_.number() % kReported == 0)
                progress_(static_cast<double>(lines_.offset()) / static_cast<double>(size_));
        }
        if (vertex_.index > static_cast<std::int64_t>(out_.positions.size()))
            return *vertex_.error;
        for (const Status &status :
             {compare(vertices_, out_.positions.size(), "vertices"), compare(face_lines_, face_lines_found_, "faces"),
              compare(triangles_, std::max(face_lines_found_, triangles_found_), "triangles")})
            if (!status)
                return status.error();
        finish_attributes();
        return std::move(out_);
    }

  private:
    Status line() {
        const std::string_view keyword = lines_.word();
        if (keyword.empty())
            return {};
        if (keyword.front() == '#') {
            comment();
            return {};
        }
        if (keyword == "usemtl")
            return use_material(std::string(lines_.trimmed_rest())), Status();
        if (lines_.has_comment() && keyword != "mtllib") {
            lines_.strip_comment();
            lines_.rewind();
            lines_.word();
        }
        open_end_ = !lines_.terminated() && (keyword == "v" || keyword == "vn" || keyword == "f" || keyword == "fo");
        if (keyword == "v")
            return vertex();
        if (keyword == "f" || keyword == "fo") // "fo" is the old spelling
            return face();
        if (keyword == "vn")
            return normal();
        if (keyword == "vt")
            return texture_coordinates();
        return other(keyword);
    }

    // "# Vertices: 507", "#114 vertices, 224 faces": only a word and a number between commas are a count.
    void comment() {
        lines_.rewind();
        std::string_view text = lines_.rest();
        text.remove_prefix(text.find('#'));
        if (text.starts_with(kPolypaint))
            return add_polypaint(text.substr(kPolypaint.size()));
        text.remove_prefix(std::min(text.find_first_not_of('#'), text.size()));
        while (!text.empty()) {
            const std::size_t comma = std::min(text.find(','), text.size());
            announced(text.substr(0, comma));
            text.remove_prefix(std::min(comma + 1, text.size()));
        }
    }

    // ZBrush: MMRRGGBB in hexadecimal for each vertex, in blocks of up to 64. MM is a mask.
    void add_polypaint(std::string_view digits) {
        constexpr std::size_t kDigits = 8;
        for (digits = trimmed(digits, kBlanks); digits.size() >= kDigits; digits.remove_prefix(kDigits)) {
            const auto colour = parse_all<std::uint32_t>(digits.substr(0, kDigits), 16);
            if (!colour)
                return;
            polypaint_.push_back(*colour & 0xFFFFFFU);
        }
    }

    void announced(std::string_view item) {
        std::string_view name;
        std::optional<std::uint64_t> count;
        while (true) {
            item.remove_prefix(std::min(item.find_first_not_of(" \t\r:="), item.size()));
            const std::string_view word = item.substr(0, item.find_first_of(" \t\r:="));
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
        const std::uint64_t without_normal = complete(out_.corner_normals, normals_),
                            without_texture = complete(out_.corner_textures, textures_);
        if (without_normal != 0)
            out_.report.push_back({"normals of " + counted(without_normal, "corner"), Fate::dropped,
                                   "their indices name normals that do not exist"});
        if (without_texture != 0)
            out_.report.push_back({"texture coordinates of " + counted(without_texture, "corner"), Fate::dropped,
                                   "their indices name texture coordinates that do not exist"});
        if (out_.corner_normals.empty() && normals_ != out_.positions.size() && normals_ != 0) {
            drop_once(out_.report, "normals", "no face names them, and they are not as many as the vertices");
            out_.normals.clear();
        }
        if (!out_.colours.empty())
            out_.colours.resize(out_.positions.size(), kNoColour);
        use_polypaint();
        if (has_points_ && face_lines_found_ != 0)
            drop_once(out_.report, "points 'p'", "the model has faces; their vertices are kept");
        if (open_end_)
            report_open_end(out_.report);
    }

    // Replaces indices of what does not exist by kNone, and returns their number. Ends an array that has some.
    std::uint64_t complete(std::vector<std::uint32_t> &indices, std::uint64_t count) const {
        std::uint64_t absent = 0;
        for (std::uint32_t &index : indices)
            if (index != ObjText::kNone && index >= count) {
                index = ObjText::kNone;
                ++absent;
            }
        if (absent != 0 && std::all_of(indices.begin(), indices.end(), [](auto i) { return i == ObjText::kNone; }))
            indices.clear();
        if (!indices.empty())
            indices.resize(out_.corners.size(), ObjText::kNone);
        return absent;
    }

    void use_polypaint() {
        if (polypaint_.empty())
            return;
        if (!out_.colours.empty() || polypaint_.size() != out_.positions.size()) {
            out_.report.push_back({"polypaint (#MRGB)", Fate::dropped,
                                   out_.colours.empty() ? counted(polypaint_.size(), "colour") + " for " +
                                                              counted(out_.positions.size(), "vertex")
                                                        : "the vertices have colours of their own"});
            return;
        }
        constexpr float kWhite = 255;
        for (const std::uint32_t colour : polypaint_)
            out_.colours.push_back(glm::vec3(colour >> 16, colour >> 8 & 0xFFU, colour & 0xFFU) / kWhite);
        out_.report.push_back({"polypaint (#MRGB)", Fate::kept, "colours of vertices; masks are left out"});
    }

    Status vertex() {
        Lines::Numbers numbers;
        if (Status status = lines_.numbers(numbers); !status)
            return status;
        const auto &[count, number] = numbers;
        if (count < 3 || (!lines_.terminated() && count < numbers_))
            return lines_.refuse("a vertex of fewer than " + std::string(count < 3 ? "three" : "its neighbours'") +
                                 " numbers: the file is cut short or damaged");
        numbers_ = count;
        if (out_.positions.size() == kMaxVertices)
            return lines_.refuse("more than 2^31 - 1 vertices; split the scan", ErrorCode::too_large);
        out_.positions.emplace_back(number[0], number[1], number[2]);
        if (count >= 6) {
            out_.colours.resize(out_.positions.size() - 1, kNoColour);
            out_.colours.emplace_back(number[3], number[4], number[5]);
        }
        if (count > 3 && count != 6)
            drop_once(out_.report,
                      count == 4   ? "vertex weights"
                      : count == 5 ? "a fourth and a fifth number of vertices"
                                   : "further numbers of vertices",
                      "not used by PBM");
        return {};
    }

    // `count` numbers at least.
    Status numbers_of(const char *what, const char *least, std::size_t count, Lines::Numbers &numbers) {
        if (Status status = lines_.numbers(numbers); !status)
            return status;
        if (numbers.count < count)
            return lines_.refuse(std::string(what) + " of fewer than " + least +
                                 " numbers: the file is cut short or damaged");
        return {};
    }

    Status normal() {
        Lines::Numbers numbers;
        if (Status status = numbers_of("a normal", "three", 3, numbers); !status)
            return status;
        const glm::vec3 normal(numbers.first[0], numbers.first[1], numbers.first[2]);
        out_.normals.push_back(is_finite(glm::dvec3(normal)) ? normal : glm::vec3(0.0F));
        ++normals_;
        return {};
    }

    Status texture_coordinates() {
        Lines::Numbers numbers;
        if (Status status = numbers_of("texture coordinates", "one", 1, numbers); !status)
            return status;
        const glm::vec2 at(numbers.first[0], numbers.count > 1 ? numbers.first[1] : 0.0);
        out_.texture_coordinates.push_back(is_finite(glm::dvec3(at, 0.0F)) ? at : glm::vec2(0.0F));
        if (numbers.count > 2 && numbers.first[2] != 0)
            drop_once(out_.report, "third texture coordinates", "images have two dimensions");
        ++textures_;
        return {};
    }

    Status face() {
        const std::size_t before = out_.corners.size(), normals_before = out_.corner_normals.size(),
                          textures_before = out_.corner_textures.size();
        const char *at = lines_.at();
        const char *const end = lines_.end();
        while (true) {
            while (at != end && ends_word(*at))
                ++at;
            if (at == end)
                break;
            lines_.go_to(at); // for messages
            const auto vertex = index(at, end, out_.positions.size()).value_or(0);
            if (vertex == 0)
                return lines_.refuse(printable_in_quotes(lines_.word()) + " is not a vertex of this file");
            note_highest(vertex);
            out_.corners.push_back(static_cast<std::uint32_t>(vertex - 1));
            if (at != end && *at == '/')
                if (Status read = further_indices(at, end); !read)
                    return read;
            if (at != end && !ends_word(*at))
                return lines_.refuse(printable_in_quotes(lines_.word()) + " is not a vertex of this file");
        }
        const auto corners = std::span(out_.corners).subspan(before);
        if (corners.size() < 3 && !lines_.terminated())
            return lines_.refuse("the file ends inside a face: it is cut short; copy or export it again");
        ++face_lines_found_;
        if (!has_three_different(corners)) {
            ++out_.dropped_faces;
            out_.corners.resize(before);
            out_.corner_normals.resize(normals_before);
            out_.corner_textures.resize(textures_before);
            return {};
        }
        out_.face_sizes.push_back(static_cast<std::uint32_t>(corners.size()));
        triangles_found_ += corners.size() - 2;
        return {};
    }

    // "/7", "/7/3", "//3" behind the vertex of the last corner.
    Status further_indices(const char *&at, const char *end) {
        const auto take_slash = [&] { return at != end && *at == '/' ? (++at, true) : false; };
        const auto is_index = [&] { return at != end && *at != '/' && !ends_word(*at); };
        take_slash();
        if (is_index()) {
            const auto texture = index(at, end, textures_);
            if (!texture)
                return lines_.refuse(printable_in_quotes(lines_.word()) + " is not a vertex of this file");
            add_to_last_corner(*texture, out_.corner_textures);
        }
        if (take_slash() && is_index()) {
            const auto normal = index(at, end, normals_);
            if (!normal)
                return lines_.refuse(printable_in_quotes(lines_.word()) + " is not a vertex of this file");
            add_to_last_corner(*normal, out_.corner_normals);
        }
        return {};
    }

    // Corners before the last one that have no index get kNone. An index of nothing (0) gets one that no file has.
    void add_to_last_corner(std::int64_t index, std::vector<std::uint32_t> &indices) const {
        indices.resize(out_.corners.size() - 1, ObjText::kNone);
        indices.push_back(index == 0 ? kAbsent : static_cast<std::uint32_t>(index - 1));
    }

    // Reads an index: 1-based or, if negative, counted from the end. Returns it as 1... of `count` items so far; 0:
    // there is no such item. Nothing: no digits.
    static std::optional<std::int64_t> index(const char *&at, const char *end, std::uint64_t count) {
        const bool from_end = *at == '-';
        at += from_end ? 1 : 0;
        const char *const first = at;
        std::uint64_t digits = 0;
        at = append_digits(at, end, digits);
        if (at == first)
            return std::nullopt;
        if (at - first > kMaxDigits || digits > kMaxVertices)
            return 0;
        const auto value = static_cast<std::int64_t>(digits);
        return std::max<std::int64_t>(from_end ? static_cast<std::int64_t>(count) + 1 - value : value, 0);
    }

    void use_material(std::string name) {
        const auto [found, is_new] =
            materials_.try_emplace(std::move(name), static_cast<std::uint16_t>(out_.materials.size()));
        if (is_new && out_.materials.size() < kNoMaterial)
            out_.materials.push_back(found->first);
        out_.material_runs.push_back({out_.face_sizes.size(), found->second});
    }

    // "s 3", "s off"
    void use_smoothing(std::string_view word) {
        const std::optional<std::uint32_t> group = same_word(word, "off")  ? 0
                                                   : same_word(word, "on") ? 1
                                                                           : parse_all<std::uint32_t>(word);
        if (!group)
            drop_once(out_.report, "smoothing groups that are no numbers", "the one before them holds on");
        else
            add_smoothing({out_.face_sizes.size(), std::min(*group, Surface::kFlat - 1)});
    }

    void add_smoothing(const SmoothingRun &run) {
        std::vector<SmoothingRun> &runs = out_.smoothing_runs;
        if (!runs.empty() && runs.back().first_face == run.first_face)
            runs.back() = run;
        else if (runs.empty() || runs.back().group != run.group)
            runs.push_back(run);
    }

    Status other(std::string_view keyword) {
        constexpr std::uint64_t kMaxNamed = 16; // a file may name a million
        if (keyword == "s") {
            use_smoothing(lines_.word());
        } else if (keyword == "mtllib") {
            if (const std::string_view names = lines_.trimmed_rest();
                !names.empty() && out_.material_lines.size() < kMaxFurtherFiles)
                out_.material_lines.emplace_back(names);
            drop_once(out_.report,
                      std::string(kMaterialsLine) + (++material_files_ > kMaxNamed
                                                         ? "of further files"
                                                         : "named by " + printable_in_quotes(lines_.trimmed_rest())),
                      "no material is read from there");
        } else if (const Statement *const statement = statement_of(keyword)) {
            has_points_ = has_points_ || keyword == "p";
            if (const UnusedPart *const part = statement->unused; part != nullptr && part != last_unused_) {
                report_once(out_.report, {part->name, part->fate, part->note});
                last_unused_ = part;
            }
        } else if (keyword != "\x1a") { // DOS ends files so
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
        return {};
    }

    struct Highest {
        std::int64_t index = 0;
        std::optional<Error> error; // if no vertex of this index follows
    };
    void note_highest(std::int64_t vertex) {
        if (vertex > vertex_.index) {
            vertex_.index = vertex;
            if (out_.positions.size() < static_cast<std::uint64_t>(vertex))
                note_absent(vertex);
        }
    }
    void note_absent(std::int64_t vertex) {
        vertex_.error = lines_.refuse("vertex " + std::to_string(vertex) + " does not exist");
    }

    std::size_t size_;
    const std::function<void(double)> &progress_;
    ObjText out_;
    Lines lines_;
    std::uint64_t normals_ = 0, textures_ = 0;
    Highest vertex_;
    std::vector<std::uint32_t> polypaint_;           // 0xRRGGBB
    Announcement vertices_, face_lines_, triangles_; // the highest of each
    std::uint64_t face_lines_found_ = 0, triangles_found_ = 0, material_files_ = 0, unknown_statements_ = 0;
    std::size_t numbers_ = 0; // of the last vertex
    bool has_points_ = false, open_end_ = false;
    const UnusedPart *last_unused_ = nullptr;
    std::map<std::string, std::uint16_t> materials_; // numbers of names; kNoMaterial: too many
};

} // namespace

Result<ObjText> read_obj_text(std::string_view text, const ReadOptions &options) {
    if (const Status status = refuse_nul(text); !status)
        return status.error();
    std::string storage;
    return ObjParser(with_joined_lines(with_line_feeds(text, storage), storage), options).run();
}

std::vector<std::string> material_lines_of(std::string_view text) {
    constexpr std::string_view kKeyword = "mtllib";
    std::vector<std::string> found;
    if (text.find(kKeyword) == std::string_view::npos)
        return found;
    std::string storage;
    text = with_joined_lines(with_line_feeds(text, storage), storage);
    std::size_t at = text.find(kKeyword);
    while (at != std::string_view::npos && found.size() < kMaxFurtherFiles) {
        Lines line(text, text.rfind('\n', at) + 1); // npos + 1 is 0: the first line
        line.next();
        if (line.word() == kKeyword && !line.trimmed_rest().empty())
            found.emplace_back(line.trimmed_rest());
        at = text.find(kKeyword, line.next_offset());
    }
    return found;
}

} // namespace pbm::build
