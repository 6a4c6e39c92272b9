#include "pbm_format/chunks/stream_rules.h"
#include "pbm_format/law/catalogue.h"
#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/reading/point_stream_reader.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <atomic>
#include <new>
#include <optional>

namespace pbm {

namespace {

// Decodes all chunks of a level into `model`, which has the level above.
Status load_level(const Reader &reader, const LevelDirectory &directory, int threads, Model &model) {
    const AttributeSet &set = model.parameters.attributes;
    const Level &above = model.levels[static_cast<std::size_t>(directory.level) - 1];
    Level &level = model.levels[static_cast<std::size_t>(directory.level)];
    // Fits: load_levels has compared it with the memory allowed.
    level.masks.resize(static_cast<std::size_t>(directory.nodes));
    level.points.resize(static_cast<std::size_t>(directory.points), set);
    return for_chunks(reader, directory, above, threads, 0, [&](std::size_t i, const Chunk &chunk) {
        place_chunk(chunk, directory.chunks[i], set, level);
        return Status();
    });
}

} // namespace

Status for_chunks(const Reader &reader, const LevelDirectory &directory, const Level &above, int threads,
                  unsigned left_out, const std::function<Status(std::size_t, const Chunk &)> &visit) {
    const bool mapped = reader.header().storage() == Storage::mapped;
    const auto load = [&](const ChunkEntry &entry, std::size_t index, Chunk &to) -> Status {
        if (mapped) // lies in the file as a whole
            return reader.load_chunk(directory.level, index, {}, to);
        const Result<HeldBytes> stored = reader.source().require(chunk_range(entry));
        if (!stored)
            return stored.error();
        const ChunkNodes nodes = chunk_nodes(entry, above.masks, 0, above.points, 0, reader.parameters().attributes);
        ChunkRules rules = reader.chunk_rules(directory.level);
        rules.left_out = left_out;
        return decode_chunk(entry, stored->bytes, rules, nodes, to);
    };
    std::vector<std::optional<Error>> failures(directory.chunks.size());
    std::atomic<bool> failed{false};
    parallel_for(failures.size(), threads, [&](std::size_t i) {
        if (failed)
            return;
        Chunk &chunk = per_thread<Chunk>();
        Status status = load(directory.chunks[i], i, chunk);
        if (status)
            status = visit(i, chunk);
        if (!status) {
            failures[i] = status.error();
            failed = true;
        }
    });
    for (std::optional<Error> &failure : failures)
        if (failure)
            return std::move(*failure);
    return {};
}

Result<Model> load_levels(Reader &reader, const LoadOptions &options, std::uint64_t other_bytes) try {
    const AttributeSet &set = reader.parameters().attributes;
    const int last = std::min(options.max_level, reader.depth());
    std::uint64_t memory = other_bytes;
    std::vector<const LevelDirectory *> directories{nullptr};
    for (int level = 1; level <= last; ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        directories.push_back(*directory);
        memory += decoded_bytes(**directory, set);
    }
    if (memory > addressable(options.max_memory))
        return broken("system.memory", 0,
                      "the model needs " + std::to_string(memory >> 20) + " MiB of memory, more than allowed (" +
                          std::to_string(options.max_memory >> 20) + " MiB): draw a coarser level or allow more",
                      options.max_memory, memory);
    Model model;
    model.parameters = reader.parameters();
    model.parameters.fields.clear();
    model.metadata = reader.metadata();
    model.levels.resize(static_cast<std::size_t>(last) + 1);
    model.levels[0].points = root_points(reader.header().root, set);

    // Level by level, since chunks need their parents.
    for (int level = 1; level <= last; ++level)
        if (Status status = load_level(reader, *directories[static_cast<std::size_t>(level)], options.threads, model);
            !status)
            return std::move(status).error();
    return model;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Result<Model> load_points(Reader &reader, const LoadOptions &options, std::uint64_t other_bytes) try {
    for (int level = 1; level <= std::min(options.max_level, reader.depth()); ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        for (const PointStream kind : kPointStreams)
            if (const SectionEntry *const values = reader.section(SectionType::stream_values, instance_of(kind, level)))
                // A number and a byte for each offset, twice while the list grows.
                other_bytes += (kind == PointStream::offsets ? 10 : 2) * values->raw_bytes;
        for (std::size_t f = 0; options.fields && f < reader.parameters().fields.size(); ++f)
            other_bytes += (*directory)->points * reader.parameters().fields[f].bytes;
    }
    Result<Model> model = load_levels(reader, options, other_bytes);
    if (!model)
        return model;
    if (options.fields) {
        model->parameters.fields = reader.parameters().fields;
        if (Status status = load_fields(reader, options.threads, *model); !status)
            return std::move(status).error();
    }
    if (Status status = load_point_streams(reader, *model); !status)
        return std::move(status).error();
    return model;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

} // namespace pbm
