// Rules that tie the levels of a model together, checked chunk by chunk of the finest level: the split into chunks
// (5.2) and the averages of the coarser levels (7.1, 17.3.1).
//
//   of any thread    measure_subtree: a chunk of the finest level, with the parts of the levels above that lie over it
//   in Morton order  TreeRules::add: what was measured, and the nodes above the chunks
#pragma once

#include "pbm_format/checking/content_rules.h"
#include "pbm_format/chunks/chunk.h"
#include "pbm_format/levels/averages.h"
#include "pbm_format/levels/chunk_split.h"

#include <optional>

namespace pbm {

// The chunks above and with a chunk of the finest level: their entries (null for level 0), streams and fields.
struct ChunkPath {
    struct Step {
        const ChunkEntry *entry = nullptr;
        ByteView masks{};
        PointView points{};
        std::span<const Bytes> fields{};

        std::uint64_t first_point() const { return entry == nullptr ? 0 : entry->first_point; }
    };
    std::array<Step, kMaxDepth + 1> steps{}; // [level]
};

// Properties of the file that the rules depend on.
struct TreeContext {
    int depth;
    std::uint32_t chunk_points;
    const AttributeSet &set;
    std::span<const Field> fields;
    bool averages;   // are checked
    bool root_wrong; // the points of level 0 are not compared
    // Offset of errors in averages of points and fields, by level.
    std::array<std::uint64_t, kMaxDepth> points_at{}, fields_at{};
};

// The first wrong averages of each level.
struct WrongAverages {
    std::array<std::optional<WrongAverage>, kMaxDepth> points{};
    std::array<std::array<std::optional<WrongAverage>, kMaxFields>, kMaxDepth> fields{};

    void merge(WrongAverages &&other);
};

// What is known of the subtree below the root of a chunk.
struct MeasuredSubtree {
    bool is_whole = false; // the chunk holds all nodes below its root, and no others
    NodeCounts counts{};
    PointSums sums{}; // the rest is there if averages are checked
    std::vector<FieldSums> fields{};
    std::unique_ptr<WrongAverages> wrong{}; // null: none is
    Bytes masks{};                          // of a chunk that is not whole
};
MeasuredSubtree measure_subtree(const TreeContext &context, const ChunkPath &path);

class TreeRules {
  public:
    explicit TreeRules(const TreeContext &context)
        : context_(context), split_(context.depth, context.chunk_points), above_{} {}

    // Adds the next chunk of the finest level.
    void add(const ChunkPath &path, MeasuredSubtree &&subtree);

    // After all chunks: the split that the octree gives, and wrong averages if the file has this split.
    std::vector<std::vector<ChunkShape>> split() { return split_.finish(); }
    WrongAverages &wrong() { return wrong_; }

  private:
    struct Sums {
        PointSums points{};
        std::vector<FieldSums> fields{};
    };

    void average(const ChunkPath &path, int level, std::uint64_t index, Sums &sums);

    TreeContext context_;
    ChunkSplit split_;
    bool all_whole_ = true;
    SubtreeMerge<Sums> above_;
    PointAttributes averaged_; // one point
    WrongAverages wrong_;
};

} // namespace pbm
