// Law: drawing a chunk of arbitrary bytes (bytes of a mapped file may change after verification) stays within its
// streams and gives the same picture twice, for any camera and picture size.
// Input: sizes, attributes, light, level and run; then the camera; then the streams.
#include "pbm_render/bricks/chunk_offsets.h"
#include "pbm_render/fast/fast_renderer.h"

#include "fuzz/byte_source.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace {

using namespace pbm;

constexpr std::size_t kMaxDrawn = 512;

// An allocation of exactly `count` elements: a sanitizer sees any access beyond.
template <class T> std::vector<T> any(test::ByteSource &input, std::size_t count) {
    const Bytes bytes = input.bytes(count * sizeof(T));
    std::vector<T> values(count);
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

ModelParameters choose_parameters(test::ByteSource &input) {
    ModelParameters parameters;
    const std::uint8_t choice = input.next();
    parameters.grid.voxel_size = 1;
    parameters.attributes.colour = static_cast<ColourFormat>(choice % 3);
    parameters.attributes.material = (choice & 4) != 0;
    parameters.materials.resize(1 + (choice >> 3) % 2);
    if ((choice & 32) != 0) {
        parameters.lights.resize(1);
        parameters.lights[0].kind = static_cast<LightKind>((choice >> 6) % 3);
        parameters.attributes.lights = 1;
        parameters.attributes.shadow_bits[0].fill(static_cast<std::uint8_t>(1U << (choice >> 6)));
    }
    return parameters;
}

// -2 .. 2 edges of the cube, or nearly zero, of either sign.
double coordinate(test::ByteSource &input) {
    const double value = static_cast<double>(input.below(65536)) / 16384 - 2;
    return (input.next() & 7) == 0 ? std::ldexp(value, -40) : value;
}

void require(bool law) {
    if (!law)
        std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (size == 0)
        return 0;
    test::ByteSource input({data, size});
    ModelParameters parameters = choose_parameters(input);
    const int level = 1 + static_cast<int>(input.below(kMaxDepth));
    parameters.grid.depth = std::max(level, 2);
    const std::size_t nodes = 1 + input.below(kMaxDrawn), points = 1 + input.below(kMaxDrawn),
                      bricks = 1 + input.below(16);
    const int width = 1 + static_cast<int>(input.below(70)), height = 1 + static_cast<int>(input.below(40));
    const auto first = static_cast<std::uint32_t>(input.below(points));
    const auto last = first + 1 + static_cast<std::uint32_t>(input.below(points - first));

    Camera camera;
    const double edge = parameters.grid.edge();
    for (glm::dvec3 *place : {&camera.position, &camera.focal_point})
        for (int axis = 0; axis < 3; ++axis)
            (*place)[axis] = (0.5 + coordinate(input)) * edge;
    camera.view_angle = std::ldexp(3.14, -static_cast<int>(input.below(24)));
    if (!is_usable(camera))
        return 0;

    const AttributeSet &set = parameters.attributes;
    const Bytes masks = input.bytes(nodes), radii = input.bytes(points);
    const Bytes colours = input.bytes(points * static_cast<std::size_t>(set.colour_bytes()));
    const Bytes materials = input.bytes(set.material ? points : 0);
    const Bytes shadows =
        input.bytes(set.lights > 0 ? (points * set.shadow_bits[0][static_cast<std::size_t>(level)] + 7) / 8 : 0);
    const auto normals = any<std::uint16_t>(input, points);
    const auto records = any<BrickRecord>(input, bricks);
    ChunkView view;
    view.masks = masks;
    view.normals = normals;
    view.radii = radii;
    view.colours = colours;
    view.materials = materials;
    view.shadows[0] = shadows;
    view.bricks = records;
    const ChunkEntry entry;
    const ChunkOffsets offsets;
    std::vector<PointRun> runs(2, {.chunk = &view, .entry = &entry, .level = level, .first = first, .last = last});
    runs[1].offsets = &offsets;

    FastRenderer renderer(parameters, kMaxDrawn, 1);
    Framebuffer once(width, height), twice(width, height);
    const RenderStatistics drawn = renderer.render(runs, camera, {}, once);
    require(drawn.drawn_points <= 2 * bricks * kMaxDrawn * static_cast<std::size_t>(height));
    renderer.render(runs, camera, {}, twice);
    require(once.colour == twice.colour);
    require(std::memcmp(once.depth.data(), twice.depth.data(), once.pixels() * sizeof(float)) == 0);
    return 0;
}
