#include "pbm_format/checking/file_walk.h"

#include "pbm_format/checking/advice.h"
#include "pbm_format/checking/content_rules.h"
#include "pbm_format/checking/raster_rules.h"
#include "pbm_format/chunks/chunk.h"
#include "pbm_format/chunks/field_chunk.h"
#include "pbm_format/chunks/mapped_chunk.h"
#include "pbm_format/container/file_rules.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace pbm {

namespace {

// Where to store the next raster of this type; lit fractions are in the order of the lights.
Image &next_raster(SectionType type, ModelImages &images) {
    return type == SectionType::panorama         ? images.panorama
           : type == SectionType::ground_texture ? images.ground_texture
                                                 : images.ground_lit.emplace_back();
}

class FileWalk {
  public:
    FileWalk(ByteView file, const ValidateOptions &options, AfterError after_error)
        : file_(file), options_(options), stops_(after_error == AfterError::stop) {}

    ValidationReport run() {
        check_file();
        return std::move(report_);
    }

  private:
    void check_file() {
        Result<FileHeader> header = decode_header(file_);
        if (!header)
            return fault(header.error(), "header");
        header_ = *header;
        Result<std::vector<SectionEntry>> sections = decode_section_table(file_, header_);
        if (!sections)
            return fault(sections.error(), "table");
        sections_ = std::move(sections).value();
        if (const Status counted = check_point_count(header_, *find(SectionType::level_chunks, header_.depth));
            !counted)
            fault(counted.error(), "header");
        if (const Status announced = check_fields_announced(header_, sections_); !announced)
            fault(announced.error(), "header");
        if (options_.level == ValidationLevel::quick)
            return;
        if (advises()) {
            give(advise_on_header(header_), "header");
            give(advise_on_table(sections_), "table");
        }
        check_stored();
        if (options_.level != ValidationLevel::hashes && check_small_sections())
            check_levels();
    }

    bool deep() const { return options_.level == ValidationLevel::deep; }
    bool advises() const { return deep() && options_.least != Severity::error; }

    std::string name(const SectionEntry &entry) const {
        if (entry.type == SectionType::ground_lit)
            return std::string(to_string(entry.type)) + " " + std::to_string(entry.instance);
        const SectionTraits *const traits = traits_of(entry.type);
        const bool of_level = traits != nullptr && traits->is_of_level;
        return (of_level ? "level " + std::to_string(entry.instance) + " " : "") + std::string(to_string(entry.type));
    }

    // Counts a fault. Returns whether to report it.
    bool count(const CatalogueEntry &entry, ErrorCode code) {
        if (entry.severity >= options_.least) {
            found_fault_ |= entry.severity == Severity::error;
            return report_.count(entry, code, options_);
        }
        return false;
    }

    void report(Error error, std::string section, std::int64_t chunk) {
        if (stops_)
            throw std::move(error);
        report_.findings.push_back({.code = error.code,
                                    .offset = error.offset,
                                    .section = std::move(section),
                                    .chunk = chunk,
                                    .message = std::move(error.message),
                                    .entry = entry_of(error),
                                    .rule = error.rule,
                                    .tile = error.tile,
                                    .expected = std::move(error.expected),
                                    .actual = std::move(error.actual)});
    }

    void fault(const Error &error, const std::string &section, std::int64_t chunk = -1) {
        if (count(*entry_of(error), error.code))
            report(error, section, chunk);
    }

    void give(const std::vector<Advice> &advice, const std::string &section) {
        for (const Advice &item : advice)
            fault(item.what, section, item.chunk);
    }

    const SectionEntry *find(SectionType type, std::uint32_t instance = 0) const {
        return find_section(sections_, type, instance);
    }

    ByteView stored(FileRange range) const { return slice(file_, range.offset, range.bytes); }
    ByteView stored(const SectionEntry &entry) const { return stored(entry.range()); }

    void check_stored() {
        std::uint64_t end = kHeaderBytes + sections_.size() * kSectionEntryBytes;
        for (const SectionEntry &entry : sections_) {
            if (const Status status = check_padding(file_, end, entry.offset); !status)
                fault(status.error(), "padding");
            end = entry.offset + entry.stored_bytes;
        }
        for (const SectionEntry &entry : sections_)
            if (const Status status = verify_hash(stored(entry), entry); !status) {
                fault(status.error(), name(entry));
                changed_.push_back(&entry);
            }
    }

    // The section's hash does not match, which explains any other fault of the section.
    bool is_changed(const SectionEntry &entry) const {
        return std::find(changed_.begin(), changed_.end(), &entry) != changed_.end();
    }

    void check_metadata_section() {
        const SectionEntry &entry = *find(SectionType::metadata);
        Status status = check_metadata(stored(entry));
        if (status && advises())
            give(advise_on_metadata(stored(entry), entry.offset), name(entry));
        if (status || is_changed(entry))
            return;
        status.error().offset += entry.offset;
        fault(status.error(), name(entry));
    }

    // Returns whether the parameters are known, so that chunks can be read.
    bool check_small_sections() {
        check_metadata_section();
        const auto read = [&](const SectionEntry &entry, auto &to, const auto &decode) {
            auto decoded = decode(stored(entry));
            if (decoded) {
                to = std::move(decoded).value();
                return true;
            }
            decoded.error().offset += entry.offset;
            if (!is_changed(entry))
                fault(decoded.error(), name(entry));
            return false;
        };
        if (!read_small_sections(header_, sections_, parameters_, read))
            return false;
        if (const Status status = check_parameters(parameters_, sections_); !status) {
            fault(status.error(), "attributes");
            return false;
        }
        if (const Status root = check_root(header_.root, parameters_); !root) {
            fault(root.error(), "header");
            root_is_wrong_ = true;
        }
        return true;
    }

    // Checks directories from coarse to fine. An error ends the walk, since finer directories refer to coarser ones.
    void check_levels() {
        const auto finest = static_cast<std::uint32_t>(header_.depth);
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
                if (!is_changed(entry))
                    fault_of_directory(std::move(directory).error(), entry);
                return;
            }
            if (const Status counted = check_chunk_count(*directory, entry, sections_); !counted)
                return fault(counted.error(), "table");
            if (header_.storage() == Storage::mapped)
                if (Status status = check_brick_count(*directory, *find(SectionType::level_bricks, level)); !status)
                    return fault(status.error(), name(*find(SectionType::level_bricks, level)));
            memory += decoded_bytes(*directory, parameters_.attributes);
            directories.push_back(std::move(directory).value());
        }
        const std::vector<Raster> rasters = read_raster_directories();
        for (const Raster &raster : rasters)
            memory += raster.directory.grid.texel_bytes();
        for (const LevelDirectory &directory : directories)
            for (const Field &field : parameters_.fields)
                memory += directory.points * field.bytes;
        if (memory > addressable(options_.max_memory))
            return fault(broken("system.memory", 0,
                                "the model needs " + std::to_string(memory >> 20) +
                                    " MiB of memory: more than the validator may use",
                                options_.max_memory, memory),
                         "chunks");
        std::vector<bool> refused{false};
        for (std::uint32_t level = 1; level <= finest; ++level)
            load_level(directories[level], directories[level - 1], refused);
        check_rasters(rasters);
        if (!parameters_.fields.empty() && !is_incomplete_)
            load_fields(directories);
        if (!is_incomplete_)
            check_whole(directories);
    }

    void fault_of_directory(Error error, const SectionEntry &entry) {
        const std::uint64_t chunk = error.offset / chunk_entry_bytes(parameters_.attributes);
        const bool in_chunk = error.rule != "5.5.1" && error.offset < entry.stored_bytes;
        error.offset += entry.offset;
        fault(error, name(entry), in_chunk ? static_cast<std::int64_t>(chunk) : -1);
    }

    // Reports the error of a chunk that was refused with the code `entry`.
    void tell_of_chunk(const Status &status, const CatalogueEntry &entry, std::size_t chunk, std::uint64_t offset) {
        Error error{.code = entry.kind, .offset = offset, .message = std::string(entry.meaning), .name = entry.name};
        if (!status) // otherwise another process has changed the bytes since
            error = status.error();
        const std::string section = name_at(error.offset); // chunks or bricks of the level
        report(std::move(error), section, static_cast<std::int64_t>(chunk));
    }

    struct Raster {
        const SectionEntry *entry;
        ImageDirectory directory;
    };

    // Returns the rasters with valid tile directories.
    std::vector<Raster> read_raster_directories() {
        std::vector<Raster> rasters;
        for (const SectionEntry &entry : sections_) {
            if (!is_raster(entry.type))
                continue;
            Result<ImageDirectory> directory = read_image_directory(file_, entry, header_.storage());
            if (!directory) {
                fault(directory.error(), name(entry));
                is_incomplete_ = true;
                continue;
            }
            rasters.push_back({&entry, std::move(directory).value()});
        }
        return rasters;
    }

    void check_rasters(std::span<const Raster> rasters) {
        for (const Raster &raster : rasters) {
            const SectionEntry &entry = *raster.entry;
            FaultSink faults{.wants = [this](const CatalogueEntry &code) { return count(code, code.kind); },
                             .take = [&](Error error) { report(std::move(error), name(entry), -1); }};
            next_raster(entry.type, model_.images) =
                check_raster({stored(entry), entry.offset, raster.directory}, options_.threads, deep(), faults);
            is_incomplete_ |= faults.count > 0;
        }
    }

    // Decodes chunks with decoded parents. `refused` marks refused chunks: of the level above, on return of this one.
    void load_level(const LevelDirectory &directory, const LevelDirectory &directory_above,
                    std::vector<bool> &refused) {
        const AttributeSet &set = parameters_.attributes;
        const Level &above = model_.levels[static_cast<std::size_t>(directory.level) - 1];
        Level &level = model_.levels[static_cast<std::size_t>(directory.level)];
        // Allocate nothing for levels below a level without valid chunks, whatever their directories say.
        if (std::all_of(refused.begin(), refused.end(), [](bool chunk) { return chunk; })) {
            refused.assign(directory.chunks.size(), true);
            return;
        }
        level.masks.resize(static_cast<std::size_t>(directory.nodes));
        level.points.resize(static_cast<std::size_t>(directory.points), set);
        const auto load = [&](const ChunkEntry &entry, Wording wording, Chunk &chunk) {
            const ChunkRules rules{.set = set,
                                   .material_count = parameters_.materials.size(),
                                   .level = directory.level,
                                   .finest = directory.level == header_.depth,
                                   .wording = wording};
            return header_.storage() == Storage::mapped
                       ? load_mapped(entry, directory_above, rules, chunk)
                       : decode_chunk(entry, stored(chunk_range(entry)), rules,
                                      parent_nodes(entry, above.masks, 0, above.points, 0, set), chunk);
        };
        // Collect codes only: formatting an error takes longer than refusing a chunk.
        std::vector<const CatalogueEntry *> failures(directory.chunks.size());
        std::atomic<bool> stopped{false};
        parallel_for(failures.size(), options_.threads, [&](std::size_t i) {
            const ChunkEntry &entry = directory.chunks[i];
            if (stopped || refused[entry.shape.parent_chunk])
                return;
            Chunk &chunk = per_thread<Chunk>();
            if (const Status status = load(entry, Wording::none, chunk); status) {
                place_chunk(chunk, entry, set, level);
            } else {
                failures[i] = entry_of(status.error());
                stopped = stops_;
            }
        });
        std::vector<bool> refused_here(failures.size());
        for (std::size_t i = 0; i < failures.size(); ++i) {
            const ChunkEntry &entry = directory.chunks[i];
            refused_here[i] = failures[i] != nullptr || refused[entry.shape.parent_chunk];
            if (failures[i] != nullptr && count(*failures[i], failures[i]->kind))
                tell_of_chunk(load(entry, Wording::full, per_thread<Chunk>()), *failures[i], i, entry.offset);
            is_incomplete_ |= refused_here[i];
            if (refused_here[i])
                continue;
            ++report_.chunks;
            if (directory.level == header_.depth)
                report_.points += entry.shape.points;
        }
        refused = std::move(refused_here);
    }

    // Decodes the fields of all levels, whose masks are known. An error ends the walk of the fields.
    void load_fields(const std::vector<LevelDirectory> &directories) {
        const Result<FieldTable> table = decode_fields(stored(*find(SectionType::fields)));
        if (!table) // check_small_sections has reported it
            return;
        for (std::size_t f = 0; f < table->fields.size(); ++f) {
            model_.levels[0].fields.emplace_back(table->fields[f].bytes);
            set_stored_value(model_.levels[0].fields[f], 0, table->fields[f].bytes, table->roots[f]);
        }
        for (std::size_t level = 1; level < directories.size() && !is_incomplete_; ++level)
            load_fields(directories[level]);
    }

    void load_fields(const LevelDirectory &level) {
        const auto instance = static_cast<std::uint32_t>(level.level);
        const SectionEntry &entry = *find(SectionType::field_directory, instance);
        const SectionEntry &values = *find(SectionType::field_values, instance);
        const std::vector<Field> &fields = parameters_.fields;
        const Result<FieldDirectory> directory = decode_field_directory(stored(entry), level, fields, values);
        if (!directory) {
            is_incomplete_ = true;
            Error error = directory.error();
            error.offset += entry.offset;
            if (!is_changed(entry))
                fault(error, name(entry));
            return;
        }
        Level &here = model_.levels[instance];
        const Level &above = model_.levels[instance - 1];
        for (const Field &field : fields)
            here.fields.emplace_back(static_cast<std::size_t>(level.points) * field.bytes);
        std::vector<Status> results(level.chunks.size());
        parallel_for(results.size(), options_.threads, [&](std::size_t i) {
            const ChunkEntry &chunk = level.chunks[i];
            Bytes decoded;
            for (std::size_t f = 0; f < fields.size() && results[i]; ++f) {
                const std::uint64_t bytes = fields[f].bytes;
                const FieldEntry &at = directory->at(i, f);
                results[i] =
                    decode_field(at, fields[f], stored({at.offset, at.stream.stored_bytes}),
                                 slice(here.masks, chunk.first_node, chunk.shape.nodes),
                                 slice(above.fields[f], bytes * chunk.first_node, bytes * chunk.shape.nodes), decoded);
                if (results[i])
                    std::copy(decoded.begin(), decoded.end(),
                              here.fields[f].begin() + static_cast<std::ptrdiff_t>(bytes * chunk.first_point));
            }
        });
        for (std::size_t i = 0; i < results.size(); ++i) {
            is_incomplete_ |= !results[i];
            if (!results[i])
                fault(results[i].error(), name(values), static_cast<std::int64_t>(i));
        }
    }

    // Verifies a chunk of a mapped file in place and copies it; its parent must not be refused.
    Status load_mapped(const ChunkEntry &entry, const LevelDirectory &directory_above, const ChunkRules &rules,
                       Chunk &to) const {
        const auto level = static_cast<std::uint32_t>(rules.level);
        const SectionEntry &bricks = *find(SectionType::level_bricks, level);
        BrickParents parents;
        if (level > 1) {
            const ChunkEntry &above = directory_above.chunks[entry.shape.parent_chunk];
            const ChunkBytes bytes = bytes_of(above, *find(SectionType::level_bricks, level - 1));
            const ChunkView view = view_chunk(above, bytes, rules.set, rules.level - 1);
            parents = brick_parents(entry, above, view.bricks, view.masks);
        }
        const ChunkBytes bytes = bytes_of(entry, bricks);
        if (Status status = verify_chunk(entry, bytes, bricks, rules, parents); !status)
            return status;
        copy_chunk(view_chunk(entry, bytes, rules.set, rules.level), rules.set, rules.level, to);
        return {};
    }

    ChunkBytes bytes_of(const ChunkEntry &entry, const SectionEntry &bricks) const {
        return {.streams = {stored(chunk_range(entry)), nullptr},
                .bricks = {stored(brick_range(entry, bricks)), nullptr}};
    }

    // Checks rules of the whole model: split into chunks, content_id, averages.
    void check_whole(const std::vector<LevelDirectory> &directories) {
        LevelMasks masks;
        for (const Level &level : model_.levels)
            masks.push_back(level.masks);
        const auto shapes = split_into_chunks(masks, header_.chunk_points);
        check_split(directories, shapes);
        if (is_incomplete_ || !changed_.empty()) // the content is not as written
            return;
        if (const Status status = check_content_id(header_, content_id(model_, shapes, header_.chunk_points)); !status)
            fault(status.error(), "header");
        if (const SectionEntry *const fields = find(SectionType::fields))
            if (const Status status = check_fields_id(stored(*fields), fields->offset, model_.levels.back()); !status)
                fault(status.error(), name(*fields));
        if (advises() && !found_fault_)
            advise(directories);
        if (deep())
            check_averages(directories);
    }

    void check_split(const std::vector<LevelDirectory> &directories,
                     const std::vector<std::vector<ChunkShape>> &shapes) {
        for (std::size_t level = 1; level < directories.size(); ++level) {
            const SectionEntry &entry = *find(SectionType::level_directory, static_cast<std::uint32_t>(level));
            const auto &chunks = directories[level].chunks;
            const auto differ = std::mismatch(shapes[level].begin(), shapes[level].end(), chunks.begin(), chunks.end(),
                                              [](const ChunkShape &a, const ChunkEntry &b) { return a == b.shape; });
            if (differ.first == shapes[level].end() && differ.second == chunks.end())
                continue;
            const auto index = differ.second - chunks.begin();
            fault(wrong_split(entry.offset +
                                  static_cast<std::uint64_t>(index) * chunk_entry_bytes(parameters_.attributes),
                              differ.first == shapes[level].end() ? nullptr : &*differ.first,
                              differ.second == chunks.end() ? nullptr : &differ.second->shape),
                  name(entry), index);
            is_incomplete_ = true;
        }
    }

    void check_averages(const std::vector<LevelDirectory> &directories) {
        std::vector<PointAttributes> stored_points;
        std::vector<std::vector<Bytes>> stored_fields;
        for (std::size_t level = 0; level + 1 < model_.levels.size(); ++level) {
            stored_points.push_back(std::move(model_.levels[level].points));
            stored_fields.push_back(std::exchange(model_.levels[level].fields, {}));
        }
        average_levels(model_, options_.threads);
        check_field_averages(stored_fields);
        for (std::size_t level = root_is_wrong_ ? 1 : 0; level < stored_points.size(); ++level) {
            const PointAttributes &computed = model_.levels[level].points;
            if (stored_points[level] == computed)
                continue;
            const SectionEntry *entry = find(SectionType::level_chunks, static_cast<std::uint32_t>(level));
            const WrongAverage wrong = find_wrong_average(level == 0 ? 88 : entry->offset, level, stored_points[level],
                                                          computed, parameters_.attributes);
            std::int64_t chunk = -1;
            for (const ChunkEntry &candidate : directories[level].chunks)
                chunk += candidate.first_point <= wrong.point ? 1 : 0;
            fault(wrong.error, level == 0 ? "header" : name(*entry), chunk);
        }
    }

    void check_field_averages(const std::vector<std::vector<Bytes>> &stored_fields) {
        for (std::size_t level = 0; level < stored_fields.size(); ++level)
            for (std::size_t f = 0; f < stored_fields[level].size(); ++f) {
                const SectionEntry &entry = level == 0
                                                ? *find(SectionType::fields)
                                                : *find(SectionType::field_values, static_cast<std::uint32_t>(level));
                if (const Status status = check_field_average(parameters_.fields[f], level, stored_fields[level][f],
                                                              model_.levels[level].fields[f], entry.offset);
                    !status)
                    fault(status.error(), name(entry));
            }
    }

    void advise(const std::vector<LevelDirectory> &directories) {
        const FileContents contents{.sections = sections_, .model = model_, .directories = directories};
        for (const Advice &item : advise_on_parameters(contents))
            fault(item.what, name_at(item.what.offset));
        for (const Advice &item : advise_on_cones(contents, options_.threads))
            fault(item.what, name_at(item.what.offset), item.chunk);
    }

    // Name of the last section that starts at or before `offset`.
    std::string name_at(std::uint64_t offset) const {
        const auto after =
            std::upper_bound(sections_.begin(), sections_.end(), offset,
                             [](std::uint64_t at, const SectionEntry &entry) { return at < entry.offset; });
        return name(*(after - 1));
    }

    ByteView file_;
    const ValidateOptions &options_;
    const bool stops_;
    ValidationReport report_;
    FileHeader header_;
    std::vector<SectionEntry> sections_;
    ModelParameters parameters_;
    std::vector<const SectionEntry *> changed_; // their hashes do not match
    bool found_fault_ = false;                  // of severity error
    bool is_incomplete_ = false;                // part of the model could not be read
    bool root_is_wrong_ = false;
    Model model_;
};

} // namespace

ValidationReport walk_file(ByteView file, const ValidateOptions &options, AfterError after_error) {
    return FileWalk(file, options, after_error).run();
}

} // namespace pbm
