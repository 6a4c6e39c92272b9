#include "pbm_scan/ptx/ptx_reader.h"

#include "pbm_scan/clouds/intensity.h"
#include "pbm_scan/clouds/scan_grids.h"
#include "pbm_scan/clouds/stations.h"
#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/surface/range_grid.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"

#include <glm/mat3x3.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace pbm::build {
namespace {

constexpr std::size_t kMaxNumbers = 7; // of a line

// The lines of a text that are not blank, as numbers.
class NumberLines {
  public:
    explicit NumberLines(std::span<const std::uint8_t> bytes) : text_(as_text(bytes)) {}

    // Moves to the next line with words; false at the end of the text.
    bool next() {
        while (at_ < text_.size()) {
            begin_ = at_;
            for (end_ = at_; end_ < text_.size() && text_[end_] != '\n' && text_[end_] != '\r';)
                ++end_;
            ++number_;
            at_ = end_ + (text_.substr(end_, 2) == "\r\n" ? 2 : 1);
            for (word_ = begin_; word_ < end_ && ends_word(text_[word_]);)
                ++word_;
            if (word_ < end_)
                return true;
        }
        return false;
    }
    // The numbers of the line: their count, or kMaxNumbers + 1 for more.
    Result<std::size_t> numbers(std::array<double, kMaxNumbers> &out) {
        std::size_t count = 0;
        const char *const end = text_.data() + end_;
        for (const char *at = text_.data() + word_; at < end;) {
            double value = 0;
            const char *const after = parse_number(at, end, value);
            if (after == nullptr)
                return refuse(printable_in_quotes(first_word(at, end)) + " is not a number");
            if (count == kMaxNumbers)
                return kMaxNumbers + 1;
            out[count++] = value;
            for (at = after; at < end && ends_word(*at);)
                ++at;
        }
        return count;
    }
    Error refuse(const std::string &what) const {
        return bad_input("line " + std::to_string(number_) + ": " + what + "; export the scan again", begin_);
    }
    std::size_t bytes_left() const { return at_ < text_.size() ? text_.size() - at_ : 0; }
    bool ends_open() const { return !text_.empty() && text_.back() != '\n' && text_.back() != '\r'; }

  private:
    static std::string_view first_word(const char *at, const char *end) {
        const char *const first = at;
        while (at < end && !ends_word(*at))
            ++at;
        return {first, static_cast<std::size_t>(at - first)};
    }

    std::string_view text_;
    std::size_t at_ = 0, begin_ = 0, end_ = 0, word_ = 0;
    std::uint64_t number_ = 0;
};

struct Header {
    std::size_t columns = 0, rows = 0;
    glm::dmat3 turn{1};
    glm::dvec3 shift{0};
    bool moves = false; // the matrix is not the identity
};

constexpr std::array<std::size_t, 10> kHeaderNumbers{1, 1, 3, 3, 3, 3, 4, 4, 4, 4}; // of its lines

// The header whose first line is the current one.
Result<Header> read_header(NumberLines &lines) {
    Header header;
    std::array<std::array<double, 4>, 4> matrix{}; // positions are rows, multiplied from the left
    for (std::size_t line = 0; line < kHeaderNumbers.size(); ++line) {
        if (line > 0 && !lines.next())
            return lines.refuse("the file ends in the header of a scan");
        std::array<double, kMaxNumbers> numbers{};
        const Result<std::size_t> count = lines.numbers(numbers);
        if (!count)
            return count.error();
        if (*count != kHeaderNumbers[line])
            return lines.refuse("line " + std::to_string(line + 1) + " of a scan's header needs " +
                                counted(kHeaderNumbers[line], "number"));
        constexpr double kMaxSize = 4294967294;
        if (line < 2) {
            if (!(numbers[0] >= 0 && numbers[0] <= kMaxSize && numbers[0] == std::floor(numbers[0])))
                return lines.refuse("the numbers of columns and rows of a scan must be whole numbers");
            (line == 0 ? header.columns : header.rows) = static_cast<std::size_t>(numbers[0]);
        } else if (line >= 6) {
            for (std::size_t i = 0; i < 4; ++i) {
                if (!std::isfinite(numbers[i]))
                    return lines.refuse("the matrix is not finite");
                matrix[line - 6][i] = numbers[i];
            }
            if (matrix[line - 6][3] != (line == 9 ? 1.0 : 0.0))
                return lines.refuse("the last column of the matrix must be 0 0 0 1");
        }
    }
    for (glm::length_t row = 0; row < 3; ++row)
        for (glm::length_t axis = 0; axis < 3; ++axis)
            header.turn[row][axis] = matrix[static_cast<std::size_t>(row)][static_cast<std::size_t>(axis)];
    header.shift = glm::dvec3(matrix[3][0], matrix[3][1], matrix[3][2]);
    header.moves = header.turn != glm::dmat3(1) || header.shift != glm::dvec3(0);
    return header;
}

class PtxReader {
  public:
    PtxReader(std::span<const std::uint8_t> bytes, const ReadOptions &options)
        : bytes_(bytes.size()), lines_(bytes), options_(options) {}

    Result<Surface> read() {
        while (lines_.next())
            if (Status status = read_scan(); !status)
                return status.error();
        complete_station_ids(surface_);
        if (surface_.positions.empty())
            return bad_input("the file has no points: there is nothing to build");
        report();
        return finished(std::move(surface_), options_);
    }

  private:
    Status read_scan() {
        const Result<Header> header = read_header(lines_);
        if (!header)
            return header.error();
        constexpr std::size_t kMinLineBytes = 6; // "0 0 0" and its line end, which the last one may lack
        const std::size_t room = (lines_.bytes_left() + 1) / kMinLineBytes;
        if (header->rows != 0 && header->columns > room / header->rows)
            return lines_.refuse("the scan has " + std::to_string(header->columns) + " columns of " +
                                 std::to_string(header->rows) + " rows by its header, but the file has room for " +
                                 std::to_string(room) + " points");
        ++scans_;
        const std::size_t first = surface_.positions.size(), count = header->columns * header->rows;
        if (count >= std::numeric_limits<std::uint32_t>::max() - first)
            return too_large("more than 2^32 - 2 points: export fewer scans");
        ScanGrid grid{{}, header->rows};
        grid.cells.reserve(count);
        std::size_t numbers = 0;
        for (std::size_t i = 0; i < count; ++i) {
            if (!lines_.next())
                return lines_.refuse("the file ends after " + std::to_string(i) + " of " + std::to_string(count) +
                                     " points of scan " + std::to_string(scans_));
            if (Status status = read_point(*header, numbers, grid); !status)
                return status;
            constexpr std::size_t kProgressLines = 1 << 16;
            if (i % kProgressLines == 0 && options_.progress)
                options_.progress(1 - static_cast<double>(lines_.bytes_left()) / static_cast<double>(bytes_));
        }
        moved_ += header->moves ? 1U : 0U;
        if (surface_.positions.size() > first) {
            stations_ += add_station(surface_, first, header->shift) ? 1U : 0U;
            grids_.push_back(std::move(grid));
        }
        return {};
    }

    // `numbers`: of the lines of this scan; 0 before the first one.
    Status read_point(const Header &header, std::size_t &numbers, ScanGrid &grid) {
        std::array<double, kMaxNumbers> values{};
        const Result<std::size_t> count = lines_.numbers(values);
        if (!count)
            return count.error();
        if (numbers == 0)
            numbers = *count;
        if (*count != numbers || (numbers != 3 && numbers != 4 && numbers != 7))
            return lines_.refuse(*count != numbers ? "a point of " + counted(*count, "number") +
                                                         " in a scan whose first one has " + std::to_string(numbers)
                                                   : "a point of " + counted(*count, "number") +
                                                         ": x y z, with intensity, or with intensity red green "
                                                         "blue, are 3, 4 or 7");
        const glm::dvec3 p(values[0], values[1], values[2]);
        if (p == glm::dvec3(0)) {
            ++without_echo_;
            grid.cells.push_back(kEmptyCell);
            return {};
        }
        grid.cells.push_back(static_cast<std::uint32_t>(surface_.positions.size()));
        surface_.positions.push_back(header.moves ? header.turn * p + header.shift : p);
        const std::size_t size = surface_.positions.size();
        if (numbers >= 4) {
            intensities_.resize(size - 1, std::numeric_limits<float>::quiet_NaN());
            intensities_.push_back(static_cast<float>(values[3]));
        }
        if (numbers == 7) {
            surface_.colours.resize(size - 1, options_.default_material.colour);
            surface_.colours.push_back(colour_bytes(glm::vec3(values[4], values[5], values[6]), 1.0F));
        }
        return {};
    }

    void report() {
        std::vector<AttributeReport> &lines = surface_.report;
        const std::size_t count = surface_.positions.size();
        lines.push_back(
            {"scans", Fate::kept,
             std::to_string(scans_) + (moved_ > 0 ? ", " + std::to_string(moved_) + " moved by their matrices" : "")});
        lines.push_back({"x y z", Fate::kept,
                         "positions; " + counted(without_echo_, "line") +
                             " of sight without an "
                             "echo (0 0 0) left out"});
        if (!surface_.colours.empty()) {
            lines.push_back({"red green blue", Fate::kept, "sRGB"});
            surface_.colours.resize(count, options_.default_material.colour);
        }
        if (!intensities_.empty()) {
            intensities_.resize(count, std::numeric_limits<float>::quiet_NaN());
            const FieldColumn column(surface_, options_, "intensity");
            for (const float intensity : intensities_)
                column.add(static_cast<double>(intensity));
            if (column.is_kept())
                lines.push_back({"intensity", Fate::kept, "a field"});
            use_intensities(intensities_, surface_,
                            column.is_kept() ? "" : "the points have colours; --field intensity keeps it");
        }
        if (stations_ > 0)
            lines.push_back(
                {"scanner positions", Fate::kept, std::to_string(stations_) + " of " + counted(scans_, "scan")});
        if (stations_ < grids_.size())
            lines.push_back({"scanner positions", Fate::dropped,
                             std::to_string(grids_.size() - stations_) + " of " + counted(scans_, "scan") +
                                 " lie too far from their points"});
        lines.push_back(triangulate_scans(surface_, grids_));
        if (lines_.ends_open())
            report_open_end(lines);
    }

    const std::size_t bytes_;
    NumberLines lines_;
    const ReadOptions &options_;
    Surface surface_;
    std::vector<float> intensities_; // of the first positions; NaN: none
    std::vector<ScanGrid> grids_;    // of the scans with points
    std::size_t scans_ = 0, moved_ = 0, stations_ = 0;
    std::uint64_t without_echo_ = 0;
};

} // namespace

bool is_ptx(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kMaxHeaderBytes = 4096;
    NumberLines lines(bytes.first(std::min(bytes.size(), kMaxHeaderBytes)));
    for (const std::size_t needed : kHeaderNumbers) {
        std::array<double, kMaxNumbers> numbers{};
        if (!lines.next())
            return false;
        const Result<std::size_t> count = lines.numbers(numbers);
        if (!count || *count != needed)
            return false;
    }
    return true;
}

Result<Surface> read_ptx(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    return PtxReader(bytes, options).read();
}

} // namespace pbm::build
