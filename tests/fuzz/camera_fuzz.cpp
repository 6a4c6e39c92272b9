// A camera that is read has ascending frames, and each of its views is one that choose_camera accepts or refuses.
#include "viewer/cameras/camera_file.h"

#include <cmath>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    using namespace pbm;
    const auto path = parse_camera({data, size}, {});
    if (!path)
        return 0;
    const int frames = frame_count(*path, 24);
    assert(frames >= 1);
    const Extent extent{.sphere = {.centre = {0, 1, 2}, .radius = 3}, .corners = {{0, 0, 0}, {1, 2, 3}}};
    double before = -INFINITY;
    for (const int frame : {1, frames / 2 + 1, frames}) {
        const double time = frame_time(*path, frame, 24);
        assert(time >= before && time >= path->begin && time <= path->end);
        before = time;
        const ViewOptions view = view_at(*path, time, extent, UpAxis::z, {});
        const auto camera = choose_camera(view, extent, {}, {64, 48});
        assert(!camera || is_usable(*camera));
    }
    return 0;
}
