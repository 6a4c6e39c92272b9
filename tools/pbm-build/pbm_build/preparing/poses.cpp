#include "pbm_build/preparing/poses.h"

#include "pbm_scan/images/files_beside.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
#include "system/files/mapped_file.h"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm::build {
namespace {

Error of_file(const std::string &file, Error error) {
    error.message = file + ": " + error.message;
    return error;
}

// A rotation by the inverse of a quaternion of any length but 0, then a shift.
std::optional<glm::dmat4> matrix_of(const std::array<double, 9> &numbers) {
    const glm::dvec4 given(numbers[3], numbers[4], numbers[5], numbers[6]);
    const double length = glm::length(given);
    if (!(length > 0) || !std::isfinite(length) || !is_finite({numbers[0], numbers[1], numbers[2]}))
        return std::nullopt;
    const glm::dvec4 q = given / length;
    glm::dmat4 matrix = glm::mat4_cast(glm::dquat(q.w, -q.x, -q.y, -q.z));
    matrix[3] = {numbers[0], numbers[1], numbers[2], 1};
    return matrix;
}

// "camera x y z" names the columns of a table.
bool is_alignment(ByteView bytes) {
    Lines lines(as_text(bytes.first(std::min<std::size_t>(bytes.size(), 256))));
    const std::string_view keyword = lines.next() ? lines.word() : "";
    if (keyword == "bmesh")
        return true;
    double number = 0;
    return keyword == "camera" && is_number(lines.word(), number);
}

// `looked_for`: all that it names, there or not.
Status read_alignment(const std::string &path, ByteView bytes, std::vector<PosedScan> &scans,
                      std::vector<NamedFile> &looked_for) {
    Lines lines(as_text(bytes));
    const std::size_t before = scans.size();
    while (lines.next_with_words(true)) {
        const std::string_view keyword = lines.word();
        if (keyword != "bmesh" && keyword != "mesh") {
            if (keyword == "camera")
                continue;
            return of_file(path, lines.refuse(printable_in_quotes(keyword) + " begins no line of an alignment file"));
        }
        const std::string name(lines.word());
        const std::string &file = looked_for.emplace_back(name_beside(path, name)).file;
        if (file.empty() && keyword == "mesh") // the scanner's own mesh, which the repository does not have
            continue;
        if (file.empty())
            return Error{ErrorCode::io, lines.offset(),
                         path + ": line " + std::to_string(lines.number()) + ": there is no file " +
                             printable_in_quotes(name) + " beside it"};
        Lines::Numbers numbers;
        if (Status read = lines.numbers(numbers); !read)
            return of_file(path, read.error());
        const auto matrix = numbers.count == 7 ? matrix_of(numbers.first) : std::nullopt;
        if (!matrix)
            return of_file(path, lines.refuse("a scan needs its place (3 numbers) and a quaternion (4)"));
        scans.push_back({file, matrix});
    }
    return scans.size() > before ? Status() : Status(of_file(path, bad_input("the alignment file names no scan")));
}

Result<glm::dmat4> read_matrix(const std::string &path) {
    const Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        return of_file(path, file.error());
    std::vector<double> numbers;
    std::string text(as_text(file->bytes()).substr(0, 4096));
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == ',' || c == ';' || c == '[' || c == ']'; }, ' ');
    Lines lines(text);
    while (lines.next_with_words(true)) {
        for (std::string_view word = lines.word(); !word.empty(); word = lines.word())
            if (!is_number(word, numbers.emplace_back()))
                return of_file(path, lines.refuse(printable_in_quotes(word) + " is not a number"));
    }
    const auto refuse = [&path](const std::string &what) {
        return of_file(path, bad_input(what + "; a pose is 16 numbers, row by row, the last row 0 0 0 1"));
    };
    if (numbers.size() != 16)
        return refuse("the file has " + std::to_string(numbers.size()) + " numbers");
    glm::dmat4 matrix(1);
    for (std::size_t i = 0; i < 16; ++i) {
        if (!std::isfinite(numbers[i]))
            return refuse("number " + std::to_string(i + 1) + " is not finite");
        matrix[static_cast<int>(i % 4)][static_cast<int>(i / 4)] = numbers[i];
    }
    constexpr double kNearly = 1e-9;
    if (std::abs(numbers[12]) > kNearly || std::abs(numbers[13]) > kNearly || std::abs(numbers[14]) > kNearly ||
        std::abs(numbers[15] - 1) > kNearly)
        return refuse("the last row is another one (or the matrix stands column by column)");
    if (glm::determinant(glm::dmat3(matrix)) == 0)
        return refuse("the matrix makes the scan flat");
    return matrix;
}

} // namespace

Result<std::vector<PosedScan>> posed_scans(std::span<const std::string> inputs, std::span<const std::string> poses) {
    if (!poses.empty() && poses.size() != inputs.size())
        return usage_error(std::to_string(poses.size()) + " poses for " + std::to_string(inputs.size()) +
                           " inputs; give one --pose for each, in their order");
    std::vector<PosedScan> scans;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const Result<MappedFile> file =
            is_stream(inputs[i]) ? Result<MappedFile>(Error{}) : MappedFile::open(inputs[i]);
        if (file && is_alignment(file->bytes())) {
            if (!poses.empty())
                return usage_error(inputs[i] + ": an alignment file has poses of its own; leave --pose out");
            std::vector<NamedFile> looked_for;
            if (Status read = read_alignment(inputs[i], file->bytes(), scans, looked_for); !read)
                return read.error();
            continue;
        }
        PosedScan scan{inputs[i], {}};
        if (!poses.empty()) {
            auto matrix = read_matrix(poses[i]);
            if (!matrix)
                return matrix.error();
            scan.pose = *matrix;
        }
        scans.push_back(std::move(scan));
    }
    return scans;
}

std::vector<NamedFile> scans_of_alignment(const std::string &path) {
    std::vector<NamedFile> files;
    const Result<MappedFile> file = is_stream(path) ? Result<MappedFile>(Error{}) : MappedFile::open(path);
    std::vector<PosedScan> scans;
    if (file && is_alignment(file->bytes()))
        static_cast<void>(read_alignment(path, file->bytes(), scans, files)); // a build says what is wrong with it
    return files;
}

void pose(Surface &surface, const glm::dmat4 &matrix) {
    const glm::dmat3 turn(matrix);
    const double determinant = glm::determinant(turn);
    const glm::dmat3 of_normals = glm::transpose(glm::inverse(turn));
    for (glm::dvec3 &p : surface.positions)
        p = glm::dvec3(matrix * glm::dvec4(p, 1));
    for (glm::dvec3 &station : surface.stations)
        station = glm::dvec3(matrix * glm::dvec4(station, 1));
    for (SceneView &view : surface.views) {
        view.position = glm::dvec3(matrix * glm::dvec4(view.position, 1));
        view.focal_point = glm::dvec3(matrix * glm::dvec4(view.focal_point, 1));
        view.up = glm::normalize(turn * view.up);
    }
    for (glm::vec3 &n : surface.normals)
        if (n != glm::vec3(0))
            n = glm::vec3(glm::normalize(of_normals * glm::dvec3(n)));
    for (glm::vec4 &tangent : surface.tangents)
        if (tangent != glm::vec4(0))
            tangent = {glm::vec3(glm::normalize(turn * glm::dvec3(tangent))), determinant < 0 ? -tangent.w : tangent.w};
    const auto factor = static_cast<float>(std::cbrt(std::abs(determinant)));
    for (float &radius : surface.radii)
        radius *= factor;
    if (determinant < 0)
        reverse_faces(surface);
}

} // namespace pbm::build
