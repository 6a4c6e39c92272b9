// A chunk in memory: all data for drawing it and for loading the chunks below it.
#pragma once

#include "pbm_format/chunks/mapped_chunk.h"
#include "pbm_render/bricks/chunk_offsets.h"
#include "pbm_render/bricks/round_points.h"
#include "pbm_render/detail/chunk_sides.h"

#include <glm/vec3.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace pbm {

// Part of the grid, in units of its edge.
struct Box {
    glm::dvec3 least{0}, most{1}; // corners

    glm::dvec3 centre() const { return (least + most) / 2.0; }
    glm::dvec3 half() const { return (most - least) / 2.0; }
};

// Bounds of one or more bricks.
Box bounds_of(std::span<const BrickRecord> bricks, int level);

// Counts bytes towards a total as long as it lives.
class MemoryClaim {
  public:
    MemoryClaim() = default;
    MemoryClaim(std::atomic<std::uint64_t> &total, std::uint64_t bytes) : total_(&total), bytes_(bytes) {
        total += bytes;
    }
    MemoryClaim(MemoryClaim &&other) noexcept : total_(std::exchange(other.total_, nullptr)), bytes_(other.bytes_) {}
    MemoryClaim &operator=(MemoryClaim &&other) noexcept {
        std::swap(total_, other.total_);
        std::swap(bytes_, other.bytes_);
        return *this;
    }
    ~MemoryClaim() {
        if (total_ != nullptr)
            *total_ -= bytes_;
    }

  private:
    std::atomic<std::uint64_t> *total_ = nullptr;
    std::uint64_t bytes_ = 0;
};

// The most fields that a picture reads: that of its colours, and that of the classes which it leaves out.
inline constexpr std::size_t kReadFields = 2;

struct ResidentChunk {
    ChunkView view;                        // spans of `decoded` and `bricks`, or of a mapped file
    ChunkOffsets offsets;                  // of its points
    Box bounds;                            // of the bricks
    std::uint8_t largest_radius = 0;       // index, of all points
    Chunk decoded;                         // of a packed file; its lit fractions are packed
    std::vector<BrickRecord> bricks;       // of a packed file, or of a chunk with sides
    std::array<Bytes, kReadFields> fields; // stored values
    Bytes field_colours;                   // what the view has as texture values, or as colours
    std::unique_ptr<ChunkSides> sides;     // null: no point has some
    MarkedPoints marked;                   // drawn normals and radii; of chunks with round or hidden points
    bool hides_points = false;
    MemoryClaim memory;
};
using ResidentPointer = std::shared_ptr<const ResidentChunk>;

} // namespace pbm
