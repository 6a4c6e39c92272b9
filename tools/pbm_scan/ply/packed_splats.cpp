#include "pbm_scan/ply/packed_splats.h"

#include "pbm_scan/clouds/gaussian_splats.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"
#include "system/bytes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::build {
namespace {

constexpr std::size_t kSplatsOfChunk = 256, kMaxBounds = 18, kMinBounds = 12, kPacked = 4;
constexpr std::array<std::string_view, kPacked> kPackedNames{"packed_position", "packed_rotation", "packed_scale",
                                                             "packed_color"};
constexpr std::array<std::string_view, kMaxBounds> kBoundNames{
    "min_x",       "min_y",       "min_z",       "max_x", "max_y", "max_z", "min_scale_x", "min_scale_y", "min_scale_z",
    "max_scale_x", "max_scale_y", "max_scale_z", "min_r", "min_g", "min_b", "max_r",       "max_g",       "max_b"};

const PlyElement *element_of(const PlyHeader &header, std::string_view name) {
    const auto found = std::find_if(header.elements.begin(), header.elements.end(),
                                    [&](const PlyElement &element) { return element.name == name; });
    return found == header.elements.end() ? nullptr : &*found;
}

// Whether the properties are the first ones of `names`, numbers of this type, and at least `least` of them.
bool has_properties(const PlyElement &element, PlyScalar type, std::span<const std::string_view> names,
                    std::size_t least) {
    if (element.properties.size() < least || element.properties.size() > names.size())
        return false;
    for (std::size_t i = 0; i < element.properties.size(); ++i)
        if (element.properties[i].name != names[i] || element.properties[i].type != type ||
            element.properties[i].is_list)
            return false;
    return true;
}

// The bounds of a chunk: centres, logarithms of scales, colours.
struct Bounds3 {
    glm::vec3 least, largest;
};
struct SplatBounds {
    std::array<Bounds3, 3> of{};

    SplatBounds(const std::uint8_t *at, std::size_t numbers) {
        of[2] = {glm::vec3(0), glm::vec3(1)};
        for (std::size_t i = 0; i < numbers; ++i) {
            Bounds3 &bounds = of[i / 6];
            (i % 6 < 3 ? bounds.least : bounds.largest)[static_cast<int>(i % 3)] = load<float>(at + 4 * i);
        }
    }
};

glm::vec3 between(const Bounds3 &bounds, const glm::vec3 &fractions) {
    return bounds.least + fractions * (bounds.largest - bounds.least);
}

float fraction(std::uint32_t packed, int shift, int bits) {
    const std::uint32_t most = (std::uint32_t{1} << bits) - 1;
    return static_cast<float>(packed >> shift & most) / static_cast<float>(most);
}

glm::vec3 fractions_of(std::uint32_t packed) {
    return {fraction(packed, 21, 11), fraction(packed, 11, 10), fraction(packed, 0, 11)};
}

glm::quat unpacked_rotation(std::uint32_t packed) {
    std::array<float, 4> numbers{}; // w x y z
    const std::uint32_t largest = packed >> 30;
    float rest = 1;
    int shift = 20;
    for (std::uint32_t i = 0; i < 4; ++i) {
        if (i == largest)
            continue;
        numbers[i] = (fraction(packed, shift, 10) - 0.5F) * std::sqrt(2.0F);
        rest -= numbers[i] * numbers[i];
        shift -= 10;
    }
    numbers[largest] = std::sqrt(std::max(rest, 0.0F));
    return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

Error wrong_properties(const PlyElement &element) {
    return bad_input(in_line(element) + "element " + printable_in_quotes(element.name) +
                         " has not the properties of packed Gaussian splats; export the scan again, or as plain PLY",
                     element.offset);
}

// Where the rows of both elements begin.
struct PackedRows {
    const PlyElement *chunks = nullptr, *vertices = nullptr;
    std::size_t first_chunk = 0, first_vertex = 0, end = 0;
};

Result<PackedRows> find_rows(std::span<const std::uint8_t> bytes, const PlyHeader &header) {
    PackedRows rows{
        .chunks = element_of(header, "chunk"), .vertices = element_of(header, "vertex"), .end = header.body_offset};
    if (!has_properties(*rows.chunks, PlyScalar::float32, kBoundNames, kMinBounds) ||
        (rows.chunks->properties.size() != kMinBounds && rows.chunks->properties.size() != kMaxBounds))
        return wrong_properties(*rows.chunks);
    if (!has_properties(*rows.vertices, PlyScalar::uint32, kPackedNames, kPacked))
        return wrong_properties(*rows.vertices);
    for (const PlyElement &element : header.elements) {
        if (has_lists(element))
            return wrong_properties(element);
        if (&element == rows.chunks)
            rows.first_chunk = rows.end;
        if (&element == rows.vertices)
            rows.first_vertex = rows.end;
        const std::size_t size = min_row_size(element, false);
        if (size != 0 && element.count > (bytes.size() - rows.end) / size)
            return bad_input(in_line(element) + "element " + printable_in_quotes(element.name) + " announces " +
                                 std::to_string(element.count) +
                                 " rows, and the file ends before: it is cut short; copy or export it again",
                             element.offset);
        rows.end += static_cast<std::size_t>(element.count) * size;
    }
    if (rows.vertices->count == 0)
        return bad_input("the file has no splats: there is nothing to build");
    if (rows.chunks->count < (rows.vertices->count + kSplatsOfChunk - 1) / kSplatsOfChunk)
        return bad_input(in_line(*rows.chunks) + "fewer chunks than " + std::to_string(rows.vertices->count) +
                             " splats need: the file is damaged; export it again",
                         rows.chunks->offset);
    return rows;
}

} // namespace

bool are_packed_splats(const PlyHeader &header) {
    const PlyElement *const vertex = element_of(header, "vertex");
    return vertex != nullptr && element_of(header, "chunk") != nullptr && !vertex->properties.empty() &&
           vertex->properties.front().name == kPackedNames.front();
}

Result<Surface> read_packed_splats(std::span<const std::uint8_t> bytes, const PlyHeader &header,
                                   const ReadOptions &options) {
    if (header.encoding != PlyEncoding::little_endian)
        return unsupported("packed Gaussian splats as " +
                           std::string(kEncodingNames[static_cast<std::size_t>(header.encoding)]) +
                           "; export them as binary_little_endian, or as plain PLY");
    const Result<PackedRows> rows = find_rows(bytes, header);
    if (!rows)
        return rows.error();
    const auto count = static_cast<std::size_t>(rows->vertices->count);
    const std::size_t numbers = rows->chunks->properties.size();
    Surface surface;
    GaussianSplats splats;
    surface.positions.reserve(count);
    surface.colours.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const SplatBounds bounds(bytes.data() + rows->first_chunk + i / kSplatsOfChunk * 4 * numbers, numbers);
        const std::uint8_t *const row = bytes.data() + rows->first_vertex + 4 * kPacked * i;
        const auto packed = [row](std::size_t k) { return load<std::uint32_t>(row + 4 * k); };
        surface.positions.emplace_back(between(bounds.of[0], fractions_of(packed(0))));
        const glm::vec3 scale = between(bounds.of[1], fractions_of(packed(2)));
        splats.scales.emplace_back(exponential(scale.x), exponential(scale.y), exponential(scale.z));
        splats.rotations.push_back(unpacked_rotation(packed(1)));
        const std::uint32_t colour = packed(3);
        surface.colours.push_back(colour_bytes(
            between(bounds.of[2], {fraction(colour, 24, 8), fraction(colour, 16, 8), fraction(colour, 8, 8)}), 255.0F));
        splats.opacities.push_back(fraction(colour, 0, 8));
    }
    surface.report.push_back({"vertex.packed_position", Fate::kept, "the centres of Gaussian splats"});
    surface.report.push_back({"vertex.packed_color", Fate::converted, kSplatColourNote});
    surface.report.push_back({"vertex.packed_rotation packed_scale", Fate::converted, kSplatShapeNote});
    for (const PlyElement &element : header.elements)
        if (&element != rows->chunks && &element != rows->vertices && element.count != 0)
            surface.report.push_back({"element " + printable_in_quotes(element.name), Fate::dropped,
                                      element.name == "sh" ? kSplatHarmonicsNote : "not used by PBM"});
    if (Status shown = show_discs(surface, splats, options); !shown)
        return shown.error();
    turn_upright(surface);
    report_trailing(surface.report, bytes.size() - rows->end, "after the last element");
    return finished(std::move(surface), options);
}

} // namespace pbm::build
