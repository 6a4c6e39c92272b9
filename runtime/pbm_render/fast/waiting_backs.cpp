#include "pbm_render/fast/waiting_backs.h"

#include <algorithm>

namespace pbm {

WaitingBacks::Group &WaitingBacks::group_of(const RunGeometry &run, int block) {
    const auto is_alike = [&](const Group *group) {
        const PointRun &of = *group->run->run;
        return group->block == block && of.level == run.run->level &&
               (of.offsets == nullptr) == (run.run->offsets == nullptr);
    };
    const auto open = std::find_if(open_.begin(), open_.end(), is_alike);
    if (open == open_.end())
        return *open_.emplace_back(&add(run, block));
    if ((*open)->points.count >= kWaiting)
        *open = &add(run, block);
    return **open;
}

WaitingBacks::Group &WaitingBacks::add(const RunGeometry &run, int block) {
    if (used_ == groups_.size())
        groups_.push_back(std::make_unique_for_overwrite<Group>());
    Group &group = *groups_[used_++];
    group.run = &run;
    group.block = block;
    group.points.count = 0;
    group.points.are_backs = true;
    group.points.near.clear();
    return group;
}

} // namespace pbm
