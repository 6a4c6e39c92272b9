// The resident chunks of a model, the last view that needed each, and the choice of the chunk to evict when memory runs
// out. Only one thread at a time may use a cache, except for memory().
#pragma once

#include "pbm_render/detail/chunk_loader.h"
#include "pbm_render/detail/detail_selection.h"

#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

namespace pbm {

class ChunkCache {
  public:
    explicit ChunkCache(std::uint64_t max_memory) : max_memory_(addressable(max_memory)) {}

    // Adds the next finer level.
    void add_level(const LevelDirectory &directory);
    int known_levels() const { return static_cast<int>(levels_.size()) - 1; }
    const std::vector<LevelState> &levels() const { return levels_; } // as select_detail takes them

    // A chunk named by `use` is not evicted until the next begin_view.
    void begin_view() { ++view_; }
    void use(ChunkPlace place) { slot(place).last_view = view_; }

    const ResidentPointer &chunk(ChunkPlace place) const { return slot(place).chunk; }
    bool has_parent(ChunkPlace place) const { return place.level == 1 || chunk(parent_of(place)) != nullptr; }
    // Whether a chunk is resident, being loaded or refused.
    bool is_settled(ChunkPlace place) const;

    // Starts to load a chunk that is not settled and whose parent is resident. Empty if there is no room for it, see
    // make_room. May throw std::bad_alloc and then changes nothing.
    std::optional<ChunkTask> begin_loading(ChunkPlace place, const ChunkLoader &loader);
    // Ends loading: `loaded` becomes resident; null refuses the chunk from now on.
    void finish_loading(const ChunkTask &task, ResidentPointer loaded);

    std::uint64_t max_memory() const { return max_memory_; }
    // Bytes of all chunks that are resident, being loaded, or held by whoever draws them.
    std::uint64_t memory() const { return memory_; }

  private:
    ChunkSlot &slot(ChunkPlace place) { return levels_[static_cast<std::size_t>(place.level)].chunks[place.index]; }
    const ChunkSlot &slot(ChunkPlace place) const {
        return levels_[static_cast<std::size_t>(place.level)].chunks[place.index];
    }
    const ChunkEntry &entry_of(ChunkPlace place) const {
        return levels_[static_cast<std::size_t>(place.level)].directory->chunks[place.index];
    }
    ChunkPlace parent_of(ChunkPlace place) const { return {place.level - 1, entry_of(place).shape.parent_chunk}; }
    void remove_child(ChunkPlace place);
    bool make_room(std::uint64_t memory);

    const std::uint64_t max_memory_;
    std::atomic<std::uint64_t> memory_{0}; // before the chunks, whose destructors change it
    std::vector<LevelState> levels_ = std::vector<LevelState>(1);
    std::uint64_t view_ = 0; // number of the last view
};

} // namespace pbm
