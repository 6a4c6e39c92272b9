#include "pbm_format/streams/stream_view.h"

namespace pbm {

PointView view_points(const PointAttributes &points, std::size_t first, std::size_t count, const AttributeSet &set) {
    const auto colour_bytes = static_cast<std::size_t>(set.colour_bytes());
    PointView view;
    view.normals = std::span(points.normals).subspan(first, count);
    view.radii = ByteView(points.radii).subspan(first, count);
    view.colours = ByteView(points.colours).subspan(colour_bytes * first, colour_bytes * count);
    if (set.material)
        view.materials = ByteView(points.materials).subspan(first, count);
    if (set.texture)
        view.textures = ByteView(points.textures).subspan(first, count);
    for (std::size_t light = 0; light < static_cast<std::size_t>(set.lights); ++light)
        view.shadows[light] = ByteView(points.shadows[light]).subspan(first, count);
    return view;
}

} // namespace pbm
