#include "pbm_scan/mesh/mesh_reader.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"
#include "system/bytes.h"
#include "system/free_memory.h"

#include <array>
#include <bit>
#include <numeric>
#include <optional>

namespace pbm::build {
namespace {

constexpr std::size_t kHeaderSize = 84; // of binary STL: 80 bytes of anything, the number of facets
constexpr std::int64_t kFacetSize = 50; // normal and three corners as floats, two bytes of attributes

// Of a file that has a header.
std::uint32_t announced_facets(std::span<const std::uint8_t> bytes) { return load<std::uint32_t>(bytes.data() + 80); }

// The bytes behind the last facet of a binary file; negative: facets are missing, or it has no header.
std::int64_t bytes_behind_facets(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < kHeaderSize)
        return -1;
    return static_cast<std::int64_t>(bytes.size() - kHeaderSize) -
           static_cast<std::int64_t>(kFacetSize * std::uint64_t{announced_facets(bytes)});
}

// Whether the file's size fits its number of facets, which identifies binary files that begin with "solid".
bool has_size_of_binary(std::span<const std::uint8_t> bytes) { return bytes_behind_facets(bytes) == 0; }

// Whether the file is text: it begins with "solid", and has no NUL within the size of a binary header.
bool says_solid(std::span<const std::uint8_t> bytes) {
    const std::span<const std::uint8_t> head = bytes.first(std::min(bytes.size(), kHeaderSize));
    if (head.size() == kHeaderSize && std::find(head.begin(), head.end(), std::uint8_t{0}) != head.end())
        return false;
    std::size_t at = 0;
    while (at < bytes.size() && ends_word(static_cast<char>(bytes[at])))
        ++at;
    const std::string_view word = as_text(bytes.subspan(at, std::min<std::size_t>(5, bytes.size() - at)));
    return same_word(word, "solid");
}

constexpr std::uint16_t kPlainFacet = 0x8000; // of a facet

// The facets of a file in either encoding.
struct Facets {
    std::vector<glm::dvec3> corners; // three of each, all finite
    std::uint64_t dropped = 0;       // not finite
    // Of facets: 5 bits a channel, red highest, or kPlainFacet; empty: no facet has one.
    std::vector<std::uint16_t> colours;
    std::optional<Rgb8> of_others{}; // the colour of facets without one; absent: the default colour
    std::vector<AttributeReport> report;
};

// Calls `visit` with each facet of a binary file whose corners are finite; returns how many others there are.
template <class Visit> std::uint64_t for_facets(std::span<const std::uint8_t> bytes, const Visit &visit) {
    std::uint64_t dropped = 0;
    const std::size_t end = kHeaderSize + kFacetSize * announced_facets(bytes);
    for (std::size_t at = kHeaderSize; at < end; at += kFacetSize) {
        const auto corners = load<std::array<float, 9>>(bytes.data() + at + 12);
        if (std::all_of(corners.begin(), corners.end(), [](float value) { return std::isfinite(value); }))
            visit(corners, load<std::uint16_t>(bytes.data() + at + 48));
        else
            ++dropped;
    }
    return dropped;
}

// Makes colours of the attributes of facets; `are_used`: not all of them are 0. Materialise writes the colour of the
// object into the header; facets without the top bit have their own. In VisCAM and SolidView facets with the top bit
// have one. Other programs write other things there.
void find_colours(std::span<const std::uint8_t> bytes, bool are_used, Facets &out) {
    constexpr std::size_t kTextSize = 80; // of the header
    const ByteView header = bytes.first(kTextSize);
    const auto behind = [header](std::string_view word, std::size_t size) {
        const std::size_t at = as_text(header).find(word);
        const bool is_there = at != std::string_view::npos && at + word.size() + size <= header.size();
        const ByteView content = is_there ? header.subspan(at + word.size(), size) : ByteView();
        return std::any_of(content.begin(), content.end(), [](auto byte) { return byte != 0; }) ? content : ByteView();
    };
    const ByteView object = behind("COLOR=", 4); // red, green, blue, opacity
    if (!are_used && object.empty())
        return;
    std::vector<std::uint16_t> attributes;
    attributes.reserve(out.corners.size() / 3);
    for_facets(bytes, [&](const auto & /*corners*/, std::uint16_t bits) { attributes.push_back(bits); });
    const auto fits_viscam = [](std::uint16_t bits) { return bits == 0 || bits >= kPlainFacet; };
    if (!object.empty()) {
        for (std::uint16_t &bits : attributes)
            bits = !are_used || bits >= kPlainFacet
                       ? kPlainFacet
                       : static_cast<std::uint16_t>((bits & 31) << 10 | (bits & 0x3E0) | (bits >> 10 & 31));
        out.of_others = Rgb8{object[0], object[1], object[2]};
        out.report.push_back({"colours", Fate::converted,
                              are_used ? "of the object and its facets, as Materialise has them; sRGB, 5 bits to 8"
                                       : "of the object, as Materialise has it; sRGB"});
        if (!behind("MATERIAL=", 12).empty()) // three colours
            drop_once(out.report, "MATERIAL= of the header", "PBM uses the colours of the object and its facets");
    } else if (std::all_of(attributes.begin(), attributes.end(), fits_viscam)) {
        for (std::uint16_t &bits : attributes)
            bits = bits == 0 ? kPlainFacet : static_cast<std::uint16_t>(bits & ~kPlainFacet);
        out.report.push_back({"colours", Fate::converted, "of facets, as VisCAM has them; sRGB, 5 bits to 8"});
    } else {
        drop_once(out.report, "attribute bytes", "they are no colours of Materialise or VisCAM");
        return;
    }
    out.colours = std::move(attributes);
}

Facets read_binary(std::span<const std::uint8_t> bytes) {
    Facets out;
    const std::size_t facets = announced_facets(bytes);
    out.corners.reserve(facets * 3);
    unsigned any = 0;
    out.dropped = for_facets(bytes, [&](const std::array<float, 9> &corners, std::uint16_t attributes) {
        any |= attributes;
        for (std::size_t i = 0; i < 9; i += 3)
            out.corners.emplace_back(corners[i], corners[i + 1], corners[i + 2]);
    });
    find_colours(bytes, any != 0, out);
    report_trailing(out.report, bytes.size() - kHeaderSize - kFacetSize * facets, "behind the last facet");
    return out;
}

std::uint64_t hash_of(const glm::dvec3 &p) {
    constexpr std::uint64_t kOdd = 0x9E3779B97F4A7C15;
    std::uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis) {
        hash = (hash ^ std::bit_cast<std::uint64_t>(p[axis] + 0.0)) * kOdd; // + 0.0: -0 is 0
        hash ^= hash >> 32;
    }
    return hash;
}

// The first corner that equals each, by a table of hashes. Nothing if too many corners share a hash: a hostile file
// could make all of them equal.
std::optional<std::vector<std::uint32_t>> first_equals(std::span<const glm::dvec3> corners) {
    constexpr std::size_t kMaxProbes = 256;
    constexpr std::uint32_t kEmpty = 0xFFFFFFFF;
    const std::size_t size = std::bit_ceil(corners.size() + corners.size() / 2 + 1);
    std::vector<std::uint32_t> table(size, kEmpty), first(corners.size());
    for (std::uint32_t i = 0; i < corners.size(); ++i) {
        std::size_t at = hash_of(corners[i]) & (size - 1), probes = 0;
        while (table[at] != kEmpty && corners[table[at]] != corners[i]) {
            at = (at + 1) & (size - 1);
            if (++probes == kMaxProbes)
                return std::nullopt;
        }
        if (table[at] == kEmpty)
            table[at] = i;
        first[i] = table[at];
    }
    return first;
}

// The same by sorting.
std::vector<std::uint32_t> sorted_first_equals(std::span<const glm::dvec3> corners) {
    const auto before = [&](std::uint32_t a, std::uint32_t b) {
        const glm::dvec3 &p = corners[a], &q = corners[b];
        return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z != q.z ? p.z < q.z : a < b;
    };
    std::vector<std::uint32_t> order(corners.size()), first(corners.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), before);
    for (std::size_t i = 0, same = 0; i < order.size(); ++i) {
        same = corners[order[i]] == corners[order[same]] ? same : i;
        first[order[i]] = order[same];
    }
    return first;
}

// Welds corners with equal coordinates: returns the vertex of each corner, numbered in the order of the file.
std::vector<std::uint32_t> weld(std::span<const glm::dvec3> corners, std::vector<glm::dvec3> &vertices) {
    auto by_hash = first_equals(corners);
    std::vector<std::uint32_t> numbers = by_hash ? std::move(*by_hash) : sorted_first_equals(corners);
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

// A text, whose keywords begin lines, or stand anywhere (`is_free`). Names, "normal" with its numbers and "loop" are
// passed over.
class AsciiFacets {
  public:
    AsciiFacets(std::string_view text, const ReadOptions &options, bool is_free)
        : size_(text.size()), progress_(options.progress), lines_(text), is_free_(is_free) {}

    Result<Facets> run() {
        bool inside = false;
        while (next()) {
            const std::string_view keyword = this->keyword(kOuter);
            if (is_free_ && keyword.empty())
                break; // a name was the last word
            if (same_word(keyword, "solid") && !inside) {
                inside = true;
            } else if (same_word(keyword, "endsolid") && inside) {
                inside = false;
                if (!is_free_ && lines_.rest().find("facet normal") != std::string_view::npos)
                    return lines_.refuse("another solid on the same line");
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
            return bad_input("the file has no 'endsolid': it is cut short; copy or export it again", size_);
        return std::move(out_);
    }

  private:
    static constexpr std::array<std::string_view, 3> kEnds{"endsolid", "endfacet", "endloop"};
    // A name before the first facet may have words of the others.
    static constexpr std::array<std::string_view, 4> kOuter{"solid", "endsolid", "facet", "color"};
    static constexpr std::array<std::string_view, 8> kAll{"solid",  "endsolid", "facet",    "outer",
                                                          "vertex", "endloop",  "endfacet", "color"};

    // Goes to the next place where a keyword may stand.
    bool next() { return (is_free_ && lines_.to_word()) || lines_.next_with_words(false); }

    // The next word; "end" and the word behind it are one. In free text the next of `keywords`, or nothing.
    std::string_view keyword(std::span<const std::string_view> keywords) {
        const std::string_view word = lines_.word();
        return is_free_ || same_word(word, "end") ? unusual_keyword(word, keywords) : word;
    }

    // Not inlined: that keeps the usual way short.
    [[gnu::noinline]] std::string_view unusual_keyword(std::string_view word,
                                                       std::span<const std::string_view> keywords) {
        for (;; word = lines_.word()) {
            if (same_word(word, "end")) {
                const Lines behind = lines_;
                const std::string_view what = lines_.word();
                const auto *const found = std::find_if(kEnds.begin(), kEnds.end(), [&](std::string_view each) {
                    return same_word(what, each.substr(word.size()));
                });
                if (found != kEnds.end())
                    word = *found;
                else
                    lines_ = behind;
            }
            const auto is_word = [word](std::string_view each) { return same_word(word, each); };
            if (!is_free_ || std::any_of(keywords.begin(), keywords.end(), is_word))
                return word;
            if (!next())
                return {};
        }
    }

    Status facet() {
        constexpr std::array<std::string_view, 6> kLines{"outer", "vertex", "vertex", "vertex", "endloop", "endfacet"};
        std::array<glm::dvec3, 3> corners{};
        std::size_t corner = 0;
        bool finite = true;
        for (const std::string_view expected : kLines) {
            if (!next())
                return lines_.refuse("the file ends inside a facet: it is cut short; copy or export it again");
            const std::string_view keyword = this->keyword(kAll);
            if (!same_word(keyword, expected))
                return lines_.refuse(printable_in_quotes(keyword) + " where '" + std::string(expected) +
                                     "' belongs; STL holds triangles only");
            if (expected != "vertex")
                continue;
            for (int i = 0; i < 3; ++i) {
                const std::string_view word = lines_.word();
                double value = 0;
                if (!is_number(word, value) && !(is_free_ && word.empty() && next() && is_number(lines_.word(), value)))
                    return lines_.refuse(word.empty() ? "a vertex of fewer than three numbers"
                                                      : printable_in_quotes(word) + " is not a number");
                finite = finite && std::isfinite(value);
                corners[corner][i] = value;
            }
            ++corner;
        }
        if (!is_free_ && lines_.to_word())
            return lines_.refuse(printable_in_quotes(lines_.word()) + " behind 'endfacet'");
        if (!finite) {
            ++out_.dropped;
            return {};
        }
        if (out_.corners.size() > kMaxVertices - 3)
            return lines_.refuse("more than 2^31 - 1 corners; split the scan", ErrorCode::too_large);
        out_.corners.insert(out_.corners.end(), corners.begin(), corners.end());
        constexpr std::size_t kReported = 3 << 16;
        if (progress_ && out_.corners.size() % kReported == 0)
            progress_(0.7 * static_cast<double>(lines_.offset()) / static_cast<double>(size_));
        return {};
    }

    std::size_t size_;
    const std::function<void(double)> &progress_;
    Lines lines_;
    bool is_free_;
    Facets out_;
};

// By lines, as nearly all programs write it; else as free text, which takes longer.
Result<Facets> read_ascii(std::string_view text, const ReadOptions &options) {
    Result<Facets> by_lines = AsciiFacets(text, options, false).run();
    if (by_lines || by_lines.error().code != ErrorCode::bad_input)
        return by_lines;
    Result<Facets> by_words = AsciiFacets(text, options, true).run();
    return by_words ? std::move(by_words) : std::move(by_lines);
}

Result<Facets> read_facets(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    const std::int64_t behind = bytes_behind_facets(bytes);
    const bool is_text = behind != 0 && says_solid(bytes);
    // Whole facets behind the last one are damage of the count.
    if (!is_text && (behind == 0 || (behind > 0 && behind % kFacetSize != 0 && announced_facets(bytes) != 0))) {
        if (announced_facets(bytes) > kMaxVertices / 3)
            return too_large("more than 2^31 - 1 corners; split the scan", 80);
        return read_binary(bytes);
    }
    if (is_text) {
        if (const Status status = refuse_nul(as_text(bytes)); !status)
            return status.error();
        std::string storage;
        return read_ascii(with_line_feeds(as_text(bytes), storage), options);
    }
    const auto is_of_text = [](std::uint8_t byte) { return byte >= ' ' || ends_word(static_cast<char>(byte)); };
    if (const auto head = bytes.first(std::min<std::size_t>(bytes.size(), 256));
        std::all_of(head.begin(), head.end(), is_of_text))
        return bad_input("not an STL file: a text that does not begin with 'solid'");
    if (bytes.size() < kHeaderSize)
        return bad_input("not an STL file: shorter than a binary header, and no 'solid'", bytes.size());
    return bad_input("binary STL of " + std::to_string(announced_facets(bytes)) + " facets must have " +
                         std::to_string(kHeaderSize + kFacetSize * std::uint64_t{announced_facets(bytes)}) +
                         " bytes, but has " + std::to_string(bytes.size()) +
                         ": it is cut short or damaged; copy or export it again",
                     80);
}

} // namespace

bool is_stl(std::span<const std::uint8_t> bytes) {
    const std::string_view text = as_text(bytes).substr(0, 6);
    return text == "solid " || text == "solid\n" || text == "solid\r" || has_size_of_binary(bytes);
}

namespace {

// sRGB of 5 bits a channel, red highest.
Rgb8 expand_555(std::uint16_t colour) {
    const auto channel = [colour](int shift) {
        return static_cast<std::uint8_t>(((colour >> shift & 31) * 255 + 15) / 31);
    };
    return {channel(10), channel(5), channel(0)};
}

// The triangles of facets whose corners are these vertices.
void add_triangles(const std::vector<std::uint32_t> &vertices, const Facets &facets, Surface &surface) {
    surface.triangles.reserve(vertices.size() / 3);
    for (std::size_t i = 0; i < vertices.size(); i += 3) {
        const std::array<std::uint32_t, 3> t{vertices[i], vertices[i + 1], vertices[i + 2]};
        if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) {
            ++surface.dropped_triangles;
            continue;
        }
        surface.triangles.emplace_back(t[0], t[1], t[2]);
        if (facets.colours.empty())
            continue;
        const std::uint16_t own = facets.colours[i / 3];
        surface.face_colours.push_back(own != kPlainFacet ? FaceColour{expand_555(own), true}
                                       : facets.of_others ? FaceColour{*facets.of_others, true}
                                                          : FaceColour{});
    }
}

} // namespace

Result<Surface> read_stl(std::span<const std::uint8_t> bytes, const ReadOptions &options) {
    Result<Facets> facets = read_facets(bytes, options);
    if (!facets)
        return facets.error();
    Surface surface;
    surface.has_facets = true;
    surface.dropped_triangles = facets->dropped;
    const std::vector<std::uint32_t> vertices = weld(facets->corners, surface.positions);
    free_memory(facets->corners);
    add_triangles(vertices, *facets, surface);
    if (options.progress)
        options.progress(1.0);
    surface.report.push_back({"positions", Fate::kept, "equal corners welded"});
    if (!surface.triangles.empty() || surface.dropped_triangles != 0)
        surface.report.push_back({"faces", Fate::kept, "polygons as triangles"});
    surface.report.push_back({"facet normals", Fate::converted, "follow from the corners"});
    surface.report.insert(surface.report.end(), facets->report.begin(), facets->report.end());
    return finished(std::move(surface), options);
}

} // namespace pbm::build
