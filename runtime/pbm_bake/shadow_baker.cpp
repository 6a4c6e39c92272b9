#include "pbm_bake/shadow_baker.h"

#include "pbm_bake/lit_fractions.h"
#include "pbm_bake/shadow_map.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <cassert>
#include <mutex>

namespace pbm {
namespace {

// Texels of the strip that one thread draws at a time: they fit its cache.
constexpr std::size_t kStripTexels = 1 << 17;
constexpr int kMinStripRows = 32;
// Texels of the part of a map that is in memory while all rows of the ground plane look it up.
constexpr std::size_t kGroundMapTexels = 1 << 24;
// Rays per ground texel and map, spread over the texel and half of its neighbours.
constexpr int kGroundRays = 4;

class ProgressCount {
  public:
    ProgressCount(const ShadowOptions &options, std::size_t total) : options_(options), total_(total) {}
    void add() {
        if (!options_.progress)
            return;
        const std::lock_guard lock(mutex_);
        options_.progress(static_cast<double>(++done_) / static_cast<double>(total_));
    }

  private:
    const ShadowOptions &options_;
    std::size_t total_;
    std::mutex mutex_;
    std::size_t done_ = 0;
};

bool is_stopped(const ShadowOptions &options) { return options.stop != nullptr && *options.stop; }

int rows_of_strip(const ShadowView &view) {
    return std::max(kMinStripRows, static_cast<int>(kStripTexels / static_cast<std::size_t>(view.width())));
}

double size_in_view(const LightPlace &light, const ShadowCasters &casters, const ShadowOptions &options) {
    return light.parallel ? options.light_size : options.light_size / casters.voxel_size();
}

void check(const ShadowOptions &options) {
    assert(options.maps >= 1 && options.maps <= kMaxShadowMaps);
    assert(options.bits == 1 || options.bits == 2 || options.bits == 4 || options.bits == 8);
    assert(options.light_size >= 0);
    static_cast<void>(options);
}

// Votes with one map. A thread draws a strip and looks up all points in it before its next strip.
void vote_by_strips(const ShadowView &view, const ShadowOptions &options, std::span<std::uint8_t> votes) {
    const int rows = rows_of_strip(view);
    const std::size_t strips = static_cast<std::size_t>((view.height() + rows - 1) / rows);
    parallel_for(strips, options.threads, [&](std::size_t strip) {
        if (is_stopped(options))
            return;
        const int first = static_cast<int>(strip) * rows, here = std::min(rows, view.height() - first);
        std::vector<float> map(static_cast<std::size_t>(here) * static_cast<std::size_t>(view.width()));
        view.draw(first, here, map);
        view.vote(first, here, map, votes);
    });
}

// One light without size per ray and point.
std::vector<LightPlace> parts_of_light(const LightPlace &light, const ShadowCasters &casters, int count, double size) {
    if (size == 0)
        return {light};
    std::vector<LightPlace> parts;
    parts.reserve(static_cast<std::size_t>(count));
    for (int part = 0; part < count; ++part)
        parts.push_back(part_of_light(light, casters, part, size));
    return parts;
}

void vote_by_rays(const ShadowRays &rays, std::span<const LightPlace> parts, const ShadowOptions &options,
                  std::span<std::uint8_t> votes) {
    ProgressCount progress(options, rays.blocks());
    parallel_for(rays.blocks(), options.threads, [&](std::size_t block) {
        if (is_stopped(options))
            return;
        rays.vote(block, parts, votes);
        progress.add();
    });
}

void vote_by_maps(const LightPlace &light, const ShadowCasters &casters, const ShadowOptions &options, double size,
                  std::span<std::uint8_t> votes) {
    ProgressCount progress(options, static_cast<std::size_t>(options.maps));
    for (int map = 0; map < options.maps && !is_stopped(options); ++map) {
        for (const LightView &view : views_of_map(light, casters, map, size))
            vote_by_strips(ShadowView(view, casters), options, votes);
        if (!is_stopped(options))
            progress.add();
    }
}

// The ground plane in voxels of the casters' level.
struct GroundRaster {
    Vector3 corner, normal;
    Vector3 step_u, step_v; // of a texel
    std::uint32_t size;     // texels of an edge

    GroundRaster(const GroundPlane &ground, const ShadowCasters &casters, std::uint32_t texels) : size(texels) {
        const std::size_t up = casters.up() == UpAxis::y ? 1 : casters.up() == UpAxis::z ? 2 : 0;
        const std::size_t u = (up + 1) % 3, v = (up + 2) % 3;
        const double half = static_cast<double>(ground.half_edge) / casters.voxel_size(), texel = 2 * half / texels;
        corner = normal = step_u = step_v = {0, 0, 0};
        for (std::size_t axis = 0; axis < 3; ++axis)
            corner[axis] = static_cast<double>(ground.centre[axis]) / casters.voxel_size();
        corner[u] -= half;
        corner[v] -= half;
        normal[up] = 1;
        step_u[u] = step_v[v] = texel;
    }
    // Whether the light is on the plane's upper side. Otherwise it lights none of the plane.
    bool faces(const LightPlace &light) const {
        double height = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            height += normal[axis] * (light.parallel ? -light.direction[axis] : light.position[axis] - corner[axis]);
        return height > 0;
    }
    Vector3 at(double u, double v) const {
        return {corner[0] + u * step_u[0] + v * step_v[0], corner[1] + u * step_u[1] + v * step_v[1],
                corner[2] + u * step_u[2] + v * step_v[2]};
    }
};

// Counts the rays per ground texel that one view finds blocked. All rows of the ground look up each part of the view.
void look_from_ground(const ShadowView &view, const GroundRaster &ground, int map_number, const ShadowOptions &options,
                      std::span<std::uint16_t> blocked) {
    const int part_rows =
        std::max(kMinStripRows, static_cast<int>(kGroundMapTexels / static_cast<std::size_t>(view.width())));
    const auto width = static_cast<std::size_t>(view.width());
    std::vector<float> map(static_cast<std::size_t>(std::min(part_rows, view.height())) * width);
    for (int first = 0; first < view.height(); first += part_rows) {
        const int rows = std::min(part_rows, view.height() - first), strip = rows_of_strip(view);
        parallel_for(static_cast<std::size_t>((rows + strip - 1) / strip), options.threads, [&](std::size_t i) {
            const int top = static_cast<int>(i) * strip, here = std::min(strip, rows - top);
            if (!is_stopped(options))
                view.draw(first + top, here,
                          std::span(map).subspan(static_cast<std::size_t>(top) * width,
                                                 static_cast<std::size_t>(here) * width));
        });
        parallel_for(ground.size, options.threads, [&](std::size_t row) {
            const auto [begin, end] = view.visible_squares(
                {ground.at(0, static_cast<double>(row)), ground.step_u, ground.step_v, ground.size}, first, rows);
            for (std::uint32_t column = begin; column < end; ++column)
                for (int ray = 0; ray < kGroundRays; ++ray) {
                    const auto [du, dv] = ray_in_texel(map_number * kGroundRays + ray);
                    const auto seen = view.see(ground.at(column + du, static_cast<double>(row) + dv), ground.normal);
                    if (seen.inside && seen.row >= first && seen.row < first + rows &&
                        map[static_cast<std::size_t>(seen.row - first) * width +
                            static_cast<std::size_t>(seen.column)] < seen.depth)
                        ++blocked[row * ground.size + column];
                }
        });
    }
}

} // namespace

Bytes bake_light(const ShadowCasters &casters, const Light &light, const ShadowOptions &options) {
    check(options);
    const LightPlace place = place_light(light, casters);
    const double size = size_in_view(place, casters, options);
    Bytes votes(casters.size(), 0);
    int asked = options.maps;
    if (options.rays != nullptr && options.rays->complete()) {
        const std::vector<LightPlace> parts = parts_of_light(place, casters, options.maps, size);
        asked = static_cast<int>(parts.size());
        vote_by_rays(*options.rays, parts, options, votes);
    } else {
        vote_by_maps(place, casters, options, size, votes);
    }
    if (is_stopped(options))
        return {};
    votes_to_fractions(votes, asked, options.bits);
    fill_unlit(casters, place, options.threads, votes);
    return votes;
}

Image bake_ground(const ShadowCasters &casters, const Light &light, const GroundPlane &ground, std::uint32_t size,
                  const ShadowOptions &options) {
    check(options);
    const LightPlace place = place_light(light, casters);
    const double light_size = size_in_view(place, casters, options);
    const GroundRaster raster(ground, casters, size);
    Image image{.width = size, .height = size, .channels = 1, .texels = {}};
    if (!raster.faces(place)) {
        image.texels.assign(static_cast<std::size_t>(size) * size, 0);
        return image;
    }
    std::vector<std::uint16_t> blocked(static_cast<std::size_t>(size) * size, 0);
    ProgressCount progress(options, static_cast<std::size_t>(options.maps));
    for (int map = 0; map < options.maps; ++map) {
        for (const LightView &view : views_of_map(place, casters, map, light_size))
            look_from_ground(ShadowView(view, casters), raster, map, options, blocked);
        if (is_stopped(options))
            return {};
        progress.add();
    }
    const auto rays = static_cast<std::uint32_t>(options.maps * kGroundRays);
    image.texels.resize(blocked.size());
    for (std::size_t i = 0; i < blocked.size(); ++i)
        image.texels[i] = static_cast<std::uint8_t>(
            (2 * 255 * (rays - std::min<std::uint32_t>(blocked[i], rays)) + rays) / (2 * rays));
    return image;
}

} // namespace pbm
