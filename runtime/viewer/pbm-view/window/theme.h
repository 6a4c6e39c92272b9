// Light or dark windows.
#pragma once

namespace pbm {

enum class Theme { desktop, dark, light }; // desktop: dark unless the desktop asks for light

} // namespace pbm
