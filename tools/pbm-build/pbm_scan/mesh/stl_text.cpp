#include "pbm_scan/mesh/mesh_text.h"

#include "pbm_scan/text/text_lines.h"

#include <array>
#include <bit>
#include <cstring>
#include <numeric>

namespace pbm::build {
namespace {

constexpr std::size_t kHeaderSize = 84; // of binary STL: 80 bytes of anything, the number of facets
constexpr std::size_t kFacetSize = 50;  // normal and three corners as floats, two bytes of attributes

static_assert(std::endian::native == std::endian::little, "binary STL is read as it lies in memory");

std::uint32_t announced_facets(std::span<const std::uint8_t> bytes) {
    std::uint32_t facets = 0;
    std::memcpy(&facets, bytes.data() + 80, sizeof facets);
    return facets;
}

// Whether the file is text: it begins with "solid", and has no NUL within the size of a binary header.
bool says_solid(std::span<const std::uint8_t> bytes) {
    const std::span<const std::uint8_t> head = bytes.first(std::min(bytes.size(), kHeaderSize));
    if (head.size() == kHeaderSize && std::find(head.begin(), head.end(), std::uint8_t{0}) != head.end())
        return false;
    std::size_t at = as_text(head).starts_with("\xEF\xBB\xBF") ? 3 : 0;
    while (at < bytes.size() && ends_word(static_cast<char>(bytes[at])))
        ++at;
    const std::string_view word = as_text(bytes.subspan(at, std::min<std::size_t>(5, bytes.size() - at)));
    return same_word(word, "solid");
}

void report_normals(MeshText &out) {
    out.report.push_back({"facet normals", Fate::converted, "follow from the corners"});
}

// Keeps the facets whose corners are finite.
MeshText check_binary(std::span<const std::uint8_t> bytes) {
    MeshText out;
    out.binary = true;
    out.for_openmesh = as_text(bytes.first(kHeaderSize));
    bool attributes = false;
    for (std::size_t at = kHeaderSize; at < bytes.size(); at += kFacetSize) {
        std::array<float, 9> corners{};
        std::memcpy(corners.data(), bytes.data() + at + 12, sizeof corners);
        attributes = attributes || bytes[at + 48] != 0 || bytes[at + 49] != 0;
        if (std::all_of(corners.begin(), corners.end(), [](float value) { return std::isfinite(value); }))
            out.for_openmesh += as_text(bytes.subspan(at, kFacetSize));
        else
            ++out.dropped_triangles;
    }
    const auto kept = static_cast<std::uint32_t>((out.for_openmesh.size() - kHeaderSize) / kFacetSize);
    std::memcpy(out.for_openmesh.data() + 80, &kept, sizeof kept);
    out.faces = out.triangles = kept;
    report_normals(out);
    if (attributes)
        drop_once(out.report, "attribute bytes", "colours of binary STL have no agreed meaning");
    return out;
}

// Welds corners with equal coordinates: returns the vertex of each corner, numbered in the order of the file. Sorts
// instead of hashing, because a hostile file could make all hashes equal.
std::vector<std::uint32_t> weld(std::span<const glm::dvec3> corners, std::vector<glm::dvec3> &vertices) {
    const auto before = [&](std::uint32_t a, std::uint32_t b) {
        const glm::dvec3 &p = corners[a], &q = corners[b];
        return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z != q.z ? p.z < q.z : a < b;
    };
    std::vector<std::uint32_t> order(corners.size()), numbers(corners.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), before);
    for (std::size_t i = 0, first = 0; i < order.size(); ++i) { // of each corner the first one that equals it
        first = corners[order[i]] == corners[order[first]] ? first : i;
        numbers[order[i]] = order[first];
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
        if (numbers[i] == i) {
            numbers[i] = static_cast<std::uint32_t>(vertices.size());
            vertices.push_back(corners[i]);
        } else {
            numbers[i] = numbers[numbers[i]];
        }
    }
    return numbers;
}

class AsciiCheck {
  public:
    explicit AsciiCheck(std::span<const std::uint8_t> bytes) : lines_(text_) { text_ = as_unmarked_text(bytes); }

    Result<MeshText> run() {
        if (const Status status = refuse_nul(text_); !status)
            return status.error();
        unify_white_space(text_);
        bool inside = false;
        while (lines_.next_with_words(false)) {
            const std::string_view keyword = lines_.word();
            if (same_word(keyword, "solid") && !inside) {
                inside = true;
            } else if (same_word(keyword, "endsolid") && inside) {
                inside = false;
            } else if (same_word(keyword, "facet") && inside) {
                if (const Status status = facet(); !status)
                    return status.error();
            } else if (same_word(keyword, "color")) {
                drop_once(out_.report, "colours", "colours of STL have no agreed meaning");
            } else {
                return lines_.refuse(printable_in_quotes(keyword) + " does not belong here; the file is damaged");
            }
        }
        if (inside)
            return bad_input("the file has no 'endsolid': it is cut short; copy or export it again", text_.size());
        std::string().swap(text_);
        write_facets();
        out_.vertices = out_.positions.size();
        report_normals(out_);
        return std::move(out_);
    }

  private:
    Status facet() {
        constexpr std::array<std::string_view, 6> kLines{"outer", "vertex", "vertex", "vertex", "endloop", "endfacet"};
        std::array<glm::dvec3, 3> corners{};
        std::size_t corner = 0;
        bool finite = true;
        for (const std::string_view expected : kLines) {
            if (!lines_.next_with_words(false))
                return lines_.refuse("the file ends inside a facet: it is cut short; copy or export it again");
            const std::string_view keyword = lines_.word();
            if (!same_word(keyword, expected))
                return lines_.refuse(printable_in_quotes(keyword) + " where '" + std::string(expected) +
                                     "' belongs; STL holds triangles only");
            if (expected != "vertex")
                continue;
            for (int i = 0; i < 3; ++i) {
                const std::string_view word = lines_.word();
                double value = 0;
                if (!is_number(word, value))
                    return lines_.refuse(word.empty() ? "a vertex of fewer than three numbers"
                                                      : printable_in_quotes(word) + " is not a number");
                finite = finite && std::isfinite(value);
                corners[corner][i] = value;
            }
            ++corner;
        }
        if (!finite) {
            ++out_.dropped_triangles;
            return {};
        }
        if (corners_.size() > kMaxVertices - 3)
            return lines_.refuse("more than 2^31 - 1 corners; split the scan", ErrorCode::too_large);
        corners_.insert(corners_.end(), corners.begin(), corners.end());
        return {};
    }

    // The spelling that OpenMesh accepts, with vertex numbers in place of coordinates: its floats would weld close
    // ones.
    void write_facets() {
        constexpr std::uint32_t kHalf = 1U << 16; // a float holds either half of a number
        const std::vector<std::uint32_t> numbers = weld(corners_, out_.positions);
        std::vector<glm::dvec3>().swap(corners_);
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            if (i % 3 == 0)
                out_.for_openmesh += "facet normal 0 0 0\nouter loop\n";
            out_.for_openmesh +=
                "vertex " + std::to_string(numbers[i] % kHalf) + " " + std::to_string(numbers[i] / kHalf) + " 0\n";
            if (i % 3 == 2)
                out_.for_openmesh += "endloop\nendfacet\n";
        }
        out_.faces = out_.triangles = numbers.size() / 3;
    }

    std::string text_;
    Lines lines_;
    MeshText out_;
    std::vector<glm::dvec3> corners_; // three of each facet that is kept
};

} // namespace

Result<MeshText> check_stl(std::span<const std::uint8_t> bytes) {
    const bool has_header = bytes.size() >= kHeaderSize;
    // Some binary files begin with "solid"; their size identifies them.
    if (has_header && (bytes.size() - kHeaderSize) % kFacetSize == 0 &&
        (bytes.size() - kHeaderSize) / kFacetSize == announced_facets(bytes))
        return check_binary(bytes);
    if (says_solid(bytes))
        return AsciiCheck(bytes).run();
    if (!has_header)
        return bad_input("not an STL file: shorter than a binary header, and no 'solid'", bytes.size());
    return bad_input("binary STL of " + std::to_string(announced_facets(bytes)) + " facets must have " +
                         std::to_string(kHeaderSize + kFacetSize * std::uint64_t{announced_facets(bytes)}) +
                         " bytes, but has " + std::to_string(bytes.size()) +
                         ": it is cut short or damaged; copy or export it again",
                     80);
}

} // namespace pbm::build
