// Byte layout of a .pbvg file: header, section table and the small records. BVG.md 2, 3 and 5.
//
//   0      header, 128 bytes
//   128    section table, 64 bytes per entry, sorted by offset
//          metadata, grid, attributes, materials, lights, texture, ground  (small, raw)
//          directory of level 1, bricks of level 1, chunks of level 1      (coarse)
//          ...
//          directory, bricks, chunks of level depth                        (fine)
//          rasters: ground texture, lit fractions of the ground, panorama
//          directories of fields, level by level, then their values
//          directories of point streams, then their values
//
// Only mapped files have bricks.
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"
#include "system/bytes.h"
#include "system/error.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace pbm {

inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'B', 'V', 'G', 0x0D, 0x0A, 0x1A, 0x0A};
inline constexpr std::uint16_t kMajorVersion = 1;
inline constexpr std::uint16_t kMinorVersion = 6; // the highest that this version writes
inline constexpr std::uint32_t kEndianTag = 0x01020304;
inline constexpr std::size_t kHeaderBytes = 128;
inline constexpr std::size_t kSectionEntryBytes = 64;
inline constexpr std::size_t kMaxSections = 256;
inline constexpr std::size_t kShapeBytes = 8; // of a record of shapes
inline constexpr std::size_t kMaxMetadataBytes = 4096;
inline constexpr std::size_t kSectionAlignment = 8;
inline constexpr std::uint64_t kMaxPoints = 0xFFFFFFFF;
inline constexpr std::uint64_t kMaxExpansion = 32768; // raw bytes per stored byte of a stream
inline constexpr std::uint32_t kDefaultChunkPoints = 65536;
inline constexpr std::uint32_t kMinChunkPoints = 512;

// The two storage profiles of a model: compressed, or raw and aligned to be drawn in place. BVG.md 5.10
enum class Storage : std::uint8_t { packed, mapped };
std::string_view to_string(Storage storage);
inline constexpr std::uint64_t kMappedFeature = 1;            // required feature bit of mapped files
inline constexpr std::uint64_t kFieldsFeature = 1;            // optional feature bit of files with fields
inline constexpr std::uint64_t kClosedFeature = 2;            // optional feature bit of closed surfaces
inline constexpr std::uint32_t kMappedChunksAlignment = 4096; // of their sections of chunks: a page
inline constexpr std::uint32_t kMappedStreamAlignment = 64;   // of their streams and sections of bricks: a cache line

using ContentId = std::array<std::uint64_t, 2>; // XXH3-128, low half first: content_id.h

struct FileHeader {
    std::uint16_t major = kMajorVersion;
    std::uint16_t minor = 0;
    std::uint32_t endian = kEndianTag;
    std::uint64_t file_size = 0;
    std::uint64_t table_offset = kHeaderBytes;
    std::uint32_t table_count = 0;
    std::uint8_t depth = 0;
    std::uint64_t required_features = 0;
    std::uint64_t optional_features = 0;
    std::uint64_t point_count = 0;
    std::uint64_t raw_bytes = 0; // sum over all sections
    ContentId content_id{};
    RootRecord root;
    std::uint32_t chunk_points = kDefaultChunkPoints;
    std::uint64_t table_hash = 0;

    Storage storage() const { return (required_features & kMappedFeature) != 0 ? Storage::mapped : Storage::packed; }
    bool closed() const { return (optional_features & kClosedFeature) != 0; }
};

// Verifies rules 2.1 to 2.12: length, magic, hash, version, features, limits. `start` holds the first 128 bytes of the
// file, or the whole file if it is shorter.
Result<FileHeader> decode_header(ByteView start, std::uint64_t file_size);
inline Result<FileHeader> decode_header(ByteView file) { return decode_header(file, file.size()); }

enum class SectionType : std::uint32_t {
    metadata = 1,
    grid = 2,
    attributes = 3,
    materials = 4,
    lights = 5,
    texture = 6,
    ground_plane = 7,
    fields = 8,
    shapes = 10,
    level_directory = 16,  // instance = level
    level_chunks = 17,     // instance = level
    level_bricks = 18,     // instance = level; mapped files only
    ground_texture = 24,   // raster
    ground_lit = 25,       // raster; instance = light
    panorama = 32,         // raster
    field_directory = 40,  // instance = level
    field_values = 41,     // instance = level
    stream_directory = 42, // instance = instance_of(kind, level)
    stream_values = 43,    // instance = instance_of(kind, level)
};

// What its type says of a section. BVG.md 3.2, 17.1, 18.1 and 19.1
struct SectionTraits {
    SectionType type{};
    std::string_view name = "unknown";
    bool is_of_level = false;           // its instance is a level
    bool is_point_stream = false;       // its instance is a kind and a level: point_streams.h
    bool is_coded = false;              // made of parts of any size: codec 1 in packed files, no element size
    bool is_raster = false;             // image_section.h lays it out
    bool is_optional = false;           // a reader that does not know it ignores it
    std::uint32_t mapped_alignment = 0; // that it must have in mapped files; 0: any
};
// Null: a type that this version does not know.
const SectionTraits *traits_of(SectionType type);
std::string_view to_string(SectionType type);
inline bool is_known(SectionType type) { return traits_of(type) != nullptr; }
inline bool is_raster(SectionType type) { return is_known(type) && traits_of(type)->is_raster; }

// What an optional stream of points says. BVG.md 19.1; a reader ignores kinds that it does not know.
enum class PointStream : std::uint32_t { sides = 1, offsets = 3 };
inline constexpr std::array kPointStreams{PointStream::sides, PointStream::offsets};
inline constexpr std::uint32_t kStreamKinds = 256;
inline bool is_known_stream(std::uint32_t instance) {
    return std::find(kPointStreams.begin(), kPointStreams.end(), PointStream{instance / kStreamKinds}) !=
           kPointStreams.end();
}
// The instance of the sections of a point stream for a level.
constexpr std::uint32_t instance_of(PointStream kind, int level) {
    return kStreamKinds * static_cast<std::uint32_t>(kind) + static_cast<std::uint32_t>(level);
}

enum class Codec : std::uint16_t { raw = 0, zstd_chunks = 1 }; // chunks, or tiles of rasters

inline constexpr std::uint16_t kCriticalFlag = 1; // a reader that does not know the section must refuse the file

struct SectionEntry {
    SectionType type{};
    Codec codec{};
    std::uint16_t flags = 0;
    std::uint32_t instance = 0;
    std::uint32_t element_bytes = 1; // of the raw form; 0 if elements differ in size
    std::uint32_t alignment = kSectionAlignment;
    std::uint64_t offset = 0;
    std::uint64_t stored_bytes = 0;
    std::uint64_t raw_bytes = 0;
    std::uint64_t count = 0; // elements: records, chunks (directory), points (chunks), tiles (rasters)
    std::uint64_t hash = 0;  // XXH3-64 of the stored bytes

    FileRange range() const { return {offset, stored_bytes}; }
    // Sort key: small sections by type, then directory, bricks and chunks level by level, then rasters, then fields,
    // then point streams.
    std::array<std::uint32_t, 3> order() const;
};

// Verifies rules 3.1 and 3.2, except padding, of the table of `header`: hash, order, offsets, sizes, known codecs, and
// necessary sections, each exactly once. `start` holds the file up to the end of the table or of the file.
Result<std::vector<SectionEntry>> decode_section_table(ByteView start, const FileHeader &header);

// The section of this type and instance, or null.
const SectionEntry *find_section(std::span<const SectionEntry> sections, SectionType type, std::uint32_t instance = 0);

// Decode the small sections. `offset` of an error counts from the section's start.
Result<Grid> decode_grid(ByteView bytes, int depth);
Result<AttributeSet> decode_attributes(ByteView bytes, int depth);
Result<std::vector<Material>> decode_materials(ByteView bytes);
// The same materials with shapes and tints of a section of shapes. BVG.md 18.2
Result<std::vector<Material>> decode_shapes(ByteView bytes, std::vector<Material> materials);
Result<std::vector<Light>> decode_lights(ByteView bytes);
Result<SolidTexture> decode_texture(ByteView bytes);
Result<GroundPlane> decode_ground_plane(ByteView bytes);
// Checks for a UTF-8 JSON object of at most kMaxMetadataBytes.
Status check_metadata(ByteView bytes);
// A member of metadata that obeys these rules, including members of nested objects, in the order of the text.
struct MetadataMember {
    std::string key;
    std::string text; // value if it is a string; else empty
    bool again;       // the same object has this key already
};
std::vector<MetadataMember> list_metadata(ByteView bytes);
// Rules 3.9, between parameters: shadow streams <= lights, material indices need more than one material, ...
Status check_parameters(const ModelParameters &parameters);
// Rules 3.9.5 and 3.9.6: the ground plane has the rasters that the parameters require. `lit` of them hold lit
// fractions, of lights 0, 1, ...
Status check_rasters(const ModelParameters &parameters, bool ground_texture, std::size_t lit);
// Both, for the rasters of a file. Error offsets are that of the attributes section in the file.
Status check_parameters(const ModelParameters &parameters, std::span<const SectionEntry> sections);
// Rules 2.13 to 2.17: the root record names existing attributes only.
Status check_root(const RootRecord &root, const ModelParameters &parameters);

// How one stream of a chunk is stored. 4 bytes: size (24 bits), filter (7 bits), zstd flag (1 bit).
struct StreamEntry {
    std::uint32_t stored_bytes = 0;
    Filter filter = Filter::none;
    bool zstd = false; // one zstd frame, else raw bytes; filters have this flag per plane
    bool operator==(const StreamEntry &) const = default;
};

StreamEntry unpack_stream_entry(std::uint32_t packed);
std::uint32_t pack_stream_entry(const StreamEntry &entry);

// Entry per plane, in front of the planes of a filtered stream: size (24 bits), zero (7 bits), zstd flag (1 bit).
inline constexpr std::size_t kPlaneEntryBytes = 4;

// Cosine of a chunk without normal cone: a point is two-sided, or the normals point everywhere.
inline constexpr std::int16_t kNoCone = -32767;

// All integer normals n of the chunk's points satisfy n . axis >= 32,767 x cosine, unless it is kNoCone (BVG.md 5.7).
struct NormalCone {
    std::uint16_t axis = 0; // normal index; 0 if there is no cone
    std::int16_t cosine = kNoCone;
    bool operator==(const NormalCone &) const = default;
};

// Start of the next stream of a mapped chunk, or end of the chunk. BVG.md 5.10.1
constexpr std::uint64_t align_stream(std::uint64_t end) {
    return (end + kMappedStreamAlignment - 1) / kMappedStreamAlignment * kMappedStreamAlignment;
}

// One entry of a level's directory: fixed part, then one StreamEntry per stream of the AttributeSet.
struct ChunkEntry {
    ChunkShape shape;
    NormalCone cone;
    std::uint64_t hash = 0;           // XXH3-64 of the chunk's stored bytes
    std::vector<StreamEntry> streams; // in the order of streams_of()
    // Computed by decode_directory in one pass:
    std::uint64_t offset = 0; // of the stored bytes, in the file
    std::uint64_t stored_bytes = 0;
    std::uint64_t first_point = 0;  // index of the chunk's first point in its level
    std::uint64_t first_node = 0;   // index of its first mask in its level
    std::uint64_t first_parent = 0; // index of the first mask of the level above that belongs to a parent of its nodes
    std::uint64_t first_brick = 0;  // index of its first brick in its level
};

inline constexpr std::size_t kChunkEntryFixedBytes = 48, kBrickRecordBytes = 24;
std::size_t chunk_entry_bytes(const AttributeSet &set);

inline constexpr std::uint8_t kTwoSidedBrick = 1; // flag: a point of the brick is two-sided

// A brick of a chunk: 8x8x8 nodes of its level (brick_index.h). As stored in the file, 24 bytes.
struct BrickRecord {
    std::uint16_t x = 0, y = 0, z = 0; // of the brick in level L - 3
    std::uint16_t first_point = 0;     // within the chunk
    std::uint16_t first_node = 0;      // within the chunk: first of the brick's masks
    std::uint16_t cone_axis = 0;       // normal cone of its points: 5.11.3
    std::int16_t cone_cosine = kNoCone;
    std::uint8_t largest_radius = 0; // index
    std::uint8_t flags = 0;
    std::uint64_t node_map = 0;
    bool operator==(const BrickRecord &) const = default;
};
static_assert(sizeof(BrickRecord) == kBrickRecordBytes && offsetof(BrickRecord, node_map) == 16);

struct LevelDirectory {
    int level = 0;
    std::vector<ChunkEntry> chunks; // ascending; they tile the level
    std::uint64_t points = 0;       // of the level
    std::uint64_t nodes = 0;        // of the level above
};

// Memory for a level's decoded streams: masks and PointAttributes.
std::uint64_t decoded_bytes(const LevelDirectory &directory, const AttributeSet &set);

// Verifies the rules of 5.3 to 5.5, which need no chunk: order, nesting in `above` (null for level 1), counts and
// running sums against the section `chunks`, packed or mapped, and sizes against kMaxExpansion.
Result<LevelDirectory> decode_directory(ByteView bytes, int level, const AttributeSet &set, std::uint32_t chunk_points,
                                        const LevelDirectory *above, const SectionEntry &chunks);

} // namespace pbm
