// The rank filter of child masks: replaces a mask by its rank among the masks seen in similar contexts. Frequent codes
// then are small numbers everywhere, so that one Huffman table fits all. BVG.md 5.9
// Based on: Fenwick. Symbol Ranking Text Compression with Shannon Recodings. 1997. Here the ranking is fixed and
// trained; the context is the surface's normal and the parent's mask, reduced by the 48 symmetries of the cube.
//
//   normal of the node    -> symmetry (mirror and turn the cube until x >= y >= z >= 0) and normal class 0..20
//   place in the parent   -> its image                                       } context: class, place, mask
//   mask of the parent    -> its image, seen from the place: bit 0 is set    }
//   context               -> ranking 0..127, by table      (format_spec/mask_ranks.txt, made by bench/train_mask_ranks)
//   image of the mask     -> code: its rank in that ranking
#pragma once

#include "system/bytes.h"

#include <cstdint>
#include <span>

namespace pbm {

inline constexpr std::size_t kMaskNormalClasses = 21;
inline constexpr std::size_t kMaskContexts = kMaskNormalClasses * 1024; // [normal class][place][parent's mask >> 1]
inline constexpr std::size_t kMaskRankings = 128;

// Context of the masks of one chunk, known before the masks are decoded.
struct MaskContext {
    // Masks of the nodes of level L - 2, the parents of the coded nodes. Empty for L = 1: parent mask 1, place 0.
    ByteView parent_masks;
    // Stored normals (6.1) of the nodes of level L - 1, one per mask; bits 13..15 are ignored.
    std::span<const std::uint16_t> node_normals;
};

// Writes the codes of `masks`, one byte each; `codes` may be the same memory. Mask 0 always has code 255.
void rank_masks(ByteView masks, const MaskContext &context, std::span<std::uint8_t> codes);

// Writes the masks of `codes`, which may be the same memory. Codes and parent masks are untrusted: any bytes give
// masks. If `parent_masks` have too few children, further nodes have place 0 and parent mask 1; excess parents are
// ignored.
void unrank_masks(std::span<const std::uint8_t> codes, const MaskContext &context, std::span<std::uint8_t> masks);

// The context and the symmetry of a mask.
struct PlacedMask {
    std::uint16_t context = 0; // 0..kMaskContexts - 1
    std::uint8_t symmetry = 0; // 0..47: maps the mask to its image
};
// One entry per mask.
void place_masks(const MaskContext &context, std::span<PlacedMask> placed);
std::uint8_t mask_image(std::uint8_t mask, std::uint8_t symmetry);

// The normative table: [kMaskContexts] rankings, then [kMaskRankings][256] masks in the order of their codes.
ByteView mask_rank_table();

} // namespace pbm
