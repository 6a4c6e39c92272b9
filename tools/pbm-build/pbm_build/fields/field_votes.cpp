#include "pbm_build/fields/field_votes.h"

#include <algorithm>

namespace pbm::build {

void FieldVotes::begin(std::size_t voxels) {
    sums_.assign(voxels, {});
    labels_.clear();
}

void FieldVotes::add(std::size_t voxel, std::int32_t value) {
    if (value == FieldSamples::kNone)
        return;
    Sums &sums = sums_[voxel];
    switch (average_) {
    case FieldAverage::mean: sums.sum += value; break;
    case FieldAverage::maximum: sums.sum = sums.count == 0 ? value : std::max<std::int64_t>(sums.sum, value); break;
    case FieldAverage::majority:
        labels_.push_back(static_cast<std::uint64_t>(voxel) << 32 | static_cast<std::uint32_t>(value));
        break;
    }
    ++sums.count;
}

void FieldVotes::append(std::uint8_t bytes, Bytes &column) {
    if (average_ == FieldAverage::majority) {
        std::sort(labels_.begin(), labels_.end());
        std::vector<std::size_t> votes(sums_.size());
        for (auto begin = labels_.begin(); begin != labels_.end();) {
            const auto end = std::upper_bound(begin, labels_.end(), *begin);
            const auto voxel = static_cast<std::size_t>(*begin >> 32), count = static_cast<std::size_t>(end - begin);
            if (count > votes[voxel]) { // ties go to the lowest label, which comes first
                votes[voxel] = count;
                sums_[voxel] = {.sum = static_cast<std::int64_t>(*begin & 0xFFFFFFFF), .count = 1};
            }
            begin = end;
        }
    }
    const std::size_t first = column.size() / bytes;
    column.resize(column.size() + sums_.size() * bytes);
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        const auto &[sum, count] = sums_[i];
        if (count == 0)
            continue;
        const std::int64_t steps = average_ == FieldAverage::mean ? std::int64_t{count} << FieldSamples::kFraction
                                                                  : std::int64_t{1} << FieldSamples::kFraction;
        set_stored_value(column, first + i, bytes, static_cast<std::uint32_t>(1 + (2 * sum + steps) / (2 * steps)));
    }
}

} // namespace pbm::build
