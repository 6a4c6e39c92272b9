// Which chunks leave the memory, and which never do.
#include "pbm_render/detail/chunk_cache.h"

#include "pbm_format/writing/writer.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <gtest/gtest.h>

#include <vector>

namespace pbm {
namespace {

// A model whose finest level has several chunks in one parent: a chain of parents, one at each level, and their
// children.
class ChunkCaching : public testing::Test {
  protected:
    ChunkCaching()
        : file_(value_of(encode_model(test::sphere_model(6, test::every_attribute(ColourFormat::rgb565, 6)),
                                      {.chunk_points = 512, .threads = 1}))),
          reader_(value_of(Reader::open(file_))) {
        for (int level = 1; level <= 6; ++level)
            directories_.push_back(value_of(reader_.directory(level)));
        const LevelDirectory &finest = *directories_.back();
        for (std::uint32_t i = 0; i < finest.chunks.size() && children.size() < 3; ++i) {
            if (!children.empty() && parent_of({6, i}) != parent_of({6, children.front()}))
                children.clear();
            children.push_back(i);
        }
        std::sort(children.begin(), children.end(), [this](std::uint32_t a, std::uint32_t b) {
            return memory_of({6, a}) > memory_of({6, b});
        });
        for (ChunkPlace place{6, children.front()}; place.level > 1; place = parent_of(place))
            parents.insert(parents.begin(), parent_of(place));
    }

    ChunkPlace parent_of(ChunkPlace place) const { return {place.level - 1, entry_of(place).shape.parent_chunk}; }
    const ChunkEntry &entry_of(ChunkPlace place) const {
        return directories_[static_cast<std::size_t>(place.level) - 1]->chunks[place.index];
    }
    std::uint32_t chunks_of(int level) const {
        return static_cast<std::uint32_t>(directories_[static_cast<std::size_t>(level) - 1]->chunks.size());
    }
    std::uint64_t memory_of(ChunkPlace place) const { return loader().memory_of(place, entry_of(place)); }
    std::uint64_t memory_of_parents() const {
        std::uint64_t memory = 0;
        for (const ChunkPlace place : parents)
            memory += memory_of(place);
        return memory;
    }
    ChunkPlace child(std::size_t number) const { return {6, children[number]}; }

    void add_levels(ChunkCache &cache) const {
        for (const LevelDirectory *directory : directories_)
            cache.add_level(*directory);
    }
    // False if there is no room.
    bool load(ChunkCache &cache, ChunkPlace place) const {
        std::optional<ChunkTask> task = cache.begin_loading(place, loader());
        if (!task)
            return false;
        task->bytes = loader().bytes_of(place).value();
        cache.finish_loading(*task, value_of(loader().load(*task)));
        return true;
    }
    void load_parents(ChunkCache &cache) const {
        for (const ChunkPlace place : parents)
            ASSERT_TRUE(load(cache, place));
    }
    bool has_parents(const ChunkCache &cache) const {
        return std::all_of(parents.begin(), parents.end(),
                           [&](ChunkPlace place) { return cache.chunk(place) != nullptr; });
    }
    const ChunkLoader &loader() const { return loader_; }

    std::vector<ChunkPlace> parents;     // one at each level but the finest
    std::vector<std::uint32_t> children; // three at the finest level, of one parent

  private:
    Bytes file_;
    Reader reader_;
    std::vector<const LevelDirectory *> directories_;
    ChunkLoader loader_{reader_};
};

// The parents are the longest unused, but chunks nest in them: nothing may be evicted for a second child.
TEST_F(ChunkCaching, AChunkWithResidentChildrenIsNeverEvicted) {
    ASSERT_EQ(children.size(), 3U);
    ChunkCache cache(memory_of_parents() + memory_of(child(0)));
    add_levels(cache);
    load_parents(cache);
    ASSERT_TRUE(load(cache, child(0)));
    for (int view = 0; view < 3; ++view) {
        cache.begin_view();
        cache.use(child(0));
    }
    EXPECT_FALSE(load(cache, child(1)));
    EXPECT_TRUE(has_parents(cache));
    EXPECT_NE(cache.chunk(child(0)), nullptr);
    cache.begin_view(); // now nobody needs the child
    EXPECT_TRUE(load(cache, child(1)));
    EXPECT_TRUE(has_parents(cache));
    EXPECT_EQ(cache.chunk(child(0)), nullptr);
    EXPECT_NE(cache.chunk(child(1)), nullptr);
}

TEST_F(ChunkCaching, AParentOfALoadingChunkIsNeverEvicted) {
    ChunkCache cache(memory_of_parents() + memory_of(child(0)));
    add_levels(cache);
    load_parents(cache);
    cache.begin_view();
    const std::optional<ChunkTask> task = cache.begin_loading(child(0), loader());
    ASSERT_TRUE(task);
    cache.begin_view();
    EXPECT_FALSE(cache.begin_loading(child(1), loader()));
    EXPECT_TRUE(has_parents(cache));
}

TEST_F(ChunkCaching, TheLongestUnusedChildIsEvictedFirst) {
    ChunkCache cache(memory_of_parents() + memory_of(child(0)) + memory_of(child(1)));
    add_levels(cache);
    load_parents(cache);
    ASSERT_TRUE(load(cache, child(0)));
    ASSERT_TRUE(load(cache, child(1))) << "what fits exactly fits";
    EXPECT_EQ(cache.memory(), cache.max_memory());
    cache.begin_view();
    cache.use(child(1));
    cache.begin_view();
    cache.use(child(0));
    cache.begin_view();
    EXPECT_TRUE(load(cache, child(2)));
    EXPECT_NE(cache.chunk(child(0)), nullptr);
    EXPECT_EQ(cache.chunk(child(1)), nullptr);
}

TEST_F(ChunkCaching, WhatAPictureHoldsIsNotEvicted) {
    ChunkCache cache(memory_of_parents() + memory_of(child(0)));
    add_levels(cache);
    load_parents(cache);
    ASSERT_TRUE(load(cache, child(0)));
    ResidentPointer held = cache.chunk(child(0));
    cache.begin_view();
    EXPECT_FALSE(load(cache, child(1)));
    held = nullptr;
    EXPECT_TRUE(load(cache, child(1)));
}

// A refused chunk is no child any more: its parent may go when others need the memory.
TEST_F(ChunkCaching, TheParentOfARefusedChunkMayGo) {
    const ChunkPlace refused = parents.back(), parent = parent_of(refused);
    parents.pop_back();
    ChunkCache cache(memory_of_parents() + memory_of(refused));
    add_levels(cache);
    load_parents(cache);
    std::optional<ChunkTask> task = cache.begin_loading(refused, loader());
    ASSERT_TRUE(task);
    EXPECT_TRUE(cache.is_settled(refused));
    cache.finish_loading(*task, nullptr);
    EXPECT_TRUE(cache.is_settled(refused));
    EXPECT_EQ(cache.chunk(refused), nullptr);
    task.reset();
    EXPECT_EQ(cache.memory(), memory_of_parents());
    cache.begin_view();
    for (std::uint32_t i = 0; i < chunks_of(parent.level); ++i)
        if (const ChunkPlace other{parent.level, i}; other != parent && cache.chunk(parent) != nullptr) {
            ASSERT_TRUE(load(cache, other));
        }
    EXPECT_EQ(cache.chunk(parent), nullptr);
}

} // namespace
} // namespace pbm
