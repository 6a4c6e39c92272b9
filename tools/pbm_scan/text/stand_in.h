// What a download leaves in place of a file.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace pbm::build {

// "a pointer of Git LFS, ...", with a remedy, if the bytes are one, or a page of HTML. Such a file has any name.
std::optional<std::string> stand_in(std::string_view bytes);

} // namespace pbm::build
