// The XML section of an E57 file as a tree of elements.
// Format: ASTM E2807-11, section 8.4
#pragma once

#include "pbm_scan/e57/e57_pages.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pbm::build {

struct E57Element {
    std::string name; // with the prefix of its namespace, "nor:normalX"
    std::string text; // its own, without that of its children
    std::vector<std::pair<std::string, std::string>> attributes;
    std::vector<std::uint32_t> children; // indices of E57Xml::elements, in the order of the file
    std::uint64_t offset = 0;            // of its tag, physical

    std::optional<std::string_view> attribute(std::string_view key) const;
};

struct E57Xml {
    std::vector<E57Element> elements; // the first one is the root

    const E57Element &root() const { return elements.front(); }
    const E57Element *child(const E57Element &parent, std::string_view name) const; // null: there is none
    // The number in `name` below `parent`: `otherwise` if there is no such element, 0 if it is empty.
    // errors  bad_input  text that is no number
    Result<double> number(const E57Element &parent, std::string_view name, double otherwise) const;
};

inline constexpr std::uint64_t kMaxE57XmlBytes = std::uint64_t{64} << 20;
inline constexpr std::size_t kMaxE57Elements = 1 << 20;
inline constexpr std::size_t kMaxE57Depth = 64;

// Parses the section. Document types and entities of their own are refused: E57 has none, and they expand without
// bound.
//
// errors  bad_input  XML that is not well-formed, a wrong checksum
//         too_large  over the limits above
Result<E57Xml> read_e57_xml(E57Pages &pages);

} // namespace pbm::build
