#include "pbm_scan/mesh/mesh_text.h"

#include "pbm_scan/text/text_lines.h"

#include <glm/vec4.hpp>

namespace pbm::build {
namespace {

class OffCheck {
  public:
    explicit OffCheck(std::span<const std::uint8_t> bytes) : lines_(out_.for_openmesh) {
        out_.for_openmesh = as_unmarked_text(bytes);
    }

    Result<MeshText> run() {
        if (const Status status = refuse_nul(out_.for_openmesh); !status && out_.for_openmesh.find("BINARY") > 80)
            return status.error();
        unify_white_space(out_.for_openmesh);
        if (const Status status = header(); !status)
            return status.error();
        const std::uint64_t rows = out_.vertices + face_lines_;
        out_.positions.reserve(out_.vertices);
        for (std::uint64_t row = 0; row < rows; ++row) {
            if (!lines_.next_with_words(true))
                return lines_.refuse("the file ends after " + std::to_string(row) + " of " + std::to_string(rows) +
                                     " vertices and faces: it is cut short; copy or export it again");
            if (const Status status = row < out_.vertices ? vertex() : face(); !status)
                return status.error();
            open_end_ = !lines_.terminated();
        }
        if (lines_.next_with_words(true))
            return lines_.refuse("text after the last face: the counts do not fit the file; export it again");
        if (has_texture_)
            drop_once(out_.report, "texture coordinates", "PBM stores point colours");
        finish_colours();
        if (open_end_)
            report_open_end(out_.report);
        return std::move(out_);
    }

  private:
    Status header() {
        if (!lines_.next_with_words(true))
            return bad_input("the file has no OFF header");
        std::string_view keyword = lines_.word();
        const std::string_view whole = keyword;
        const auto take = [&keyword](std::string_view prefix) {
            const bool there = keyword.substr(0, prefix.size()) == prefix;
            keyword.remove_prefix(there ? prefix.size() : 0);
            return there;
        };
        bool found = true;
        while (found) { // some writers ignore the fixed order
            const bool texture = take("ST"), colours = take("C"), normals = take("N");
            has_texture_ = has_texture_ || texture;
            has_colours_ = has_colours_ || colours;
            has_normals_ = has_normals_ || normals;
            found = texture || colours || normals;
        }
        if (take("4") || take("n"))
            return lines_.refuse(printable_in_quotes(whole) + ": only three-dimensional OFF is read",
                                 ErrorCode::unsupported_feature);
        if (keyword != "OFF")
            return lines_.refuse("not an OFF file: it begins with " + printable_in_quotes(whole));
        const std::size_t line = lines_.offset();
        lines_.break_line(); // the counts may stand on the same line; OpenMesh wants them on the next
        std::fill(out_.for_openmesh.begin(), out_.for_openmesh.begin() + static_cast<std::ptrdiff_t>(line), ' ');
        std::string_view first = lines_.word();
        if (first == "BINARY")
            return lines_.refuse("binary OFF is not read; convert it to PLY", ErrorCode::unsupported_feature);
        if (first.empty()) {
            if (!lines_.next_with_words(true))
                return lines_.refuse("the file ends before its counts");
            first = lines_.word();
        }
        std::array<std::uint64_t, 3> counts{};
        for (std::size_t i = 0; i < counts.size(); ++i) {
            const std::string_view word = i == 0 ? first : lines_.word();
            if (i == 2 && word.empty())
                return lines_.refuse("expected the numbers of vertices, faces and edges");
            const auto count = parse_all<std::uint64_t>(word);
            if (!count)
                return lines_.refuse(printable_in_quotes(word) + " is not a count");
            counts[i] = *count;
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

    Status vertex() {
        Lines::Numbers numbers;
        if (Status status = lines_.numbers(numbers); !status)
            return status;
        const auto &[count, number, fit_floats] = numbers;
        const std::size_t before_colour = has_normals_ ? 6 : 3;
        if (count < before_colour)
            return lines_.refuse("vertex " + std::to_string(out_.positions.size()) + " needs " +
                                 std::to_string(before_colour) + " numbers");
        out_.positions.emplace_back(number[0], number[1], number[2]);
        if (has_normals_)
            out_.normals.emplace_back(number[3], number[4], number[5]);
        // Colours also stand in files that do not announce them.
        if (count >= before_colour + 3 && (has_colours_ || !has_texture_))
            out_.colours.emplace_back(number[before_colour], number[before_colour + 1], number[before_colour + 2]);
        if (fit_floats)
            lines_.blank_after(3);
        else
            lines_.replace("0 0 0");
        return {};
    }

    Status face() {
        const auto number = [this] { return parse_all<std::uint64_t>(lines_.word()); };
        const auto count = number();
        if (!count)
            return lines_.refuse("a face must begin with the number of its corners");
        const auto what = [&] { return "a face of " + std::to_string(*count) + " corners"; };
        corners_.clear();
        while (corners_.size() < *count) {
            const auto corner = number();
            if (!corner)
                return lines_.refuse(what() + " ends early or has one that is no index");
            if (*corner >= out_.vertices)
                return lines_.refuse("vertex index " + std::to_string(*corner) + ", but there are " +
                                     std::to_string(out_.vertices) + " vertices");
            corners_.push_back(static_cast<std::uint32_t>(*corner));
        }
        if (Status status = face_colour(); !status)
            return status;
        lines_.blank_after(1 + corners_.size());
        if (different(corners_) >= 3) {
            if (corners_.size() > kMaxCorners) {
                const auto three = three_different(corners_);
                lines_.replace("3 " + std::to_string(three[0]) + ' ' + std::to_string(three[1]) + ' ' +
                               std::to_string(three[2]));
                out_.outlines.push_back({out_.faces, corners_});
            }
            ++out_.faces;
            out_.triangles += corners_.size() - 2;
        } else {
            ++out_.dropped_triangles;
        }
        return {};
    }

    // The rest of a face: nothing, an index into a table of colours that is not in the file, or a colour.
    Status face_colour() {
        Lines::Numbers numbers;
        if (Status status = lines_.numbers(numbers); !status)
            return status;
        const auto &[count, number, fit_floats] = numbers;
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
            face_colours_[corner] += glm::vec4(number[0], number[1], number[2], 1);
        return {};
    }

    void finish_colours() {
        if (out_.colours.size() == out_.positions.size())
            return;
        if (!out_.colours.empty() || has_colours_)
            drop_once(out_.report, "vertex colours", "not every vertex has one");
        MeanColours means = mean_colours(face_colours_, "a coloured face");
        out_.colours = std::move(means.colours);
        if (!out_.colours.empty())
            out_.colour_note = std::move(means.note);
    }

    MeshText out_;
    Lines lines_;
    bool has_normals_ = false, has_colours_ = false, has_texture_ = false;
    std::uint64_t face_lines_ = 0;
    std::vector<std::uint32_t> corners_;
    std::vector<glm::vec4> face_colours_; // per vertex: sum of those of its faces, and how many
    bool open_end_ = false;
};

} // namespace

Result<MeshText> check_off(std::span<const std::uint8_t> bytes) { return OffCheck(bytes).run(); }

} // namespace pbm::build
