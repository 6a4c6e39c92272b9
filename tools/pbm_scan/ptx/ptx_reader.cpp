#include "pbm_scan/ptx/ptx_reader.h"

#include "pbm_scan/clouds/intensity.h"
#include "pbm_scan/clouds/scan_grids.h"
#include "pbm_scan/clouds/stations.h"
#include "pbm_scan/fields/field_column.h"
#include "pbm_scan/surface/range_grid.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"

#include <glm/mat3x3.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace pbm::build {
namespace {

Error refuse(const Lines &lines, const std::string &what) { return lines.refuse(what + "; export the scan again"); }

struct Header {
    std::size_t columns = 0, rows = 0;
    glm::dmat3 turn{1};
    glm::dvec3 shift{0};
    bool moves = false; // the matrix is not the identity
};

constexpr std::array<std::size_t, 10> kHeaderNumbers{1, 1, 3, 3, 3, 3, 4, 4, 4, 4}; // of its lines

// The header whose first line is the current one.
Result<Header> read_header(Lines &lines) {
    Header header;
    std::array<std::array<double, 4>, 4> matrix{}; // positions are rows, multiplied from the left
    for (std::size_t line = 0; line < kHeaderNumbers.size(); ++line) {
        if (line > 0 && !lines.next_with_words(false))
            return refuse(lines, "the file ends in the header of a scan");
        Lines::Numbers numbers;
        if (const Status status = lines.numbers(numbers); !status)
            return status.error();
        if (numbers.count != kHeaderNumbers[line])
            return refuse(lines, "line " + std::to_string(line + 1) + " of a scan's header needs " +
                                     counted(kHeaderNumbers[line], "number"));
        constexpr double kMaxSize = 4294967294;
        if (line < 2) {
            if (!(numbers.first[0] >= 0 && numbers.first[0] <= kMaxSize &&
                  numbers.first[0] == std::floor(numbers.first[0])))
                return refuse(lines, "the numbers of columns and rows of a scan must be whole numbers");
            (line == 0 ? header.columns : header.rows) = static_cast<std::size_t>(numbers.first[0]);
        } else if (line >= 6) {
            for (std::size_t i = 0; i < 4; ++i) {
                if (!std::isfinite(numbers.first[i]))
                    return refuse(lines, "the matrix is not finite");
                matrix[line - 6][i] = numbers.first[i];
            }
            if (matrix[line - 6][3] != (line == 9 ? 1.0 : 0.0))
                return refuse(lines, "the last column of the matrix must be 0 0 0 1");
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
        : bytes_(bytes.size()), lines_(with_line_feeds(as_text(bytes), line_feeds_)), options_(options) {}

    Result<Surface> read() {
        while (lines_.next_with_words(false))
            if (Status status = read_scan(); !status)
                return status.error();
        complete_station_ids(surface_);
        if (surface_.positions.empty())
            return bad_input("the file has no points: there is nothing to build");
        report();
        return finished(std::move(surface_), options_);
    }

  private:
    std::size_t bytes_left() const { return bytes_ - std::min(bytes_, lines_.next_offset()); }

    Status read_scan() {
        const Result<Header> header = read_header(lines_);
        if (!header)
            return header.error();
        constexpr std::size_t kMinLineBytes = 6; // "0 0 0" and its line end, which the last one may lack
        const std::size_t room = (bytes_left() + 1) / kMinLineBytes;
        if (header->rows != 0 && header->columns > room / header->rows)
            return refuse(lines_, "the scan has " + std::to_string(header->columns) + " columns of " +
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
            if (!lines_.next_with_words(false))
                return refuse(lines_, "the file ends after " + std::to_string(i) + " of " + std::to_string(count) +
                                          " points of scan " + std::to_string(scans_));
            if (Status status = read_point(*header, numbers, grid); !status)
                return status;
            constexpr std::size_t kProgressLines = 1 << 16;
            if (i % kProgressLines == 0 && options_.progress)
                options_.progress(1 - static_cast<double>(bytes_left()) / static_cast<double>(bytes_));
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
        Lines::Numbers line;
        if (Status status = lines_.numbers(line); !status)
            return status;
        const auto &[count, values] = line;
        if (numbers == 0)
            numbers = count;
        if (count != numbers || (numbers != 3 && numbers != 4 && numbers != 7))
            return refuse(lines_, count != numbers ? "a point of " + counted(count, "number") +
                                                         " in a scan whose first one has " + std::to_string(numbers)
                                                   : "a point of " + counted(count, "number") +
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
        std::optional<std::string> grey;
        bool is_field = false;
        if (!intensities_.empty()) {
            intensities_.resize(count, std::numeric_limits<float>::quiet_NaN());
            const FieldColumn column = field_column(surface_, options_, "intensity");
            for (const float intensity : intensities_)
                column.add(static_cast<double>(intensity));
            is_field = column.is_kept();
            if (surface_.colours.empty()) {
                GreyColours greys = grey_colours(intensities_);
                surface_.colours = std::move(greys.colours);
                grey = std::move(greys.note);
            }
        }
        const AttributeReport faces = triangulate_scans(surface_, grids_);
        if (!intensities_.empty())
            lines.push_back(settle_intensities("intensity", grey, is_field, surface_));
        if (stations_ > 0)
            lines.push_back(
                {"scanner positions", Fate::kept, std::to_string(stations_) + " of " + counted(scans_, "scan")});
        if (stations_ < grids_.size())
            lines.push_back({"scanner positions", Fate::dropped,
                             std::to_string(grids_.size() - stations_) + " of " + counted(scans_, "scan") +
                                 " lie too far from their points"});
        lines.push_back(faces);
        if (!lines_.terminated())
            report_open_end(lines);
    }

    const std::size_t bytes_;
    std::string line_feeds_; // the text, if it has other line ends
    Lines lines_;
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
    std::string line_feeds;
    Lines lines(with_line_feeds(as_text(bytes.first(std::min(bytes.size(), kMaxHeaderBytes))), line_feeds));
    for (const std::size_t needed : kHeaderNumbers) {
        Lines::Numbers numbers;
        if (!lines.next_with_words(false) || !lines.numbers(numbers) || numbers.count != needed)
            return false;
    }
    return true;
}

Result<Surface> read_ptx(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    return PtxReader(bytes, options).read();
}

} // namespace pbm::build
