// Both sides of the points of a level that stand for a thin wall, in the caller's arrays.
#include "model.h"
#include "point_writer.h"

#include "pbm_format/reading/point_stream_reader.h"

#include <algorithm>
#include <array>
#include <utility>

namespace pbm::c_api {
namespace {

// Fetches what the sides of a level need.
Status fetch_sides(OpenModel &model, std::int32_t level) {
    if (Status checked = check_level(model, level); !checked || level == 0)
        return checked;
    if (const auto directory = model.directory(level); !directory)
        return directory.error();
    const PointStreamReader sides(model.reader, PointStream::sides);
    if (!sides.has(level))
        return {};
    return model.bytes.require(std::array{sides.directory_range(level), sides.values_range(level)});
}

Result<std::uint64_t> count_points_with_sides(OpenModel &model, std::int32_t level) {
    if (Status fetched = fetch_sides(model, level); !fetched)
        return std::move(fetched).error();
    return count_sides(model.reader, level);
}

Status read_sides(OpenModel &model, std::int32_t level, const pbm_sides *sides, std::uint64_t *written) {
    const Result<pbm_sides> to = read_structure(sides, "sides");
    if (!to)
        return to.error();
    if (Status fetched = fetch_sides(model, level); !fetched)
        return fetched;
    const Result<Sides> all = load_sides(model.reader, level);
    if (!all)
        return all.error();
    if (to->capacity < all->size())
        return no_room(to->capacity, all->size());
    pbm_points rows{};
    rows.normals = to->normals;
    rows.colours = to->colours;
    rows.materials = to->materials;
    PointWriter(model.reader.parameters(), level, rows).write_attributes({all->values, 0});
    if (to->points != nullptr)
        std::copy(all->points.begin(), all->points.end(), to->points);
    if (written != nullptr)
        *written = all->size();
    return {};
}

} // namespace
} // namespace pbm::c_api

using namespace pbm;
using namespace pbm::c_api;

pbm_code pbm_count_sides(pbm_model *model, int32_t level, uint64_t *points, pbm_error *error) {
    return count_level(model, level, points, error, count_points_with_sides);
}

pbm_code pbm_read_sides(pbm_model *model, int32_t level, const pbm_sides *sides, uint64_t *written, pbm_error *error) {
    return guarded(error, [&] {
        return models().use(model, "model", [&](OpenModel &open) { return read_sides(open, level, sides, written); });
    });
}
