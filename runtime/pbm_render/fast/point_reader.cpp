#include "pbm_render/fast/point_reader.h"

#include <algorithm>
#include <optional>

namespace pbm {

void PointReader::begin(const ModelParameters &parameters, const Appearance &appearance, const DrawnRuns &runs) {
    const AttributeSet &set = parameters.attributes;
    const std::optional<StreamInfo> indices = palette_stream(set);
    ids_ = runs.ids();
    colour_bytes_ = static_cast<std::size_t>(set.colour_bytes());
    last_material_ = parameters.materials.size() - 1;
    streams_.clear();
    for (std::size_t i = 0; i < runs.size(); ++i) {
        const ChunkView &chunk = *runs[i].chunk;
        Streams &streams = streams_.emplace_back(Streams{chunk.normals.data(),
                                                         chunk.colours.data(),
                                                         chunk.materials.data(),
                                                         indices ? chunk.values(*indices).data() : nullptr,
                                                         {}});
        for (std::size_t l = 0; l < static_cast<std::size_t>(set.lights); ++l)
            streams.shadows[l] = shadow_stream(runs[i], l, set, appearance.shadows[l]);
    }
}

// Finds a batch's points, and prefetches their values: cache misses of many points overlap.
void PointReader::locate(const CoveredPixels &pixels, std::size_t first, std::size_t shadowed, Batch &to) const {
    to.first = first;
    to.count = std::min(Batch::kPoints, pixels.count - first);
    const std::int32_t *const ids = to.ids = pixels.id.data() + first;
    const PointIds split = ids_;
    const std::size_t colour_bytes = colour_bytes_;
    const Streams *const streams = streams_.data();
    for (std::size_t i = 0; i < to.count; ++i) {
        const auto id = static_cast<std::uint32_t>(ids[i]);
        const Streams &from = streams[split.run(id)];
        const std::size_t point = split.point(id);
        to.from[i] = &from;
        to.point[i] = static_cast<std::uint32_t>(point);
        __builtin_prefetch(from.normals + point);
        __builtin_prefetch(from.colours + point * colour_bytes);
        for (std::size_t light = 0; light < shadowed; ++light)
            __builtin_prefetch(from.shadows[light].values + point * from.shadows[light].bits / 8);
    }
}

void PointReader::read(const CoveredPixels &pixels, int y, const ShadedFrame &frame, PointRow &row) const {
    row.count = pixels.count;
    std::array<Batch, 2> batches; // one is read while the next is prefetched
    if (pixels.count > 0)
        locate(pixels, 0, frame.lighting.shadowed, batches[0]);
    for (std::size_t first = 0, i = 0; first < pixels.count; first += Batch::kPoints, i ^= 1) {
        if (first + Batch::kPoints < pixels.count)
            locate(pixels, first + Batch::kPoints, frame.lighting.shadowed, batches[i ^ 1]);
        if (!frame.shader.has_shaded_normals())
            read_batch(batches[i], frame, row);
        if (frame.shader.has_shaded_normals() || frame.lighting.mirrors)
            read_by_normal(batches[i], pixels, y, frame, row);
    }
}

void PointReader::read_batch(const Batch &batch, const ShadedFrame &frame, PointRow &row) const {
    const NormalSums &sums = normal_sums();
    std::uint32_t *const normals = row.normal.data() + batch.first;
    if (frame.geometry.shows_backs)
        for (std::size_t i = 0; i < batch.count; ++i)
            normals[i] = normal_code(batch.normal(i), sums);
    else
        for (std::size_t i = 0; i < batch.count; ++i)
            normals[i] = normal_code(batch.from[i]->normals[batch.point[i]], sums);
    read_colours(batch, frame, row.colour.data() + batch.first);
    const auto phong_of = [&](std::size_t i) {
        const Material &of = frame.appearance.materials[material(*batch.from[i], batch.point[i])];
        return Float4{of.kd, of.ks, of.power, of.ka};
    };
    if (!frame.lighting.one_material)
        for (std::size_t i = 0; i < batch.count; ++i)
            row.phong[batch.first + i] = phong_of(i);
    else if (batch.first == 0)
        row.phong[0] = phong_of(0);
    for (std::size_t light = 0; light < frame.lighting.shadowed; ++light) {
        float *const lit = row.lit[light].data() + batch.first;
        for (std::size_t i = 0; i < batch.count; ++i)
            lit[i] = batch.from[i]->shadows[light].lit(batch.point[i]);
    }
}

void PointReader::read_colours(const Batch &batch, const ShadedFrame &frame, std::uint32_t *to) const {
    const auto fill = [&](auto &&colour) {
        for (std::size_t i = 0; i < batch.count; ++i)
            to[i] = colour(*batch.from[i], std::size_t{batch.point[i]});
    };
    switch (frame.shader.colour_source()) {
    case ColourSource::texture:
        fill([&](const Streams &from, std::size_t point) { return frame.shader.palette()[from.indices[point]]; });
        break;
    case ColourSource::material:
        fill([&](const Streams &from, std::size_t point) {
            return pack_rgb(frame.appearance.materials[material(from, static_cast<std::uint32_t>(point))].colour);
        });
        break;
    case ColourSource::rgb565: // two loops: the compiler vectorizes the second
        fill([&](const Streams &from, std::size_t point) {
            return std::uint32_t{from.colours[2 * point]} | std::uint32_t{from.colours[2 * point + 1]} << 8;
        });
        for (std::size_t i = 0; i < batch.count; ++i)
            to[i] = pack_rgb(expand_565(static_cast<std::uint16_t>(to[i])));
        break;
    case ColourSource::rgb888:
        fill([&](const Streams &from, std::size_t point) {
            return pack_rgb(point_colour(from.colours, point, ColourFormat::rgb888));
        });
        break;
    }
}

// Reads tables by the normal that is seen: colours, or what materials mirror. Expects that the points' own colours are
// read.
void PointReader::read_by_normal(const Batch &batch, const CoveredPixels &pixels, int y, const ShadedFrame &frame,
                                 PointRow &row) const {
    const FrameGeometry &geometry = frame.geometry;
    const float ray_y = (static_cast<float>(y) + 0.5F - geometry.middle_y) * geometry.inverse_focal;
    const auto read_all = [&](const auto &take) { // take(pixel of the row, material, normal)
        for (std::size_t i = 0; i < batch.count; ++i) {
            const std::size_t at = batch.first + i, of = material(*batch.from[i], batch.point[i]);
            const std::uint16_t stored = batch.normal(i);
            std::size_t normal = stored & kNormalIndexMask;
            if ((stored & kTwoSidedBit) != 0) {
                const EyeNormal &n = geometry.normals[normal];
                const float ray_x =
                    (static_cast<float>(pixels.x[at]) + 0.5F - geometry.middle_x) * geometry.inverse_focal;
                if (n.x * ray_x + n.y * ray_y + n.z > 0)
                    normal ^= kOppositeNormal;
            }
            take(at, of, normal);
        }
    };
    if (frame.shader.has_shaded_normals())
        read_all([&frame, colours = row.colour.data()](std::size_t at, std::size_t of, std::size_t normal) {
            colours[at] = frame.shader.shaded(of, normal);
        });
    else if (frame.shader.tints())
        read_all([&](std::size_t at, std::size_t of, std::size_t normal) {
            row.mirrored[at] = frame.shader.tinted(frame.shader.mirrored(normal), row.colour[at], of);
            row.mirrored[at][3] = frame.appearance.materials[of].environment;
        });
    else
        read_all([&](std::size_t at, std::size_t of, std::size_t normal) {
            row.mirrored[at] = frame.shader.mirrored(normal);
            row.mirrored[at][3] = frame.appearance.materials[of].environment;
        });
}

} // namespace pbm
