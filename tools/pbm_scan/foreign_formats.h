// File formats that are known and not read.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace pbm::build {

// "the file is ...", with a remedy. By the first bytes, and by a lower-case extension with its dot.
std::optional<std::string> foreign_by_content(std::span<const std::uint8_t> bytes);
std::optional<std::string> foreign_by_name(std::string_view extension);

} // namespace pbm::build
