#include "pbm_render/detail/streamed_model.h"

#include <algorithm>
#include <cassert>
#include <new>
#include <utility>

namespace pbm {
namespace {

// Header, table and small sections: what Reader::open has read.
std::uint64_t opening_bytes(const Reader &reader) {
    std::uint64_t bytes = kHeaderBytes + reader.sections().size() * kSectionEntryBytes;
    for (const SectionEntry &section : reader.sections())
        if (section.type < SectionType::level_directory)
            bytes += section.stored_bytes;
    return bytes;
}

} // namespace

StreamedModel::StreamedModel(Reader reader, StreamingOptions options)
    : reader_(std::move(reader)), loader_(reader_), cache_(options.max_memory), finest_(reader_.depth()),
      directory_bytes_read_(opening_bytes(reader_)),
      scheduler_(loader_, cache_, mutex_, options.threads, std::move(options.arrived)) {}

Status StreamedModel::read_directory(int level) {
    assert(level == cache_.known_levels() + 1); // only this thread changes it
    const Result<const LevelDirectory *> read = reader_.directory(level);
    const std::lock_guard lock(mutex_);
    if (!read) {
        finest_ = level - 1;
        return read.error();
    }
    directory_bytes_read_ +=
        reader_.section(SectionType::level_directory, static_cast<std::uint32_t>(level))->stored_bytes;
    cache_.add_level(**read);
    return {};
}

Result<Sphere> StreamedModel::bounds() try {
    const int level = std::min(kBoundsLevel, reader_.depth());
    while (cache_.known_levels() < level)
        if (Status status = read_directory(cache_.known_levels() + 1); !status)
            return std::move(status).error();
    std::vector<MissingChunk> all;
    for (int next = 1; next <= level; ++next)
        for (std::uint32_t i = 0; i < cache_.levels()[static_cast<std::size_t>(next)].chunks.size(); ++i)
            all.push_back({.place = {next, i}});
    {
        const std::lock_guard lock(mutex_);
        cache_.begin_view();
        for (const MissingChunk &chunk : all)
            cache_.use(chunk.place);
    }
    if (Status status = scheduler_.load_all(all); !status)
        return std::move(status).error();

    const std::lock_guard lock(mutex_);
    std::vector<Bytes> masks(static_cast<std::size_t>(level) + 1);
    for (const MissingChunk &chunk : all) {
        const ResidentPointer &resident = cache_.chunk(chunk.place);
        if (resident == nullptr)
            return Error{ErrorCode::bad_content, 0, "a coarse level is damaged"};
        Bytes &of_level = masks[static_cast<std::size_t>(chunk.place.level)];
        of_level.insert(of_level.end(), resident->view.masks.begin(), resident->view.masks.end());
    }
    return bounding_sphere(reader_.parameters().grid, std::vector<ByteView>(masks.begin(), masks.end()), level);
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

DetailSelection StreamedModel::select(const DetailView &view) const {
    DetailView possible = view;
    possible.finest = std::min(view.finest, finest_);
    return select_detail(reader_.parameters().grid, reader_.header().root.radius, cache_.levels(), possible);
}

Detail StreamedModel::choose(const DetailView &view) {
    std::unique_lock lock(mutex_);
    DetailSelection selection = select(view);
    while (selection.needs_directory && cache_.known_levels() < finest_) {
        lock.unlock();
        Status status = read_directory(cache_.known_levels() + 1);
        lock.lock();
        if (!status)
            scheduler_.add_error(std::move(status).error());
        selection = select(view);
    }
    cache_.begin_view();
    Detail detail{.runs = std::move(selection.runs), .missing = std::move(selection.missing), .chunks = {}};
    detail.chunks.reserve(selection.present.size());
    for (const ChunkPlace place : selection.present) {
        cache_.use(place);
        detail.chunks.push_back(cache_.chunk(place));
    }
    return detail;
}

Result<Detail> StreamedModel::load(const DetailView &view) try {
    // Where chunks lie is known exactly when those above them are resident: the loop loads no others. One level after
    // the other costs next to nothing, since a chunk is decoded after the one that it nests in.
    while (true) {
        Detail detail = choose(view);
        {
            const std::lock_guard lock(mutex_);
            std::erase_if(detail.missing, [&](const MissingChunk &chunk) { return !cache_.has_parent(chunk.place); });
        }
        const bool complete = detail.missing.empty();
        if (Status status = scheduler_.load_all(std::move(detail.missing)); !status) // a directory may be damaged, too
            return std::move(status).error();
        if (complete)
            return detail;
    }
} catch (const std::bad_alloc &) {
    return out_of_memory();
}

std::vector<Error> StreamedModel::take_errors() {
    const std::lock_guard lock(mutex_);
    return scheduler_.take_errors();
}

StreamingStatistics StreamedModel::statistics() const {
    const std::lock_guard lock(mutex_);
    return {.bytes_read = directory_bytes_read_ + scheduler_.bytes_read(),
            .points_decoded = scheduler_.points_decoded(),
            .memory = cache_.memory()};
}

} // namespace pbm
