#include "goldens.h"

#include "pbm_format/reading/point_stream_reader.h"
#include "unit/support/value_of.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace pbm::faults {
namespace {

void sort(std::vector<Golden> &files) {
    std::sort(files.begin(), files.end(), [](const Golden &a, const Golden &b) {
        return std::pair(a.bytes.size(), a.name) < std::pair(b.bytes.size(), b.name);
    });
}

std::vector<Golden> files_in(const std::string &folder, std::size_t max_bytes) {
    std::vector<Golden> files;
    for (const auto &entry : std::filesystem::directory_iterator(PBM_SOURCE_DIR "/format_spec/" + folder)) {
        if (entry.path().extension() != ".pbvg" || entry.file_size() > max_bytes)
            continue;
        std::ifstream in(entry.path(), std::ios::binary);
        files.push_back({entry.path().stem().string(), Bytes(std::istreambuf_iterator<char>(in), {})});
    }
    sort(files);
    return files;
}

void add_chunks(Reader &reader, const SectionEntry &section, std::vector<Region> &regions) {
    const auto level = static_cast<int>(section.instance);
    const std::vector<ChunkEntry> &chunks = (*value_of(reader.directory(level))).chunks;
    const bool bricks = section.type == SectionType::level_bricks;
    for (std::size_t i = 0; i < chunks.size(); ++i) {
        const ChunkEntry &chunk = chunks[i];
        const std::uint64_t begin = bricks ? section.offset + chunk.first_brick * kBrickRecordBytes : chunk.offset;
        const std::uint64_t size = bricks ? chunk.shape.bricks * std::uint64_t{kBrickRecordBytes} : chunk.stored_bytes;
        regions.push_back({.part = bricks ? Part::bricks : Part::chunk,
                           .begin = begin,
                           .end = begin + size,
                           .section = &section,
                           .level = level,
                           .index = i});
    }
}

// What a point stream says of a chunk is refused alone.
void add_stream_values(Reader &reader, const SectionEntry &section, std::vector<Region> &regions) {
    const auto level = static_cast<int>(section.instance % kStreamKinds);
    PointStreamReader stream(reader, PointStream{section.instance / kStreamKinds});
    const LevelDirectory &directory = *value_of(reader.directory(level));
    for (const PointStreamEntry &entry : value_of(stream.directory(directory)))
        if (entry.stored_bytes > 0)
            regions.push_back({.part = Part::section,
                               .begin = entry.offset,
                               .end = entry.offset + entry.stored_bytes,
                               .section = &section});
}

void add_raster(Reader &reader, const SectionEntry &section, ByteView file, std::vector<Region> &regions) {
    const ImageDirectory directory = value_of(read_image_directory(file, section, reader.header().storage()));
    const std::uint64_t head = section.offset + image_directory_bytes(directory.grid);
    regions.push_back({.part = Part::raster_head, .begin = section.offset, .end = head, .section = &section});
    for (std::size_t i = 0; i < directory.tiles.size(); ++i) {
        const std::uint64_t begin = section.offset + directory.tiles[i].offset;
        if (begin > regions.back().end) // padding within the section
            regions.push_back({.part = Part::padding, .begin = regions.back().end, .end = begin, .section = &section});
        regions.push_back({.part = Part::tile,
                           .begin = begin,
                           .end = begin + directory.tiles[i].stream.stored_bytes,
                           .section = &section,
                           .index = i});
    }
    const std::uint64_t end = section.offset + section.stored_bytes;
    if (end > regions.back().end)
        regions.push_back({.part = Part::padding, .begin = regions.back().end, .end = end, .section = &section});
}

} // namespace

std::vector<Golden> goldens(std::size_t max_bytes) { return files_in("vectors/valid", max_bytes); }

std::vector<Golden> goldens_and_scans(std::size_t max_bytes) {
    std::vector<Golden> files = goldens(max_bytes);
    for (const auto &version : std::filesystem::directory_iterator(PBM_SOURCE_DIR "/format_spec/golden"))
        if (version.is_directory())
            for (Golden &golden : files_in("golden/" + version.path().filename().string(), max_bytes))
                if (std::none_of(files.begin(), files.end(), [&](const Golden &f) { return f.bytes == golden.bytes; }))
                    files.push_back(std::move(golden));
    sort(files);
    return files;
}

std::vector<Golden> broken_vectors() { return files_in("vectors/invalid", ~std::size_t{0}); }

std::vector<Region> regions_of(Reader &reader, ByteView file) {
    std::vector<Region> regions{{.part = Part::header, .begin = 0, .end = kHeaderBytes},
                                {.part = Part::table,
                                 .begin = kHeaderBytes,
                                 .end = kHeaderBytes + reader.sections().size() * kSectionEntryBytes}};
    for (const SectionEntry &section : reader.sections()) {
        if (section.offset > regions.back().end)
            regions.push_back({.part = Part::padding, .begin = regions.back().end, .end = section.offset});
        const std::size_t first = regions.size();
        const std::uint64_t end = section.offset + section.stored_bytes;
        if (section.type == SectionType::level_chunks || section.type == SectionType::level_bricks)
            add_chunks(reader, section, regions);
        else if (section.type == SectionType::stream_values && is_known_stream(section.instance))
            add_stream_values(reader, section, regions);
        else if (is_raster(section.type))
            add_raster(reader, section, file, regions);
        else if (section.stored_bytes > 0)
            regions.push_back({.part = Part::section, .begin = section.offset, .end = end, .section = &section});
        for (std::size_t i = first; i < regions.size(); ++i) {
            regions[i].section_begin = section.offset;
            regions[i].section_end = end;
        }
    }
    for (Region &region : regions)
        if (region.section == nullptr) {
            region.section_begin = region.begin;
            region.section_end = region.end;
        }
    return regions;
}

std::string describe(const Region &region) {
    const std::string place = " at " + std::to_string(region.begin);
    switch (region.part) {
    case Part::header: return "header";
    case Part::table: return "table";
    case Part::padding: return "padding" + place;
    case Part::section: return std::string(to_string(region.section->type)) + place;
    case Part::chunk: return "level " + std::to_string(region.level) + " chunk " + std::to_string(region.index);
    case Part::bricks: return "level " + std::to_string(region.level) + " bricks " + std::to_string(region.index);
    case Part::raster_head: return "head of the raster" + place;
    case Part::tile: break;
    }
    return "tile " + std::to_string(region.index) + place;
}

} // namespace pbm::faults
