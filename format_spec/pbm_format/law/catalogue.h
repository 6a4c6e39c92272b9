// The catalogue: all faults and remarks on .pbvg files under permanent names.
// BVG.md 9; `pbm-validate --list-codes` prints it.
//
// A code stands for rules of BVG.md; each rule belongs to one code. Codes are added, but never renamed or redefined.
// Stability: stable.
#pragma once

#include "system/error.h"

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace pbm {

// Only errors make a file invalid.
enum class Severity : std::uint8_t { info, warning, error };
std::string_view to_string(Severity severity);

struct CatalogueEntry {
    std::string_view name; // "group.what"
    Severity severity;
    ErrorCode kind;           // of its errors, which determines their exit code
    std::string_view rules;   // of BVG.md, separated by spaces; empty if no rule is broken
    std::string_view meaning; // one line
    std::string_view remedy;  // one line of advice

    constexpr std::string_view group() const { return name.substr(0, name.find('.')); }
    constexpr bool stands_for(std::string_view rule) const {
        for (std::string_view left = rules; !left.empty();) {
            const std::size_t end = left.find(' ');
            if (left.substr(0, end) == rule)
                return true;
            left = end == std::string_view::npos ? std::string_view() : left.substr(end + 1);
        }
        return false;
    }
};

inline constexpr std::array kCatalogue = std::to_array<CatalogueEntry>({
    {"io.open", Severity::error, ErrorCode::io, "",
     "The file cannot be opened: it is not there, or the system refuses.", "Check name and permissions."},
    {"io.not_a_file", Severity::error, ErrorCode::io, "",
     "A folder, a pipe, a socket or a device stands where a file is expected.",
     "Name a file; write what a pipe sends to a file, or name - for standard input. -r looks into folders."},
    {"io.read", Severity::error, ErrorCode::io, "", "The system failed while the file was read.",
     "Check the disk or the network, and copy the file anew."},
    {"system.memory", Severity::error, ErrorCode::memory, "",
     "The model needs more memory than there is, or than may be used.",
     "Raise --max-memory, or examine it with --quick, which needs none."},
    {"header.magic", Severity::error, ErrorCode::not_bvg, "2.1",
     "The file does not start with the magic number: it is something else.",
     "Name a .pbvg file; pbm-build makes one of a scan."},
    {"header.size", Severity::error, ErrorCode::truncated, "2.2 2.7",
     "The file is shorter or longer than its header says.",
     "Copy or download it anew: it was cut off, or something was added to it."},
    {"header.version", Severity::error, ErrorCode::unsupported_version, "2.5",
     "The file is of a version that this program does not read.", "Use a newer program, or build the file anew."},
    {"header.feature", Severity::error, ErrorCode::unsupported_feature, "2.6",
     "The file requires a feature that this program does not know.", "Use a newer program."},
    {"header.reserved", Severity::error, ErrorCode::bad_header, "2.8", "Reserved bytes of the header are not zero.",
     "Writer: write zeros."},
    {"header.field", Severity::error, ErrorCode::bad_header, "2.4 2.9 2.10 2.11 2.12 2.18",
     "A field of the header is outside its limits, or another part of the file says otherwise.",
     "Writer: correct the field."},
    {"header.root", Severity::error, ErrorCode::bad_header, "2.13 2.14 2.15 2.16 2.17",
     "The root record names something that the file does not have.",
     "Writer: fill it with the averages of the whole model, fields without stream with zeros."},
    {"header.optional_feature", Severity::info, ErrorCode::bad_header, "",
     "The file has optional features that this program does not know.",
     "Nothing: they change no picture. A newer program may use them."},
    {"header.chunk_limit", Severity::info, ErrorCode::bad_header, "",
     "The chunk limit is not the 65,536 that writers use.",
     "Nothing; the file may be larger and slower than it need be."},
    {"hash.header", Severity::error, ErrorCode::bad_hash, "2.3", "The header was changed: its hash does not match.",
     "Copy or download the file anew."},
    {"hash.table", Severity::error, ErrorCode::bad_hash, "3.1.3",
     "The section table was changed: its hash does not match.", "Copy or download the file anew."},
    {"hash.section", Severity::error, ErrorCode::bad_hash, "3.2.14", "A section was changed: its hash does not match.",
     "Copy or download the file anew."},
    {"hash.raster", Severity::error, ErrorCode::bad_hash, "3.10.3",
     "The tile directory of a raster was changed: its hash does not match.", "Copy or download the file anew."},
    {"hash.tile", Severity::error, ErrorCode::bad_hash, "3.10.12",
     "A tile of a raster was changed: its hash does not match.", "Copy or download the file anew."},
    {"hash.chunk", Severity::error, ErrorCode::bad_hash, "5.6.4 17.5.1 19.3.1",
     "A chunk was changed: its hash does not match.", "Copy or download the file anew."},
    {"hash.content", Severity::error, ErrorCode::bad_content, "8.1 17.6.1",
     "content_id or fields_id is not that of the content.",
     "Writer: compute it from what is written. Else the file is not what it says it is."},
    {"table.totals", Severity::error, ErrorCode::bad_header, "3.1.1 3.1.6",
     "The header counts other sections or raw bytes than the table has.", "Writer: correct the header."},
    {"table.truncated", Severity::error, ErrorCode::truncated, "3.1.2 3.2.11",
     "The section table or a section lies outside the file.",
     "Copy or download the file anew; writer: correct offset and size."},
    {"table.size", Severity::error, ErrorCode::bad_table, "3.1.4 3.2.9 3.2.13",
     "The sizes of a section contradict each other.", "Writer: correct stored size, raw size, element size and count."},
    {"table.place", Severity::error, ErrorCode::bad_table, "3.1.5 3.2.3",
     "A section does not start where the one before ends, or the last does not end the file.",
     "Writer: leave no gap but the alignment's."},
    {"table.missing", Severity::error, ErrorCode::bad_table, "3.1.7 3.1.8", "A section that every file has is missing.",
     "Writer: write it."},
    {"table.reserved", Severity::error, ErrorCode::bad_table, "3.2.1 3.2.6",
     "Reserved bytes or flags of a section are not zero.", "Writer: write zeros."},
    {"table.order", Severity::error, ErrorCode::bad_table, "3.2.2 3.2.7 3.2.15",
     "A section stands out of order, is there twice, or where there can be none.",
     "Writer: sort the sections, each once."},
    {"table.unknown", Severity::error, ErrorCode::unsupported_feature, "3.2.4",
     "A critical section is of a type that this program does not know.", "Use a newer program."},
    {"table.codec", Severity::error, ErrorCode::unsupported_feature, "3.2.5",
     "A section has a codec that this program does not know, or not that of its storage profile.",
     "Use a newer program; writer: correct the codec."},
    {"table.alignment", Severity::error, ErrorCode::bad_table, "3.2.8 3.2.16",
     "The alignment of a section is not allowed.", "Writer: correct the alignment."},
    {"table.padding", Severity::error, ErrorCode::bad_table, "3.2.12", "Bytes between sections are not zero.",
     "Copy or download the file anew; writer: write zeros."},
    {"table.fields", Severity::error, ErrorCode::bad_table, "17.1.1 17.1.2 17.1.3",
     "The sections of fields are incomplete, critical, or not announced in the header.",
     "Writer: write the fields section, and directory and values of each level, none of them critical; set bit 0 of "
     "the optional features."},
    {"table.shapes", Severity::error, ErrorCode::bad_table, "18.1.1",
     "The section of shapes is critical: readers of earlier versions would refuse the file.",
     "Writer: clear the flag."},
    {"table.point_streams", Severity::error, ErrorCode::bad_table, "19.1.1 19.1.2",
     "A section of a point stream is critical, or its directory or its values are missing.",
     "Writer: write directory and values of each kind and level together, neither of them critical."},
    {"table.not_critical", Severity::warning, ErrorCode::bad_table, "",
     "A known section lacks the critical flag: a reader that does not know it would ignore it.",
     "Writer: set the flag."},
    {"table.optional_section", Severity::info, ErrorCode::bad_table, "",
     "The file has a section of a type that this program does not know and may ignore.",
     "Nothing: it changes no picture. A newer program may use it."},
    {"limit.expansion", Severity::error, ErrorCode::too_large, "3.2.10 5.4.3 17.4.4 19.2.4",
     "Data expand more than 32,768 times.", "Do not trust the file: it is made to exhaust memory."},
    {"limit.nodes", Severity::error, ErrorCode::too_large, "4.5", "A level has more nodes than the caller allows.",
     "Allow more, or read a coarser level."},
    {"metadata.size", Severity::error, ErrorCode::bad_section, "3.3.1", "The metadata are longer than 4,096 bytes.",
     "Writer: keep large data beside the file."},
    {"metadata.json", Severity::error, ErrorCode::bad_section, "3.3.2 3.3.3", "The metadata are no JSON object.",
     "Writer: write one, {} if there is nothing to say."},
    {"metadata.path", Severity::warning, ErrorCode::bad_section, "", "The metadata hold what looks like a path.",
     "Leave it out: it says where the file was made, and equal input gives other bytes elsewhere."},
    {"metadata.run", Severity::warning, ErrorCode::bad_section, "",
     "The metadata hold what looks like a time, a host, a user or a thread count.",
     "Leave it out: equal input gives other bytes next time."},
    {"metadata.twice", Severity::warning, ErrorCode::bad_section, "",
     "A key of the metadata is there twice: programs differ in which one they see.", "Writer: write each key once."},
    {"parameter.size", Severity::error, ErrorCode::bad_section, "3.4.1 3.5.1 3.6.1 3.7.1 3.8.1 3.11.1 17.2.1 18.2.1",
     "A small section is not as long as it must be.", "Writer: write whole records, as many as allowed."},
    {"parameter.reserved", Severity::error, ErrorCode::bad_section, "3.4.6 3.5.6 3.6.5 3.7.7 3.8.4 3.11.4 17.2.6",
     "Reserved bytes of a small section are not zero.", "Writer: write zeros."},
    {"parameter.grid", Severity::error, ErrorCode::bad_section, "3.4.2 3.4.3 3.4.4 3.4.5",
     "Corner, voxel size, unit or up axis of the grid is invalid.", "Writer: correct the grid."},
    {"parameter.unknown", Severity::error, ErrorCode::unsupported_feature, "3.5.2 3.5.4 17.2.4",
     "An attribute, a field, or its format is one that this program does not know.", "Use a newer program."},
    {"parameter.attributes", Severity::error, ErrorCode::bad_section, "3.5.3 3.5.5 3.5.7",
     "The attributes are out of order, incomplete, or have bits that they cannot have.",
     "Writer: correct the attributes section."},
    {"parameter.material", Severity::error, ErrorCode::bad_section, "3.6.2 3.6.3 3.6.4",
     "A coefficient of a material is out of range.", "Writer: correct the material."},
    {"parameter.light", Severity::error, ErrorCode::bad_section, "3.7.2 3.7.3 3.7.4 3.7.5 3.7.6",
     "A field of a light is out of range.", "Writer: correct the light."},
    {"parameter.texture", Severity::error, ErrorCode::bad_section, "3.8.2 3.8.3",
     "A field of a texture is out of range.", "Writer: correct the texture."},
    {"parameter.ground", Severity::error, ErrorCode::bad_section, "3.11.2 3.11.3",
     "Centre or size of the ground plane is invalid.", "Writer: correct the ground plane."},
    {"parameter.field", Severity::error, ErrorCode::bad_section, "17.2.2 17.2.3 17.2.5",
     "Name, unit, offset, scale or root value of a field is invalid.", "Writer: correct the field."},
    {"parameter.together", Severity::error, ErrorCode::bad_section, "3.9.1 3.9.2 3.9.3 3.9.4 3.9.5 3.9.6",
     "Parameters contradict each other: one names what another does not have.", "Writer: write both or none."},
    {"parameter.unused_material", Severity::warning, ErrorCode::bad_section, "",
     "No point and no ground plane has this material.", "Leave it out."},
    {"parameter.dark_light", Severity::warning, ErrorCode::bad_section, "",
     "A light lights nothing: its intensity is 0, or all points lie in its shadow.", "Leave it out, or move it."},
    {"parameter.loose_grid", Severity::warning, ErrorCode::bad_section, "",
     "All points lie in one octant: a grid of half the edge would hold them.",
     "Build with a tighter grid: one level less, the same voxels."},
    {"parameter.far_grid", Severity::warning, ErrorCode::bad_section, "",
     "The grid reaches further than 1e30 from the origin: what programs compute with such coordinates overflows.",
     "Build with another --scale or --origin; pbm-build itself refuses such coordinates."},
    {"raster.truncated", Severity::error, ErrorCode::bad_image, "3.10.1 3.10.2 3.10.11",
     "Header, directory or tiles of a raster do not fill its section.", "Writer: correct the sizes."},
    {"raster.shape", Severity::error, ErrorCode::bad_image, "3.10.4 3.10.15",
     "Width, height or channels of a raster are not allowed.", "Writer: resample the picture."},
    {"raster.field", Severity::error, ErrorCode::bad_image, "3.10.5 3.10.6 3.10.8",
     "Alignment of a raster is not its storage profile's, or reserved bytes are not zero.",
     "Writer: correct header or directory of the raster."},
    {"raster.tile_count", Severity::error, ErrorCode::bad_image, "3.10.7 3.10.16",
     "A raster has other tiles or bytes than its size and the section table say.", "Writer: correct the counts."},
    {"raster.filter", Severity::error, ErrorCode::unsupported_feature, "3.10.9",
     "A tile has a filter that this program does not know.", "Use a newer program."},
    {"raster.tile_size", Severity::error, ErrorCode::bad_image, "3.10.10", "The stored size of a tile is impossible.",
     "Writer: correct the tile's entry."},
    {"raster.padding", Severity::error, ErrorCode::bad_image, "3.10.13", "Bytes between tiles are not zero.",
     "Writer: write zeros."},
    {"raster.mean", Severity::error, ErrorCode::bad_content, "3.10.14",
     "A mip level does not hold the means of the finer one.", "Writer: compute it by 3.10.14."},
    {"octree.empty_mask", Severity::error, ErrorCode::bad_octree, "4.2",
     "A child mask is zero: a node without children.", "Writer: write occupied nodes only."},
    {"octree.mask_count", Severity::error, ErrorCode::truncated, "4.3", "There are not as many masks as nodes above.",
     "Caller: hand in the masks of the whole level."},
    {"octree.point_count", Severity::error, ErrorCode::bad_octree, "4.4",
     "The masks of a chunk have another number of points than the directory.", "Writer: correct masks or counts."},
    {"chunk.split", Severity::error, ErrorCode::bad_directory, "5.2", "The chunks are not those that the octree gives.",
     "Writer: split each level by 5.1."},
    {"chunk.entry", Severity::error, ErrorCode::bad_directory, "5.3.1 5.3.2 5.3.3 5.3.4 5.3.5 5.3.6 5.3.7 5.5.2",
     "Fields of a chunk's entry are impossible.", "Writer: correct the entry."},
    {"chunk.filter", Severity::error, ErrorCode::unsupported_feature, "5.4.1 17.4.2 19.2.2",
     "A stream has a filter that this program does not know.", "Use a newer program."},
    {"chunk.stream_size", Severity::error, ErrorCode::bad_directory, "5.4.2 5.4.4 17.4.3 19.2.3",
     "The stored size of a stream is impossible.", "Writer: correct the stream's entry."},
    {"chunk.order", Severity::error, ErrorCode::bad_directory, "5.5.3", "Chunks overlap or are not in Morton order.",
     "Writer: sort the chunks."},
    {"chunk.parent", Severity::error, ErrorCode::bad_directory, "5.5.4 5.5.5 5.5.6 5.5.7 5.5.9",
     "Chunks do not nest in the chunks of the level above.", "Writer: correct parents and counts."},
    {"chunk.totals", Severity::error, ErrorCode::bad_directory, "5.5.1 5.5.8 5.5.10 5.5.11 17.4.1 17.4.5 19.2.1 19.2.5",
     "The chunks of a level add up to something else than the section table says.",
     "Writer: correct sizes and counts."},
    {"chunk.bricks", Severity::error, ErrorCode::bad_directory, "5.10.2 5.11.1",
     "A mapped level has other bricks than its directory counts.", "Writer: correct the bricks section or the counts."},
    {"chunk.padding", Severity::error, ErrorCode::bad_attribute, "5.10.1",
     "Bytes between the streams of a mapped chunk are not zero.", "Writer: write zeros."},
    {"brick.place", Severity::error, ErrorCode::bad_content, "5.11.2",
     "A brick's place, first point, first node or node map is not that of the octree.",
     "Writer: compute the bricks from the masks."},
    {"brick.bounds", Severity::error, ErrorCode::bad_content, "5.11.3 5.11.4",
     "A brick's normal cone, largest radius or flags are not those of its points.",
     "Writer: compute them from the points."},
    {"frame.zstd", Severity::error, ErrorCode::bad_attribute, "5.6.1 5.6.2 5.6.3",
     "A zstd frame is of another form or size, or does not decode.",
     "Writer: one whole frame with content size, a single segment and no dictionary."},
    {"frame.planes", Severity::error, ErrorCode::bad_attribute, "5.8.1",
     "The planes of a filtered stream have impossible sizes.", "Writer: correct the entries of the planes."},
    {"frame.codes", Severity::error, ErrorCode::bad_attribute, "5.8.2 5.8.3",
     "A filtered stream holds an undefined code.", "Writer: correct the filter."},
    {"point.normal", Severity::error, ErrorCode::bad_attribute, "6.1.4", "A normal has reserved bits set.",
     "Writer: write 14 bits."},
    {"point.radius", Severity::error, ErrorCode::bad_attribute, "6.2.2",
     "A splat radius of the finest level is more than 5 % of the grid's edge.", "Writer: bound the radii."},
    {"point.material", Severity::error, ErrorCode::bad_attribute, "6.4.1",
     "A point names a material that does not exist.", "Writer: correct the index, or write the material."},
    {"point.lit_fraction", Severity::error, ErrorCode::bad_attribute, "6.6.1",
     "Bits behind the last lit fraction are not zero.", "Writer: write zeros."},
    {"point.cone", Severity::error, ErrorCode::bad_attribute, "5.7.1",
     "A normal lies outside the normal cone of its chunk.",
     "Writer: widen the cone; renderers would cull what is seen."},
    {"point.sides", Severity::error, ErrorCode::bad_attribute, "19.4.1 19.4.2 19.4.3",
     "The sides of a chunk have an impossible size or normal, or the chunk has a normal cone.",
     "Writer: write both sides of each marked point, one-sided, and no cone for the chunk."},
    {"point.offsets", Severity::error, ErrorCode::bad_attribute, "19.6.1 19.6.2",
     "The offsets of a chunk have an impossible size, or one leads out of its voxel.",
     "Writer: write one offset of at most 14 sixteenths for each marked point."},
    {"point.average", Severity::error, ErrorCode::bad_content, "7.1 17.3.1",
     "A coarser level does not hold the averages of the finest points.",
     "Writer: compute the levels by BVG.md 7 and 17.3."},
    {"point.loose_cone", Severity::warning, ErrorCode::bad_attribute, "",
     "The normal cone of a chunk is wider than its normals need: renderers cull less than they could.",
     "Writer: take the narrowest cone."},
});

// What errors carry of the entries: a program that lists no codes does not link their texts.
struct CodeOfErrors {
    std::string_view name;
    ErrorCode kind{};
};
inline constexpr auto kCodesOfErrors = [] {
    std::array<CodeOfErrors, kCatalogue.size()> codes{};
    for (std::size_t i = 0; i < codes.size(); ++i)
        codes[i] = {kCatalogue[i].name, kCatalogue[i].kind};
    return codes;
}();

std::span<const CatalogueEntry> catalogue();
// Entry of a name, or of a rule ("4.2"); null if there is none.
const CatalogueEntry *find_code(std::string_view name);
const CatalogueEntry *find_rule(std::string_view rule);
// Entry of an error; for an error without a name, the entry nearest to its kind. Never null.
const CatalogueEntry *entry_of(const Error &error);

// Identifies a check by a rule of BVG.md, or by the name of a code that has no rule. It is a literal and is looked up
// at compile time: a literal that is not in the catalogue does not compile.
class Reason {
  public:
    template <std::size_t kSize> consteval Reason(const char (&literal)[kSize]) {
        const std::string_view text(literal, kSize - 1);
        for (std::size_t i = 0; i < kCatalogue.size(); ++i)
            if (kCatalogue[i].stands_for(text) || (kCatalogue[i].rules.empty() && kCatalogue[i].name == text)) {
                index_ = i;
                rule_ = kCatalogue[i].rules.empty() ? std::string_view() : text;
            }
        if (index_ == kCatalogue.size())
            not_in_the_catalogue();
    }
    const CodeOfErrors &code() const { return kCodesOfErrors[index_]; }
    std::string_view rule() const { return rule_; }

  private:
    static void not_in_the_catalogue() {} // not constexpr, so that compilation fails

    std::size_t index_ = kCatalogue.size();
    std::string_view rule_;
};

// The error of a failed check. The message is the rule and `text`; `expected` and `actual` are the compared values.
[[gnu::cold]] Error broken(Reason reason, std::uint64_t offset, std::string_view text, Value expected = {},
                           Value actual = {});

// How much an error says. `none` gives only code, rule and offset and allocates nothing, for callers that count faults:
// a small file can have tens of thousands.
enum class Wording : std::uint8_t { none, full };
[[gnu::cold]] Error broken(Wording wording, Reason reason, std::uint64_t offset, std::string_view text,
                           Value expected = {}, Value actual = {});

} // namespace pbm
