#include "pbm_build/parts/part.h"

#include "system/free_memory.h"

#include <iterator>
#include <utility>

namespace pbm::build {

Part join(std::vector<Part> parts) {
    std::size_t points = 0;
    for (const Part &part : parts)
        points += part.voxels.codes.size();
    Part whole = std::move(parts.front());
    const AttributeSet &set = whole.parameters.attributes;
    const auto append = [](auto &to, auto &from) {
        to.insert(to.end(), from.begin(), from.end());
        free_memory(from);
    };
    Voxels &all = whole.voxels;
    all.codes.reserve(points);
    for_columns(
        set, [&](const StreamInfo &, std::size_t width, auto &column) { column.reserve(points * width); }, all.points);
    for (std::size_t i = 1; i < parts.size(); ++i) {
        Voxels &voxels = parts[i].voxels;
        append(all.codes, voxels.codes);
        append(all.offsets, voxels.offsets);
        for_columns(
            set, [&](const StreamInfo &, std::size_t, auto &to, auto &from) { append(to, from); }, all.points,
            voxels.points);
        for (std::size_t f = 0; f < all.fields.size(); ++f)
            append(all.fields[f], voxels.fields[f]);
        append_sides(voxels.sides, set, all.sides);
        append(all.made, voxels.made);
        whole.statistics.samples += parts[i].statistics.samples;
    }
    return whole;
}

} // namespace pbm::build
