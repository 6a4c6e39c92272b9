#include "pbm_format/checking/file_walk.h"

#include "pbm_format/checking/model_walk.h"
#include "pbm_format/checking/raster_rules.h"
#include "pbm_format/chunks/point_stream_chunk.h"
#include "pbm_format/container/content_id.h"
#include "pbm_format/container/file_rules.h"
#include "system/threads/parallel.h"

#include <algorithm>
#include <utility>

namespace pbm {

namespace {

class FileWalk {
  public:
    FileWalk(ByteView file, const ValidateOptions &options, AfterError after_error)
        : options_(options), stops_(after_error == AfterError::stop) {
        file_.bytes = file;
    }

    ValidationReport run() {
        check_file();
        return std::move(report_);
    }

  private:
    struct Raster {
        const SectionEntry *entry;
        ImageDirectory directory;
    };

    void check_file() {
        Result<FileHeader> decoded = decode_header(file_.bytes);
        if (!decoded)
            return fault(decoded.error(), "header");
        file_.header = *decoded;
        Result<std::vector<SectionEntry>> sections = decode_section_table(file_.bytes, header());
        if (!sections)
            return fault(sections.error(), "table");
        file_.sections = std::move(sections).value();
        if (const Status counted = check_point_count(header(), *find(SectionType::level_chunks, header().depth));
            !counted)
            fault(counted.error(), "header");
        if (const Status announced = check_fields_announced(header(), file_.sections); !announced)
            fault(announced.error(), "header");
        if (options_.level == ValidationLevel::quick)
            return;
        if (advises()) {
            give(advise_on_header(header()), "header");
            give(advise_on_table(file_.sections), "table");
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
        if (traits != nullptr && traits->is_point_stream)
            return "level " + std::to_string(entry.instance % kStreamKinds) + " " + std::string(traits->name);
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
        return find_section(file_.sections, type, instance);
    }

    ByteView stored(FileRange range) const { return file_.stored(range); }
    ByteView stored(const SectionEntry &entry) const { return stored(entry.range()); }

    void check_stored() {
        std::uint64_t end = kHeaderBytes + file_.sections.size() * kSectionEntryBytes;
        for (const SectionEntry &entry : file_.sections) {
            if (const Status status = check_padding(file_.bytes, end, entry.offset); !status)
                fault(status.error(), "padding");
            end = entry.offset + entry.stored_bytes;
        }
        for (const SectionEntry &entry : file_.sections)
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
        if (!read_small_sections(header(), file_.sections, file_.parameters, read))
            return false;
        if (const Status status = check_parameters(parameters(), file_.sections); !status) {
            fault(status.error(), "attributes");
            return false;
        }
        if (const Status root = check_root(header().root, parameters()); !root) {
            fault(root.error(), "header");
            root_is_wrong_ = true;
        }
        return true;
    }

    // Checks directories from coarse to fine. An error ends the walk, since finer directories refer to coarser ones.
    void check_levels() {
        const auto finest = static_cast<std::uint32_t>(header().depth);
        file_.directories.resize(1);
        for (std::uint32_t level = 1; level <= finest; ++level) {
            const SectionEntry &entry = *find(SectionType::level_directory, level);
            Result<LevelDirectory> directory = decode_directory(
                stored(entry), static_cast<int>(level), parameters().attributes, header().chunk_points,
                level == 1 ? nullptr : &file_.directories.back(), *find(SectionType::level_chunks, level));
            if (!directory) {
                if (!is_changed(entry))
                    fault_of_directory(std::move(directory).error(), entry);
                return;
            }
            if (const Status counted = check_chunk_count(*directory, entry, file_.sections); !counted)
                return fault(counted.error(), "table");
            if (header().storage() == Storage::mapped)
                if (Status status = check_brick_count(*directory, *find(SectionType::level_bricks, level)); !status)
                    return fault(status.error(), name(*find(SectionType::level_bricks, level)));
            file_.directories.push_back(std::move(directory).value());
        }
        const std::vector<Raster> rasters = read_raster_directories();
        const Status fields = read_field_directories();
        const std::array directories{read_stream_directories(PointStream::sides),
                                     read_stream_directories(PointStream::offsets)};
        ModelWalk walk(file_, {.threads = options_.threads,
                               .max_memory = addressable(options_.max_memory),
                               .stops_at_fault = stops_,
                               .whole_rules = !is_incomplete_,
                               .averages = deep() && changed_.empty(),
                               .advice = advises() && changed_.empty(),
                               .root_wrong = root_is_wrong_,
                               .raster_text = content_bytes(rasters),
                               .raster_memory = decoded_bytes(rasters)});
        if (const std::uint64_t memory = walk.min_memory(); memory > addressable(options_.max_memory))
            return fault(broken("system.memory", 0,
                                "the model needs " + std::to_string((memory + 0xFFFFF) >> 20) +
                                    " MiB of memory: more than the validator may use",
                                options_.max_memory, memory),
                         "chunks");
        walk.run();
        report_chunks(walk);
        check_rasters(rasters, walk);
        if (!is_incomplete_)
            report_fields(walk, fields);
        for (std::size_t i = 0; i < directories.size(); ++i)
            check_stream(kPointStreams[i], directories[i]);
        if (!is_incomplete_)
            check_whole(walk, rasters);
    }

    // Fields come after all else in the order of faults, but their values are decoded with the chunks. Returns the
    // error of the first directory that was refused.
    Status read_field_directories() {
        if (parameters().fields.empty())
            return {};
        Result<FieldTable> table = decode_fields(stored(*find(SectionType::fields)));
        is_incomplete_ |= !table; // check_small_sections has read it: another process has changed the bytes since
        if (!table)
            return {};
        file_.fields = std::move(table).value();
        file_.parameters.fields = file_.fields.fields;
        file_.field_directories.resize(1);
        for (std::uint32_t level = 1; level < file_.directories.size(); ++level) {
            const SectionEntry &entry = *find(SectionType::field_directory, level);
            Result<FieldDirectory> directory = decode_field_directory(
                stored(entry), file_.directories[level], parameters().fields, *find(SectionType::field_values, level));
            if (!directory) {
                Error error = std::move(directory).error();
                error.offset += entry.offset;
                return error;
            }
            file_.field_directories.push_back(std::move(directory).value());
        }
        return {};
    }

    // The same for a kind of point stream. Kinds that this version does not know are ignored.
    Status read_stream_directories(PointStream kind) {
        file_.streams(kind).resize(file_.directories.size());
        for (std::uint32_t level = 1; level < file_.directories.size(); ++level) {
            const std::uint32_t instance = instance_of(kind, static_cast<int>(level));
            const SectionEntry *const entry = find(SectionType::stream_directory, instance);
            if (entry == nullptr)
                continue;
            Result<std::vector<PointStreamEntry>> directory = decode_stream_directory(
                stored(*entry), file_.directories[level], *find(SectionType::stream_values, instance));
            if (!directory) {
                Error error = std::move(directory).error();
                error.offset += entry->offset;
                if (is_changed(*entry))
                    continue;
                return error;
            }
            file_.streams(kind)[level] = std::move(directory).value();
        }
        return {};
    }

    // What a stream says of a chunk depends on no other one.
    void check_stream(PointStream kind, const Status &directories) {
        if (!directories)
            fault(directories.error(), name_at(directories.error().offset));
        for (std::size_t level = 1; level < file_.streams(kind).size(); ++level) {
            const std::vector<PointStreamEntry> &entries = file_.streams(kind)[level];
            std::vector<Status> checked(entries.size());
            parallel_for(entries.size(), options_.threads, [&](std::size_t i) {
                const ChunkEntry &chunk = file_.directories[level].chunks[i];
                checked[i] = check_values(kind, entries[i], static_cast<int>(level), chunk);
            });
            for (std::size_t i = 0; i < checked.size(); ++i)
                if (!checked[i])
                    fault(checked[i].error(), name_at(entries[i].offset), static_cast<std::int64_t>(i));
        }
    }

    Status check_values(PointStream kind, const PointStreamEntry &entry, int level, const ChunkEntry &chunk) const {
        if (kind == PointStream::offsets) {
            Offsets offsets;
            return decode_offsets(entry, stored(entry.range()), chunk.shape.points, Wording::full, offsets);
        }
        Sides sides;
        return decode_sides(entry, stored(entry.range()), chunk,
                            {.set = parameters().attributes,
                             .material_count = parameters().materials.size(),
                             .level = level,
                             .finest = level == header().depth},
                            sides);
    }

    void fault_of_directory(Error error, const SectionEntry &entry) {
        const std::uint64_t chunk = error.offset / chunk_entry_bytes(parameters().attributes);
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

    // Returns the rasters with valid tile directories.
    std::vector<Raster> read_raster_directories() {
        std::vector<Raster> rasters;
        for (const SectionEntry &entry : file_.sections) {
            if (!is_raster(entry.type))
                continue;
            Result<ImageDirectory> directory = read_image_directory(file_.bytes, entry, header().storage());
            if (!directory) {
                fault(directory.error(), name(entry));
                is_incomplete_ = true;
                continue;
            }
            rasters.push_back({&entry, std::move(directory).value()});
        }
        return rasters;
    }

    static Bytes content_of(const Raster &raster) {
        const TileGrid &grid = raster.directory.grid;
        return content_of_raster(raster.entry->type, raster.entry->instance, grid.width(0), grid.height(0));
    }

    // What rasters add to the text of content_id.
    static std::uint64_t content_bytes(std::span<const Raster> rasters) {
        std::uint64_t bytes = 0;
        for (const Raster &raster : rasters) {
            const TileGrid &grid = raster.directory.grid;
            bytes += content_of(raster).size() + std::uint64_t{grid.width(0)} * grid.height(0) * grid.channels();
        }
        return bytes;
    }

    // Memory for the largest raster, with all mip levels.
    static std::uint64_t decoded_bytes(std::span<const Raster> rasters) {
        std::uint64_t bytes = 0;
        for (const Raster &raster : rasters)
            bytes = std::max(bytes, raster.directory.grid.texel_bytes() / 4 * 5); // and the means of level 0
        return bytes;
    }

    void check_rasters(std::span<const Raster> rasters, ModelWalk &walk) {
        add_rasters(rasters, walk, [this](const Raster &raster) {
            const SectionEntry &entry = *raster.entry;
            FaultSink faults{.wants = [this](const CatalogueEntry &code) { return count(code, code.kind); },
                             .take = [&](Error error) { report(std::move(error), name(entry), -1); }};
            Image image =
                check_raster({stored(entry), entry.offset, raster.directory}, options_.threads, deep(), faults);
            is_incomplete_ |= faults.count > 0;
            if (entry.type == SectionType::ground_lit)
                lit_ground_[entry.instance] =
                    std::any_of(image.texels.begin(), image.texels.end(), [](std::uint8_t lit) { return lit != 0; });
            return image;
        });
    }

    // Adds the rasters to the text of content_id, as long as all is there. `read(raster)` returns mip level 0.
    template <class Read> void add_rasters(std::span<const Raster> rasters, ModelWalk &walk, const Read &read) {
        std::uint64_t at = walk.raster_place();
        for (const Raster &raster : rasters) {
            const Image image = read(raster);
            if (is_incomplete_)
                continue;
            const Bytes head = content_of(raster);
            walk.content().add(at, head);
            walk.content().add(at + head.size(), image.texels);
            at += head.size() + image.texels.size();
        }
    }

    void report_chunks(ModelWalk &walk) {
        for (int level = 1; level <= header().depth; ++level)
            for (const ModelWalk::Refusal &refusal : walk.refused(level))
                if (count(*refusal.entry, refusal.entry->kind))
                    tell_of_chunk(walk.explain(level, refusal.chunk), *refusal.entry, refusal.chunk,
                                  file_.directories[static_cast<std::size_t>(level)].chunks[refusal.chunk].offset);
        is_incomplete_ |= !walk.complete();
        report_.chunks = walk.chunks();
        report_.points = walk.points();
    }

    // An error ends the walk of the fields, which goes level by level.
    void report_fields(const ModelWalk &walk, const Status &directories) {
        if (!walk.refused_fields().empty()) {
            is_incomplete_ = true;
            const auto level = static_cast<std::uint32_t>(walk.level_of_refused_fields());
            for (const ModelWalk::FieldRefusal &refusal : walk.refused_fields())
                fault(refusal.error, name(*find(SectionType::field_values, level)),
                      static_cast<std::int64_t>(refusal.chunk));
        } else if (!directories) {
            is_incomplete_ = true;
            const SectionEntry &entry =
                *find(SectionType::field_directory, static_cast<std::uint32_t>(file_.field_directories.size()));
            if (!is_changed(entry))
                fault(directories.error(), name(entry));
        }
    }

    // Checks rules of the whole model: split into chunks, content_id, averages.
    void check_whole(ModelWalk &walk, std::span<const Raster> rasters) {
        check_split(walk.split());
        if (is_incomplete_ || !changed_.empty()) // the content is not as written
            return;
        while (walk.run_again())
            add_rasters(rasters, walk, [this](const Raster &raster) {
                Result<Image> image =
                    decode_level(stored(*raster.entry), raster.entry->offset, raster.directory, 0, options_.threads);
                return image ? std::move(image).value() : Image(); // another process has changed the bytes
            });
        if (const Status status = check_content_id(header(), walk.content().finish()); !status)
            fault(status.error(), "header");
        if (const SectionEntry *const fields = find(SectionType::fields))
            if (const Status status = check_fields_id(file_.fields, walk.fields_id(), fields->offset); !status)
                fault(status.error(), name(*fields));
        if (advises() && !found_fault_)
            advise(walk);
        if (deep())
            report_averages(walk.wrong_averages());
    }

    void check_split(const std::vector<std::vector<ChunkShape>> &shapes) {
        for (std::size_t level = 1; level < shapes.size(); ++level) {
            const SectionEntry &entry = *find(SectionType::level_directory, static_cast<std::uint32_t>(level));
            const auto &chunks = file_.directories[level].chunks;
            const auto differ = std::mismatch(shapes[level].begin(), shapes[level].end(), chunks.begin(), chunks.end(),
                                              [](const ChunkShape &a, const ChunkEntry &b) { return a == b.shape; });
            if (differ.first == shapes[level].end() && differ.second == chunks.end())
                continue;
            const auto index = differ.second - chunks.begin();
            fault(wrong_split(entry.offset +
                                  static_cast<std::uint64_t>(index) * chunk_entry_bytes(parameters().attributes),
                              differ.first == shapes[level].end() ? nullptr : &*differ.first,
                              differ.second == chunks.end() ? nullptr : &differ.second->shape),
                  name(entry), index);
            is_incomplete_ = true;
        }
    }

    void report_averages(const WrongAverages &wrong) {
        const auto depth = static_cast<std::uint32_t>(header().depth);
        for (std::uint32_t level = 0; level < depth; ++level)
            for (const auto &of_field : wrong.fields[level])
                if (of_field)
                    fault(of_field->error,
                          name(level == 0 ? *find(SectionType::fields) : *find(SectionType::field_values, level)));
        for (std::uint32_t level = 0; level < depth; ++level) {
            if (!wrong.points[level])
                continue;
            std::int64_t chunk = -1;
            for (const ChunkEntry &candidate : file_.directories[level].chunks)
                chunk += candidate.first_point <= wrong.points[level]->point ? 1 : 0;
            fault(wrong.points[level]->error, level == 0 ? "header" : name(*find(SectionType::level_chunks, level)),
                  chunk);
        }
    }

    void advise(const ModelWalk &walk) {
        for (const Advice &item : advise_on_parameters(file_.sections, parameters(), walk.used(), lit_ground_))
            fault(item.what, name_at(item.what.offset));
        std::vector<LooseCone> cones = walk.loose_cones();
        std::sort(cones.begin(), cones.end(), [](const LooseCone &a, const LooseCone &b) {
            return std::pair(a.level, a.chunk) < std::pair(b.level, b.chunk);
        });
        for (const LooseCone &cone : cones) {
            const Advice item = advise_on_cone(file_.sections, parameters().attributes, cone);
            fault(item.what, name_at(item.what.offset), item.chunk);
        }
    }

    // Name of the last section that starts at or before `offset`.
    std::string name_at(std::uint64_t offset) const {
        const auto after =
            std::upper_bound(file_.sections.begin(), file_.sections.end(), offset,
                             [](std::uint64_t at, const SectionEntry &entry) { return at < entry.offset; });
        return name(*(after - 1));
    }

    const FileHeader &header() const { return file_.header; }
    const ModelParameters &parameters() const { return file_.parameters; }

    OpenedFile file_;
    const ValidateOptions &options_;
    const bool stops_;
    ValidationReport report_;
    std::vector<const SectionEntry *> changed_; // their hashes do not match
    bool found_fault_ = false;                  // of severity error
    bool is_incomplete_ = false;                // part of the model could not be read
    bool root_is_wrong_ = false;
    std::array<bool, kMaxLights> lit_ground_{};
};

} // namespace

ValidationReport walk_file(ByteView file, const ValidateOptions &options, AfterError after_error) {
    return FileWalk(file, options, after_error).run();
}

} // namespace pbm
