// Encoders of header, section table, small sections and chunk directories; layout.h has the decoders. BVG.md 2, 3, 5.3
#pragma once

#include "pbm_format/container/layout.h"

namespace pbm {

// 128 bytes; the header's own hash is last.
Bytes encode_header(const FileHeader &header);
Bytes encode_section_table(std::span<const SectionEntry> entries);
Bytes encode_grid(const Grid &grid);
Bytes encode_attributes(const AttributeSet &set, int depth);
Bytes encode_materials(std::span<const Material> materials);
Bytes encode_shapes(std::span<const Material> materials);
Bytes encode_lights(std::span<const Light> lights);
Bytes encode_texture(const SolidTexture &texture);
Bytes encode_ground_plane(const GroundPlane &ground);
Bytes encode_directory(const LevelDirectory &directory, const AttributeSet &set);

} // namespace pbm
