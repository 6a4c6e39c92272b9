#include "pbm_format/container/file_rules.h"

#include "pbm_format/law/catalogue.h"

namespace pbm {

Status verify_hash(ByteView stored, const SectionEntry &section) {
    const std::uint64_t hash = hash64(stored);
    if (hash == section.hash)
        return {};
    return broken("3.2.14", section.offset,
                  "the " + std::string(to_string(section.type)) + " section was changed: its hash does not match",
                  hash_value(section.hash), hash_value(hash));
}

Status check_point_count(const FileHeader &header, const SectionEntry &finest_chunks) {
    if (finest_chunks.count == header.point_count)
        return {};
    return broken("2.18", 56, "the header's point count is not that of the finest level", finest_chunks.count,
                  header.point_count);
}

Status check_chunk_count(const LevelDirectory &directory, const SectionEntry &entry,
                         std::span<const SectionEntry> sections) {
    if (entry.count == directory.chunks.size())
        return {};
    const auto number = static_cast<std::uint64_t>(&entry - sections.data());
    return broken("5.5.11", kHeaderBytes + number * kSectionEntryBytes + 48,
                  "the section table counts other chunks than there are", directory.chunks.size(), entry.count);
}

Status check_brick_count(const LevelDirectory &directory, const SectionEntry &bricks) {
    const std::uint64_t count =
        directory.chunks.empty() ? 0 : directory.chunks.back().first_brick + directory.chunks.back().shape.bricks;
    if (bricks.element_bytes == kBrickRecordBytes && bricks.count == count)
        return {};
    return broken("5.10.2", bricks.offset, "the bricks section does not hold the bricks that the directory counts",
                  std::to_string(count) + " of 24 bytes",
                  std::to_string(bricks.count) + " of " + std::to_string(bricks.element_bytes) + " bytes");
}

Error wrong_split(std::uint64_t offset, const ChunkShape *expected, const ChunkShape *actual) {
    const auto text = [](const ChunkShape *shape) {
        return shape == nullptr
                   ? Value("no chunk")
                   : Value("root " + std::to_string(shape->root_prefix) + " of level " +
                           std::to_string(shape->root_depth) + ", " + std::to_string(shape->points) + " points, " +
                           std::to_string(shape->nodes) + " nodes, " + std::to_string(shape->parents) + " parents, " +
                           std::to_string(shape->bricks) + " bricks");
    };
    return broken("5.2", offset, "the chunk is not a maximal subtree within the limit", text(expected), text(actual));
}

} // namespace pbm
