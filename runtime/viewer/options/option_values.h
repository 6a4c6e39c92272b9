// Parses values of options: resolutions, vectors, colours, angles.
#pragma once

#include "pbm_render/camera/camera.h"
#include "pbm_render/picture/framebuffer.h"
#include "system/error.h"
#include "viewer/options/look_options.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <string>
#include <vector>

namespace pbm {

// "W,H" or "WxH", each 1..kMaxPictureEdge.
Result<glm::ivec2> parse_resolution(const std::string &text);
// "x,y,z": finite numbers in the C locale's spelling.
Result<glm::dvec3> parse_vector(const std::string &text);
// "x,y,z,nx,ny,nz": a point of the plane, and its normal on the side that is kept.
Result<ClipPlane> parse_clip_plane(const std::string &text);
// "x,y,z,x,y,z": two opposite corners.
Result<ClipBox> parse_clip_box(const std::string &text);
// "r,g,b", each 0..1, sRGB; or "r,g,b,r,g,b", at the upper and the lower edge of pictures.
Status parse_background(const std::string &text, RenderOptions &options);
// "right,up": -180..180 and -90..90 degrees.
Result<Headlight> parse_headlight(const std::string &text);
// "NAME[,MIN,MAX][,MAP]": a field, the values with the first and the last colour, a colour map.
Result<ColourBy> parse_colour_by(const std::string &text);
std::string colour_by_text(const ColourBy &by);
// The fields that the model of a scan must have for this look.
std::vector<std::string> fields_to_keep(const LookOptions &look);
// Frames per second: 1..240, or 0 for any.
Result<double> parse_frame_rate(const std::string &text);

} // namespace pbm
