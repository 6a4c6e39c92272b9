#include "pbm_format/reading/reader.h"

#include "pbm_format/container/file_rules.h"
#include "pbm_format/law/catalogue.h"
#include "system/threads/parallel.h"
#include "system/threads/per_thread.h"

#include <algorithm>
#include <atomic>
#include <new>
#include <optional>

namespace pbm {

namespace {

Error at_section(Error error, const SectionEntry &section) {
    error.offset += section.offset;
    return error;
}

// Decodes a small section into `to` after proving its hash.
template <class T, class Decode>
Status read_section(ByteView file, const SectionEntry &section, T &to, Decode &&decode) {
    if (Status status = prove_hash(file, section); !status)
        return status;
    const ByteView bytes = file.subspan(section.offset, section.stored_bytes);
    auto decoded = decode(bytes);
    if (!decoded)
        return at_section(std::move(decoded).error(), section);
    to = std::move(decoded).value();
    return {};
}

Status prove_metadata(ByteView file, const SectionEntry &section) {
    if (Status status = prove_hash(file, section); !status)
        return status;
    Status status = check_metadata(file.subspan(section.offset, section.stored_bytes));
    return status ? status : Status(at_section(std::move(status).error(), section));
}

} // namespace

const SectionEntry *Reader::section(SectionType type, std::uint32_t instance) const {
    return find_section(sections_, type, instance);
}

Result<Reader> Reader::open(ByteView file) try {
    Reader reader(file);
    Result<FileHeader> header = decode_header(file);
    if (!header)
        return std::move(header).error();
    reader.header_ = *header;
    Result<std::vector<SectionEntry>> sections = decode_section_table(file, reader.header_);
    if (!sections)
        return std::move(sections).error();
    reader.sections_ = std::move(sections).value();

    const int depth = reader.depth();
    ModelParameters &parameters = reader.parameters_;
    Status status = read_section(file, *reader.section(SectionType::grid), parameters.grid,
                                 [&](ByteView bytes) { return decode_grid(bytes, depth); });
    if (status)
        status = prove_metadata(file, *reader.section(SectionType::metadata));
    if (status)
        status = read_section(file, *reader.section(SectionType::attributes), parameters.attributes,
                              [&](ByteView bytes) { return decode_attributes(bytes, depth); });
    if (status)
        status = read_section(file, *reader.section(SectionType::materials), parameters.materials, decode_materials);
    if (const SectionEntry *lights = reader.section(SectionType::lights); status && lights != nullptr)
        status = read_section(file, *lights, parameters.lights, decode_lights);
    if (const SectionEntry *texture = reader.section(SectionType::texture); status && texture != nullptr)
        status = read_section(file, *texture, parameters.texture.emplace_back(), decode_texture);
    if (const SectionEntry *ground = reader.section(SectionType::ground_plane); status && ground != nullptr)
        status = read_section(file, *ground, parameters.ground, decode_ground_plane);
    if (status) {
        status = check_parameters(parameters);
        if (status)
            status = check_rasters(parameters, reader.sections_);
        if (!status)
            status.error().offset += reader.section(SectionType::attributes)->offset;
    }
    if (status)
        status = check_root(reader.header_.root, parameters);
    if (status)
        status = check_point_count(reader.header_,
                                   *reader.section(SectionType::level_chunks, static_cast<std::uint32_t>(depth)));
    if (!status)
        return std::move(status).error();
    reader.directories_.resize(static_cast<std::size_t>(depth) + 1);
    reader.proven_.resize(static_cast<std::size_t>(depth) + 1);
    return reader;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

std::string_view Reader::metadata() const {
    const SectionEntry &entry = *section(SectionType::metadata);
    return {reinterpret_cast<const char *>(file_.data()) + entry.offset, entry.stored_bytes};
}

Result<const LevelDirectory *> Reader::directory(int level) try {
    assert(level >= 1 && level <= depth());
    for (int next = 1; next <= level; ++next) {
        const auto at = static_cast<std::size_t>(next);
        if (is_read(next))
            continue;
        const SectionEntry &entry = *section(SectionType::level_directory, static_cast<std::uint32_t>(next));
        const LevelDirectory *above = next == 1 ? nullptr : &directories_[at - 1];
        LevelDirectory read;
        const Status status = read_section(file_, entry, read, [&](ByteView bytes) {
            return decode_directory(bytes, next, parameters_.attributes, header_.chunk_points, above,
                                    *section(SectionType::level_chunks, static_cast<std::uint32_t>(next)));
        });
        if (!status)
            return status.error();
        if (const Status counted = check_chunk_count(read, entry, sections_); !counted)
            return counted.error();
        ProvenChunks proven;
        if (header_.storage() == Storage::mapped) {
            const SectionEntry &bricks = *section(SectionType::level_bricks, static_cast<std::uint32_t>(next));
            if (const Status counted = check_brick_count(read, bricks); !counted)
                return counted.error();
            proven = std::make_unique<std::atomic<bool>[]>(read.chunks.size());
        }
        directories_[at] = std::move(read);
        proven_[at] = std::move(proven);
    }
    return &directories_[static_cast<std::size_t>(level)];
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Chunk Reader::root_chunk() const { return {.masks = {}, .points = root_points(header_.root, parameters_.attributes)}; }

Status Reader::load_chunk(int level, std::size_t index, const Chunk &parent, Chunk &to) const try {
    assert(is_read(level) && &parent != &to);
    const LevelDirectory &directory = directories_[static_cast<std::size_t>(level)];
    assert(index < directory.chunks.size());
    const ChunkEntry &entry = directory.chunks[index];
    if (header_.storage() == Storage::mapped) {
        const Result<ChunkView> view = view_chunk(level, index);
        if (!view)
            return view.error();
        copy_chunk(*view, parameters_.attributes, level, to);
        return {};
    }
    std::uint64_t first_mask = 0, first_point = 0;
    if (level > 1) {
        const ChunkEntry &above = directories_[static_cast<std::size_t>(level) - 1].chunks[entry.shape.parent_chunk];
        first_mask = above.first_node;
        first_point = above.first_point;
    }
    const ParentNodes parents =
        parent_nodes(entry, parent.masks, first_mask, parent.points, first_point, parameters_.attributes);
    return decode_chunk(entry, stored(entry), chunk_rules(level), parents, to);
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Result<ChunkView> Reader::view_chunk(int level, std::size_t index) const try {
    assert(header_.storage() == Storage::mapped);
    assert(is_read(level));
    // Up to the first ancestor that is proven, and down again.
    std::array<std::size_t, kMaxDepth + 1> path{};
    int proven = level;
    path[static_cast<std::size_t>(level)] = index;
    for (; proven > 0; --proven) {
        const auto at = static_cast<std::size_t>(proven);
        if (proven_[at][path[at]].load(std::memory_order_acquire))
            break;
        path[at - 1] = directories_[at].chunks[path[at]].shape.parent_chunk;
    }
    for (int next = proven + 1; next <= level; ++next)
        if (Status status = prove_chunk_at(next, path[static_cast<std::size_t>(next)]); !status)
            return std::move(status).error();
    const ChunkEntry &entry = directories_[static_cast<std::size_t>(level)].chunks[index];
    return pbm::view_chunk(entry, file_, *section(SectionType::level_bricks, static_cast<std::uint32_t>(level)),
                           parameters_.attributes, level);
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

// Its parent chunk is proven.
Status Reader::prove_chunk_at(int level, std::size_t index) const {
    const auto at = static_cast<std::size_t>(level);
    const auto bricks = [&](int of) { return section(SectionType::level_bricks, static_cast<std::uint32_t>(of)); };
    const ChunkEntry &entry = directories_[at].chunks[index];
    BrickParents parents;
    if (level > 1) {
        const ChunkEntry &above = directories_[at - 1].chunks[entry.shape.parent_chunk];
        const ChunkView view = pbm::view_chunk(above, file_, *bricks(level - 1), parameters_.attributes, level - 1);
        parents = brick_parents(entry, above, view.bricks, view.masks);
    }
    Status status = prove_chunk(entry, file_, *bricks(level), chunk_rules(level), parents);
    if (status)
        proven_[at][index].store(true, std::memory_order_release);
    return status;
}

std::vector<const SectionEntry *> Reader::rasters() const {
    std::vector<const SectionEntry *> rasters;
    for (const SectionEntry &entry : sections_)
        if (is_raster(entry.type))
            rasters.push_back(&entry);
    return rasters;
}

Result<TiledImages> Reader::images() const try {
    TiledImages images;
    for (const SectionEntry *entry : rasters()) {
        Result<ImageDirectory> directory = read_image_directory(file_, *entry, header_.storage());
        if (!directory)
            return std::move(directory).error();
        auto image = std::make_shared<const TiledImage>(
            TiledImage::open(file_.subspan(entry->offset, entry->stored_bytes), entry->offset, std::move(*directory)));
        if (entry->type == SectionType::panorama)
            images.panorama = std::move(image);
        else if (entry->type == SectionType::ground_texture)
            images.ground_texture = std::move(image);
        else
            images.ground_lit.push_back(std::move(image));
    }
    return images;
} catch (const std::bad_alloc &) {
    return out_of_memory();
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

namespace {

// Decodes all chunks of a level into `model`, which has the level above.
Status load_level(const Reader &reader, const LevelDirectory &directory, int threads, Model &model) {
    const AttributeSet &set = model.parameters.attributes;
    const Level &above = model.levels[static_cast<std::size_t>(directory.level) - 1];
    Level &level = model.levels[static_cast<std::size_t>(directory.level)];
    level.masks.resize(directory.nodes);
    level.points.resize(directory.points, set);
    const bool mapped = reader.header().storage() == Storage::mapped;
    const auto load = [&](const ChunkEntry &entry, std::size_t index, Chunk &to) -> Status {
        if (mapped) // lies in the file as a whole
            return reader.load_chunk(directory.level, index, {}, to);
        const ParentNodes parents = parent_nodes(entry, above.masks, 0, above.points, 0, set);
        return decode_chunk(entry, reader.stored(entry), reader.chunk_rules(directory.level), parents, to);
    };
    std::vector<std::optional<Error>> failures(directory.chunks.size());
    std::atomic<bool> failed{false};
    parallel_for(failures.size(), threads, [&](std::size_t i) {
        if (failed)
            return;
        Chunk &chunk = per_thread<Chunk>();
        const ChunkEntry &entry = directory.chunks[i];
        const Status status = load(entry, i, chunk);
        if (status) {
            place_chunk(chunk, entry, set, level);
        } else {
            failures[i] = status.error();
            failed = true;
        }
    });
    for (std::optional<Error> &failure : failures)
        if (failure)
            return std::move(*failure);
    return {};
}

// Level 0 of all rasters.
Status load_images(const TiledImages &images, int threads, ModelImages &to) {
    Status status;
    const auto load = [&](const std::shared_ptr<const TiledImage> &image, Image &into) {
        if (!status || image == nullptr)
            return;
        Result<Image> level = image->level_image(0, threads);
        if (level)
            into = std::move(level).value();
        else
            status = std::move(level).error();
    };
    load(images.ground_texture, to.ground_texture);
    to.ground_lit.resize(images.ground_lit.size());
    for (std::size_t light = 0; light < images.ground_lit.size(); ++light)
        load(images.ground_lit[light], to.ground_lit[light]);
    load(images.panorama, to.panorama);
    return status;
}

} // namespace

std::uint64_t decoded_bytes(const TiledImages &images) {
    std::uint64_t bytes = 0;
    const auto add = [&](const std::shared_ptr<const TiledImage> &image) {
        bytes += image == nullptr ? 0 : image->grid().texel_bytes();
    };
    add(images.panorama);
    add(images.ground_texture);
    for (const auto &lit : images.ground_lit)
        add(lit);
    return bytes;
}

Image &next_raster(SectionType type, ModelImages &images) {
    return type == SectionType::panorama         ? images.panorama
           : type == SectionType::ground_texture ? images.ground_texture
                                                 : images.ground_lit.emplace_back();
}

namespace {

// The model without its rasters, for which `of_rasters` bytes of the memory are kept.
Result<Model> load_levels(Reader &reader, const LoadOptions &options, std::uint64_t of_rasters) {
    const AttributeSet &set = reader.parameters().attributes;
    const int last = std::min(options.max_level, reader.depth());
    std::uint64_t memory = of_rasters;
    std::vector<const LevelDirectory *> directories{nullptr};
    for (int level = 1; level <= last; ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        directories.push_back(*directory);
        memory += decoded_bytes(**directory, set);
    }
    if (memory > options.max_memory)
        return broken("system.memory", 0,
                      "the model needs " + std::to_string(memory >> 20) + " MiB of memory, more than allowed (" +
                          std::to_string(options.max_memory >> 20) + " MiB): draw a coarser level or allow more",
                      options.max_memory, memory);
    Model model;
    model.parameters = reader.parameters();
    model.metadata = reader.metadata();
    model.levels.resize(static_cast<std::size_t>(last) + 1);
    model.levels[0].points = root_points(reader.header().root, set);

    // Level by level, since chunks need their parents.
    for (int level = 1; level <= last; ++level)
        if (Status status = load_level(reader, *directories[static_cast<std::size_t>(level)], options.threads, model);
            !status)
            return std::move(status).error();
    return model;
}

} // namespace

Result<Model> load_model(Reader &reader, const LoadOptions &options) try {
    const Result<TiledImages> images = reader.images();
    if (!images)
        return images.error();
    Result<Model> model = load_levels(reader, options, decoded_bytes(*images));
    if (!model)
        return model;
    if (Status status = load_images(*images, options.threads, model->images); !status)
        return std::move(status).error();
    return model;
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Status Reader::verify_stored() const try {
    std::uint64_t end = kHeaderBytes + sections_.size() * kSectionEntryBytes;
    for (const SectionEntry &entry : sections_) {
        if (Status status = check_padding(file_, end, entry.offset); !status)
            return status;
        end = entry.offset + entry.stored_bytes;
        if (Status status = prove_hash(file_, entry); !status)
            return status;
    }
    return {};
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

Status Reader::verify_all(int threads, std::uint64_t max_memory) try {
    if (Status status = verify_stored(); !status) // padding, and the sections that nothing else proves
        return status;
    // Before anything is decoded for good: of rasters, no more is in memory than four times what was there already.
    std::vector<ImageDirectory> directories;
    std::uint64_t of_rasters = 0;
    for (const SectionEntry *entry : rasters()) {
        Result<ImageDirectory> directory = read_image_directory(file_, *entry, header_.storage());
        if (!directory)
            return std::move(directory).error();
        of_rasters += directory->grid.texel_bytes();
        directories.push_back(std::move(directory).value());
    }
    if (of_rasters > max_memory)
        return broken("system.memory", 0, "the rasters need more memory than allowed", max_memory, of_rasters);
    ModelImages images;
    for (std::size_t i = 0; i < directories.size(); ++i) {
        const SectionEntry &entry = *rasters()[i];
        Status status;
        prove_image(file_.subspan(entry.offset, entry.stored_bytes), entry.offset, directories[i], threads,
                    first_fault(status), next_raster(entry.type, images));
        if (!status)
            return status;
    }
    Result<Model> loaded =
        load_levels(*this, {.max_level = depth(), .threads = threads, .max_memory = max_memory}, of_rasters);
    if (!loaded)
        return std::move(loaded).error();
    loaded->images = std::move(images);
    Model &model = *loaded;

    LevelMasks masks;
    for (const Level &level : model.levels)
        masks.push_back(level.masks);
    const std::vector<std::vector<ChunkShape>> expected = split_into_chunks(masks, header_.chunk_points);
    for (int level = 1; level <= depth(); ++level) {
        const LevelDirectory &directory = directories_[static_cast<std::size_t>(level)];
        const auto &shapes = expected[static_cast<std::size_t>(level)];
        const SectionEntry &entry = *section(SectionType::level_directory, static_cast<std::uint32_t>(level));
        for (std::size_t i = 0; i < std::max(shapes.size(), directory.chunks.size()); ++i)
            if (i >= shapes.size() || i >= directory.chunks.size() || shapes[i] != directory.chunks[i].shape)
                return wrong_split(entry.offset + i * chunk_entry_bytes(parameters_.attributes),
                                   i < shapes.size() ? &shapes[i] : nullptr,
                                   i < directory.chunks.size() ? &directory.chunks[i].shape : nullptr);
    }
    if (Status status = check_content_id(header_, content_id(model, expected, header_.chunk_points)); !status)
        return status;

    std::vector<PointAttributes> stored(static_cast<std::size_t>(depth()));
    for (std::size_t level = 0; level < stored.size(); ++level)
        stored[level] = std::move(model.levels[level].points);
    average_levels(model, threads);
    for (std::size_t level = 0; level < stored.size(); ++level)
        if (stored[level] != model.levels[level].points)
            return wrong_averages(
                level == 0 ? 88 : section(SectionType::level_chunks, static_cast<std::uint32_t>(level))->offset, level,
                find_wrong_average(stored[level], model.levels[level].points, parameters_.attributes));
    return {};
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

} // namespace pbm
