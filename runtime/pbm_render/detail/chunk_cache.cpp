#include "pbm_render/detail/chunk_cache.h"

#include <utility>

namespace pbm {

void ChunkCache::add_level(const LevelDirectory &directory) {
    levels_.push_back({.directory = &directory, .chunks = std::vector<ChunkSlot>(directory.chunks.size())});
}

bool ChunkCache::is_settled(ChunkPlace place) const {
    const ChunkSlot &of = slot(place);
    return of.chunk != nullptr || of.is_loading || of.refused;
}

std::optional<ChunkTask> ChunkCache::begin_loading(ChunkPlace place, const ChunkLoader &loader) {
    ChunkTask task{.place = place,
                   .entry = &entry_of(place),
                   .parent_entry = nullptr,
                   .parent = nullptr,
                   .memory = {},
                   .bytes = {},
                   .frame = nullptr};
    if (place.level > 1) {
        task.parent_entry = &entry_of(parent_of(place));
        task.parent = chunk(parent_of(place)); // the task's copy keeps make_room from evicting it
    }
    const std::uint64_t memory = loader.memory_of(place, *task.entry);
    if (!make_room(memory))
        return std::nullopt;
    task.memory = MemoryClaim(memory_, memory);
    if (place.level > 1)
        ++slot(parent_of(place)).children;
    slot(place).is_loading = true;
    return task;
}

void ChunkCache::finish_loading(const ChunkTask &task, ResidentPointer loaded) {
    ChunkSlot &to = slot(task.place);
    to.is_loading = false;
    to.last_view = view_;
    to.refused = loaded == nullptr;
    to.chunk = std::move(loaded);
    if (to.refused)
        remove_child(task.place);
}

void ChunkCache::remove_child(ChunkPlace place) {
    if (place.level > 1)
        --slot(parent_of(place)).children;
}

// Evicts chunks until `memory` more bytes fit: the longest unused first, and only chunks in which no other chunk nests.
// Returns false if that would evict chunks that the last view needs or that pictures still hold.
bool ChunkCache::make_room(std::uint64_t memory) {
    while (memory_ + memory > max_memory_) {
        ChunkPlace oldest{.level = 0};
        std::uint64_t last_view = view_;
        for (int level = 1; level <= known_levels(); ++level) {
            const std::vector<ChunkSlot> &slots = levels_[static_cast<std::size_t>(level)].chunks;
            for (std::uint32_t i = 0; i < slots.size(); ++i)
                if (slots[i].chunk.use_count() == 1 && slots[i].children == 0 && slots[i].last_view < last_view) {
                    oldest = {level, i};
                    last_view = slots[i].last_view;
                }
        }
        if (oldest.level == 0)
            return false;
        slot(oldest).chunk.reset();
        remove_child(oldest);
    }
    return true;
}

} // namespace pbm
