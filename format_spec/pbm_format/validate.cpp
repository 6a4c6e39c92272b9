#include "pbm_format/validate.h"

#include "pbm_format/chunk.h"
#include "pbm_format/mapped_chunk.h"
#include "pbm_format/parallel.h"
#include "pbm_format/reader.h"

#include <algorithm>
#include <map>
#include <optional>

namespace pbm {

namespace {

// Reads a file section by section in its own order and keeps going where a fault leaves something to read.
class Validator {
  public:
    Validator(ByteView file, const ValidateOptions &options) : file_(file), options_(options) {}

    ValidationReport run() {
        Result<FileHeader> header = decode_header(file_);
        if (!header)
            return fault(header.error(), "header"), report_;
        header_ = *header;
        Result<std::vector<SectionEntry>> sections = decode_section_table(file_, header_);
        if (!sections)
            return fault(sections.error(), "table"), report_;
        sections_ = std::move(sections).value();
        check_padding();
        for (const SectionEntry &entry : sections_)
            check_hash(entry);
        check_small_sections();
        if (!parameters_known_)
            return report_;
        check_levels();
        return report_;
    }

  private:
    std::string name(const SectionEntry &entry) const {
        if (entry.type == SectionType::ground_lit)
            return std::string(to_string(entry.type)) + " " + std::to_string(entry.instance);
        const bool of_level = entry.type == SectionType::level_directory || entry.type == SectionType::level_chunks ||
                              entry.type == SectionType::level_bricks;
        return (of_level ? "level " + std::to_string(entry.instance) + " " : "") + std::string(to_string(entry.type));
    }

    void fault(const Error &error, std::string section, std::int64_t chunk = -1) {
        ++report_.total;
        if (report_.findings.size() < options_.max_findings)
            report_.findings.push_back({error.code, error.offset, std::move(section), chunk, error.message});
    }

    const SectionEntry *find(SectionType type, std::uint32_t instance = 0) const {
        for (const SectionEntry &entry : sections_)
            if (entry.type == type && entry.instance == instance)
                return &entry;
        return nullptr;
    }

    ByteView stored(const SectionEntry &entry) const { return file_.subspan(entry.offset, entry.stored_bytes); }

    void check_padding() {
        std::uint64_t at = kHeaderBytes + sections_.size() * kSectionEntryBytes;
        for (const SectionEntry &entry : sections_) {
            const ByteView padding = file_.subspan(at, entry.offset - at);
            const auto bad = std::find_if(padding.begin(), padding.end(), [](std::uint8_t byte) { return byte != 0; });
            if (bad != padding.end())
                fault({ErrorCode::bad_table, at + static_cast<std::uint64_t>(bad - padding.begin()),
                       "3.2.12 padding is not zero"},
                      "padding");
            at = entry.offset + entry.stored_bytes;
        }
    }

    void check_hash(const SectionEntry &entry) {
        if (hash64(stored(entry)) != entry.hash)
            fault(
                {ErrorCode::bad_hash, entry.offset,
                 "3.2.14 the " + std::string(to_string(entry.type)) + " section was changed: its hash does not match"},
                name(entry));
    }

    template <class Decode> auto small_section(SectionType type, Decode &&decode) {
        using Value = std::remove_cvref_t<decltype(decode(ByteView{}).value())>;
        const SectionEntry &entry = *find(type);
        auto decoded = decode(stored(entry));
        if (decoded)
            return std::optional<Value>(std::move(decoded).value());
        Error error = std::move(decoded).error();
        error.offset += entry.offset;
        fault(error, name(entry));
        return std::optional<Value>();
    }

    void check_small_sections() {
        const SectionEntry &metadata = *find(SectionType::metadata);
        if (Status status = check_metadata(stored(metadata)); !status) {
            status.error().offset += metadata.offset;
            fault(status.error(), name(metadata));
        }
        const int depth = header_.depth;
        const auto grid = small_section(SectionType::grid, [&](ByteView bytes) { return decode_grid(bytes, depth); });
        const auto set =
            small_section(SectionType::attributes, [&](ByteView bytes) { return decode_attributes(bytes, depth); });
        const auto materials = small_section(SectionType::materials, decode_materials);
        bool known = grid && set && materials;
        if (find(SectionType::lights) != nullptr) {
            const auto lights = small_section(SectionType::lights, decode_lights);
            known = known && lights;
            if (lights)
                parameters_.lights = *lights;
        }
        if (find(SectionType::texture) != nullptr) {
            const auto texture = small_section(SectionType::texture, decode_texture);
            known = known && texture;
            if (texture)
                parameters_.texture = {*texture};
        }
        if (find(SectionType::ground_plane) != nullptr) {
            parameters_.ground = small_section(SectionType::ground_plane, decode_ground_plane);
            known = known && parameters_.ground;
        }
        if (!known)
            return;
        parameters_.grid = *grid;
        parameters_.attributes = *set;
        parameters_.materials = *materials;
        Status status = check_parameters(parameters_);
        if (status)
            status = check_rasters(parameters_, sections_);
        if (!status) {
            status.error().offset += find(SectionType::attributes)->offset;
            return fault(status.error(), "attributes");
        }
        parameters_known_ = true;
        if (const Status root = check_root(header_.root, parameters_); !root)
            fault(root.error(), "header");
    }

    // Directories from coarse to fine; one that is broken ends the walk, since the next ones nest in it.
    void check_levels() {
        const auto finest = static_cast<std::uint32_t>(header_.depth);
        if (find(SectionType::level_chunks, finest)->count != header_.point_count)
            fault({ErrorCode::bad_header, 56, "2.18 the header's point count is not that of the finest level"},
                  "header");
        model_.parameters = parameters_;
        model_.levels.resize(finest + 1);
        model_.levels[0].points = root_points(header_.root, parameters_.attributes);
        std::uint64_t memory = 0;
        std::vector<LevelDirectory> directories(1);
        for (std::uint32_t level = 1; level <= finest; ++level) {
            const SectionEntry &entry = *find(SectionType::level_directory, level);
            Result<LevelDirectory> directory =
                decode_directory(stored(entry), static_cast<int>(level), parameters_.attributes, header_.chunk_points,
                                 level == 1 ? nullptr : &directories.back(), *find(SectionType::level_chunks, level));
            if (!directory) {
                directory.error().offset += entry.offset;
                return fault(directory.error(), name(entry));
            }
            if (entry.count != directory->chunks.size())
                return fault({ErrorCode::bad_directory, entry.offset,
                              "5.5.11 the section table counts other chunks than there are"},
                             name(entry));
            if (header_.storage() == Storage::mapped)
                if (Status status = check_brick_count(*directory, *find(SectionType::level_bricks, level)); !status)
                    return fault(status.error(), name(*find(SectionType::level_bricks, level)));
            memory += decoded_bytes(*directory, parameters_.attributes);
            directories.push_back(std::move(directory).value());
        }
        const std::uint64_t faults = report_.total;
        const std::vector<Raster> rasters = read_raster_directories();
        for (const Raster &raster : rasters)
            memory += raster.directory.grid.texel_bytes();
        if (memory > kDefaultMaxMemory)
            return fault(
                {ErrorCode::memory, 0,
                 "the model needs " + std::to_string(memory >> 20) + " MiB of memory: more than the validator may use"},
                "chunks");
        std::vector<bool> refused{false};
        for (std::uint32_t level = 1; level <= finest; ++level)
            load_level(directories[level], directories[level - 1], *find(SectionType::level_chunks, level), refused);
        prove_rasters(rasters);
        if (report_.total == faults)
            check_whole(directories);
    }

    struct Raster {
        const SectionEntry *entry;
        ImageDirectory directory;
    };

    // Those that are there and right.
    std::vector<Raster> read_raster_directories() {
        std::vector<Raster> rasters;
        for (const SectionEntry &entry : sections_) {
            if (!is_raster(entry.type))
                continue;
            Result<ImageDirectory> directory = read_image_directory(file_, entry, header_.storage());
            if (directory)
                rasters.push_back({&entry, std::move(directory).value()});
            else
                fault(directory.error(), name(entry));
        }
        return rasters;
    }

    void prove_rasters(std::span<const Raster> rasters) {
        for (const auto &[entry, directory] : rasters) {
            Image level_0;
            for (const Error &error : prove_image(stored(*entry), entry->offset, directory, options_.threads, level_0))
                fault(error, name(*entry));
            if (entry->type == SectionType::panorama)
                model_.images.panorama = std::move(level_0);
            else if (entry->type == SectionType::ground_texture)
                model_.images.ground_texture = std::move(level_0);
            else
                model_.images.ground_lit.push_back(std::move(level_0));
        }
    }

    // Decodes the chunks whose parents were decoded; `refused` says of which chunks of the level above that is not so,
    // and then of which of this one.
    void load_level(const LevelDirectory &directory, const LevelDirectory &directory_above, const SectionEntry &section,
                    std::vector<bool> &refused) {
        const AttributeSet &set = parameters_.attributes;
        const Level &above = model_.levels[static_cast<std::size_t>(directory.level) - 1];
        Level &level = model_.levels[static_cast<std::size_t>(directory.level)];
        level.masks.resize(directory.nodes);
        level.points.resize(directory.points, set);
        const ChunkRules rules{.set = set,
                               .material_count = parameters_.materials.size(),
                               .level = directory.level,
                               .finest = directory.level == header_.depth};
        std::vector<std::optional<Error>> failures(directory.chunks.size());
        parallel_for(failures.size(), options_.threads, [&](std::size_t i) {
            const ChunkEntry &entry = directory.chunks[i];
            if (refused[entry.shape.parent_chunk])
                return;
            thread_local Chunk chunk;
            const Status status = header_.storage() == Storage::mapped
                                      ? load_mapped(entry, directory_above, rules, chunk)
                                      : decode_chunk(entry, file_.subspan(entry.offset, entry.stored_bytes), rules,
                                                     parent_nodes(entry, above.masks, 0, above.points, 0, set), chunk);
            if (status)
                place_chunk(chunk, entry, set, level);
            else
                failures[i] = status.error();
        });
        std::vector<bool> refused_here(failures.size());
        for (std::size_t i = 0; i < failures.size(); ++i) {
            refused_here[i] = failures[i] || refused[directory.chunks[i].shape.parent_chunk];
            if (failures[i])
                fault(*failures[i], name(section), static_cast<std::int64_t>(i));
            if (refused_here[i])
                continue;
            ++report_.chunks;
            if (rules.finest)
                report_.points += directory.chunks[i].shape.points;
        }
        refused = std::move(refused_here);
    }

    // Proves a chunk of a mapped file where it lies; its parent was not refused.
    Status load_mapped(const ChunkEntry &entry, const LevelDirectory &directory_above, const ChunkRules &rules,
                       Chunk &to) const {
        const auto level = static_cast<std::uint32_t>(rules.level);
        const SectionEntry &bricks = *find(SectionType::level_bricks, level);
        BrickParents parents;
        if (level > 1) {
            const ChunkEntry &above = directory_above.chunks[entry.shape.parent_chunk];
            const ChunkView view =
                view_chunk(above, file_, *find(SectionType::level_bricks, level - 1), rules.set, rules.level - 1);
            parents = brick_parents(entry, above, view.bricks, view.masks);
        }
        if (Status status = prove_chunk(entry, file_, bricks, rules, parents); !status)
            return status;
        copy_chunk(view_chunk(entry, file_, bricks, rules.set, rules.level), rules.set, rules.level, to);
        return {};
    }

    // What only the whole model shows: chunk rule, content_id, averages.
    void check_whole(const std::vector<LevelDirectory> &directories) {
        LevelMasks masks;
        for (const Level &level : model_.levels)
            masks.push_back(level.masks);
        const auto shapes = split_into_chunks(masks, header_.chunk_points);
        for (std::size_t level = 1; level < directories.size(); ++level) {
            const SectionEntry &entry = *find(SectionType::level_directory, static_cast<std::uint32_t>(level));
            const auto &chunks = directories[level].chunks;
            const auto differ = std::mismatch(shapes[level].begin(), shapes[level].end(), chunks.begin(), chunks.end(),
                                              [](const ChunkShape &a, const ChunkEntry &b) { return a == b.shape; });
            if (differ.first != shapes[level].end() || differ.second != chunks.end()) {
                const auto index = differ.second - chunks.begin();
                fault({ErrorCode::bad_directory,
                       entry.offset + static_cast<std::uint64_t>(index) * chunk_entry_bytes(parameters_.attributes),
                       "5.2 the chunk is not a maximal subtree within the limit"},
                      name(entry), index);
            }
        }
        if (content_id(model_, shapes, header_.chunk_points) != header_.content_id)
            fault({ErrorCode::bad_content, 72, "8.1 content_id is not that of the content"}, "header");
        std::vector<PointAttributes> stored_points;
        for (std::size_t level = 0; level + 1 < model_.levels.size(); ++level)
            stored_points.push_back(std::move(model_.levels[level].points));
        average_levels(model_, options_.threads);
        for (std::size_t level = 0; level < stored_points.size(); ++level)
            if (stored_points[level] != model_.levels[level].points) {
                const SectionEntry *entry = find(SectionType::level_chunks, static_cast<std::uint32_t>(level));
                fault({ErrorCode::bad_content, level == 0 ? 88 : entry->offset,
                       "7.1 level " + std::to_string(level) + " does not hold the averages of the finest points"},
                      level == 0 ? "header" : name(*entry));
            }
    }

    ByteView file_;
    const ValidateOptions &options_;
    ValidationReport report_;
    FileHeader header_;
    std::vector<SectionEntry> sections_;
    ModelParameters parameters_;
    bool parameters_known_ = false;
    Model model_;
};

} // namespace

ValidationReport validate(ByteView file, const ValidateOptions &options) { return Validator(file, options).run(); }

} // namespace pbm
