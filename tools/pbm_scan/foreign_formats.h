// File formats that are recognised, and refused with a remedy.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace pbm::build {

// Return the message "the file is ...", with a remedy, if the first bytes or the extension (lower case, with its dot)
// are those of such a format.
std::optional<std::string> foreign_by_content(std::span<const std::uint8_t> bytes);
std::optional<std::string> foreign_by_name(std::string_view extension);

} // namespace pbm::build
