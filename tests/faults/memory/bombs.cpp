// Decompression bombs: small files that announce huge data, decode to huge data, or have very many faults. Every hash
// is right. The reader must count before it allocates, and must report few findings.
#include "allocation_meter.h"
#include "campaign.h"
#include "file_parts.h"
#include "goldens.h"
#include "judge.h"

#include "pbm_format/container/section_encoder.h"
#include "pbm_format/rasters/image_section.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "unit/support/file_editor.h"
#include "unit/support/value_of.h"

#include <algorithm>
#include <cstring>
#include <ctime>
#include <limits>

#include <unistd.h>

namespace pbm::faults {
namespace {

constexpr std::uint64_t kMaxMemory = std::uint64_t{32} << 20;

struct Bomb {
    std::string name;
    Bytes file;
};

void append(Bytes &to, std::uint64_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i)
        to.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}

// A zstd frame of blocks that repeat one byte. RFC 8878
Bytes frame(std::uint64_t announced, std::uint64_t produced, bool single_segment = true, std::uint8_t byte = 0xFF) {
    constexpr std::uint64_t kMaxOfBlock = std::uint64_t{128} << 10;
    Bytes bytes{0x28, 0xB5, 0x2F, 0xFD, static_cast<std::uint8_t>(single_segment ? 0xE0 : 0xC0)};
    if (!single_segment)
        bytes.push_back(0xF8); // a window of 2 TB
    append(bytes, announced, 8);
    do {
        const std::uint64_t size = std::min(produced, kMaxOfBlock);
        produced -= size;
        append(bytes, (produced == 0 ? 1U : 0U) | 1U << 1 | size << 3, 3);
        bytes.push_back(byte);
    } while (produced > 0);
    return bytes;
}

// `planes` copies of the plane behind their size fields.
Bytes as_planes(const Bytes &plane, std::size_t planes) {
    Bytes bytes;
    for (std::size_t i = 0; i < planes; ++i)
        append(bytes, plane.size() | std::uint64_t{1} << 31, 4);
    for (std::size_t i = 0; i < planes; ++i)
        bytes.insert(bytes.end(), plane.begin(), plane.end());
    return bytes;
}

struct Frame {
    std::string name;
    Bytes bytes;
};

// Bad frames for a stream, plane or tile of raw size `raw`. Each has at most `most` bytes.
std::vector<Frame> bad_frames(std::uint64_t raw, std::uint64_t most) {
    const std::uint64_t blocks = std::min<std::uint64_t>((most - 20) / 4, 4000);
    return {{"announces a terabyte", frame(std::uint64_t{1} << 40, raw)},
            {"announces all that 64 bits hold", frame(~std::uint64_t{0}, raw)},
            {"becomes more than it announces", frame(raw, blocks << 17)},
            {"becomes less than it announces", frame(raw, raw / 2)},
            {"has a window of 2 TB", frame(raw, raw, false)}};
}
constexpr std::uint64_t kMinRaw = 120; // raw size that planes with the longest of these frames need

void add_streams(const Golden &golden, std::vector<Bomb> &bombs) {
    Reader reader = value_of(Reader::open(golden.bytes));
    const AttributeSet &set = reader.parameters().attributes;
    const StreamList streams = streams_of(set);
    const int level = reader.depth();
    const ChunkShape shape = value_of(reader.directory(level))->chunks[0].shape;
    for (std::size_t s = 0; s < streams.size(); ++s) {
        const std::uint64_t raw = raw_stream_bytes(streams[s], set, level, shape.nodes, shape.points);
        const Filter filter = filter_of(streams[s], set);
        const std::string name = golden.name + ", " + std::string(to_string(streams[s].kind)) + ": ";
        if (raw < kMinRaw)
            continue;
        for (const Frame &bad : bad_frames(raw, raw - 1)) {
            FileParts file(golden.bytes);
            replace_stream(file, level, 0, s, bad.bytes, kZstdCoding);
            bombs.push_back({name + "a frame that " + bad.name, file.assemble()});
        }
        for (const Frame &bad : bad_frames(shape.points, raw / plane_count(filter) - 8)) {
            FileParts file(golden.bytes);
            replace_stream(file, level, 0, s, as_planes(bad.bytes, plane_count(filter)),
                           static_cast<std::uint32_t>(filter));
            bombs.push_back({name + "a plane that " + bad.name, file.assemble()});
        }
    }
}

void add_tiles(const Golden &golden, std::vector<Bomb> &bombs) {
    constexpr std::size_t kChannels = 3;
    const FileParts whole(golden.bytes);
    const Reader reader = value_of(Reader::open(golden.bytes));
    const SectionEntry *section = reader.section(SectionType::panorama);
    if (section == nullptr)
        return;
    const ImageDirectory directory = value_of(read_image_directory(golden.bytes, *section, Storage::packed));
    const std::size_t tile = directory.tiles.size() - 1;
    const std::uint64_t raw = directory.grid.tile_bytes(0);
    for (const Frame &bad : bad_frames(raw, raw - 1)) {
        FileParts file = whole;
        replace_tile(file, SectionType::panorama, tile, bad.bytes, kZstdCoding);
        bombs.push_back({golden.name + ": a tile that " + bad.name, file.assemble()});
    }
    for (const Frame &bad : bad_frames(raw / kChannels, raw / kChannels - 8)) {
        FileParts file = whole;
        replace_tile(file, SectionType::panorama, tile, as_planes(bad.bytes, kChannels),
                     static_cast<std::uint32_t>(Filter::texels));
        bombs.push_back({golden.name + ": a plane of a tile that " + bad.name, file.assemble()});
    }
}

// Nodes above level `crowded` have eight children, all others one. Chunks have up to 8^5 points. Roots of the
// finest level are three levels up if depth > crowded. Levels up to `honest` decode.
struct Lattice {
    int depth, crowded, honest;

    std::uint32_t nodes(int level) const { return std::uint32_t{1} << 3 * std::clamp(level, 0, crowded); }
    int root(int level) const { return level - (level == depth && level > crowded ? 3 : std::min(level, 5)); }
};

// Shape of chunk `i` of a level.
ChunkShape shape_of(const Lattice &grid, int level, std::uint32_t i) {
    const int root = grid.root(level);
    const auto below_root = [&](int l) { return grid.nodes(l) / grid.nodes(root); };
    return {.root_depth = static_cast<std::uint8_t>(root),
            .root_prefix = i,
            .points = below_root(level),
            .nodes = below_root(level - 1),
            .parents = level >= 2 ? below_root(level - 2) : 0,
            .bricks = below_root(std::max(level - 3, root)),
            .parent_chunk = level >= 2 ? i / (grid.nodes(root) / grid.nodes(grid.root(level - 1))) : 0};
}

// A file whose counts agree with each other. Levels beyond `honest` have frames that do not decode, or masks that
// announce other points.
Bytes lattice(const Golden &golden, const Lattice &grid) {
    FileParts file(golden.bytes);
    std::erase_if(file.sections, [](const auto &s) { return s.entry.type >= SectionType::level_directory; });
    const AttributeSet set; // normals and radii
    for (int level = 1; level <= grid.depth; ++level) {
        LevelDirectory directory{.level = level, .chunks = {}, .points = 0, .nodes = 0};
        Bytes stored;
        std::uint64_t raw_bytes = 0;
        for (std::uint32_t i = 0; i < grid.nodes(grid.root(level)); ++i) {
            ChunkEntry chunk;
            chunk.shape = shape_of(grid, level, i);
            chunk.cone.cosine = kNoCone;
            for (const StreamInfo &stream : streams_of(set)) {
                const std::uint64_t raw = raw_stream_bytes(stream, set, level, chunk.shape.nodes, chunk.shape.points);
                const bool honest = level <= grid.honest, masks = stream.kind == StreamKind::masks;
                const std::uint8_t byte = !honest ? 0xFF : !masks ? 0 : level > grid.crowded ? 1 : 0xFF;
                const Bytes coded = honest ? frame(raw, raw, true, byte) : Bytes(4);
                const bool zstd = coded.size() < raw;
                const Bytes plain(raw, byte);
                const Bytes &bytes = zstd ? coded : plain;
                chunk.streams.push_back(
                    {.stored_bytes = static_cast<std::uint32_t>(bytes.size()), .filter = Filter::none, .zstd = zstd});
                stored.insert(stored.end(), bytes.begin(), bytes.end());
                raw_bytes += raw;
            }
            directory.points += chunk.shape.points;
            directory.chunks.push_back(std::move(chunk));
        }
        const auto instance = static_cast<std::uint32_t>(level);
        file.sections.push_back({{.type = SectionType::level_directory,
                                  .instance = instance,
                                  .element_bytes = static_cast<std::uint32_t>(chunk_entry_bytes(set))},
                                 encode_directory(directory, set)});
        file.sections.push_back({{.type = SectionType::level_chunks,
                                  .codec = Codec::zstd_chunks,
                                  .instance = instance,
                                  .element_bytes = 0,
                                  .raw_bytes = raw_bytes,
                                  .count = directory.points},
                                 std::move(stored)});
    }
    file.header.chunk_points = kDefaultChunkPoints;
    file.header.depth = static_cast<std::uint8_t>(grid.depth);
    file.header.point_count = grid.nodes(grid.depth);
    return file.assemble();
}

// A panorama of 400 MB of which no tile decodes.
Bytes large_raster(const Golden &golden) {
    constexpr std::uint32_t kWidth = 16384, kHeight = kWidth / 2, kTile = 4; // stored bytes per tile
    const TileGrid grid(kWidth, kHeight, 3);
    FileParts file(golden.bytes);
    FileParts::Section &section = file.section(SectionType::panorama);
    Bytes bytes;
    append(bytes, 0, 8);
    append(bytes, kWidth, 4);
    append(bytes, kHeight, 4);
    append(bytes, grid.tiles(), 4);
    append(bytes, 1, 2);
    append(bytes, 3, 1);
    bytes.resize(image_directory_bytes(grid), 0);
    for (std::size_t tile = 0; tile < grid.tiles(); ++tile) {
        const std::uint32_t entry = kTile | kZstdCoding << 24;
        std::memcpy(bytes.data() + 32 + 16 * tile + 8, &entry, sizeof entry);
    }
    section.entry.raw_bytes = bytes.size() + grid.texel_bytes();
    section.entry.count = grid.tiles();
    bytes.resize(bytes.size() + kTile * grid.tiles(), 0);
    section.bytes = std::move(bytes);
    return file.assemble();
}

// Sets one count at a time to the largest value of its field.
void add_counts(const Golden &golden, std::vector<Bomb> &bombs) {
    test::FileEditor at(golden.bytes);
    const std::size_t chunks = at.entry(SectionType::level_chunks, 1), directory = at.chunk(1);
    const std::pair<const char *, std::pair<std::size_t, std::size_t>> fields[] = {
        {"sections", {32, 4}},
        {"points", {56, 4}},
        {"raw bytes", {64, 8}},
        {"stored bytes", {chunks + 32, 8}},
        {"raw bytes of chunks", {chunks + 40, 8}},
        {"points of chunks", {chunks + 48, 8}},
        {"points of a chunk", {directory + 16, 4}},
        {"nodes of a chunk", {directory + 20, 4}},
        {"bricks of a chunk", {directory + 28, 4}}};
    for (const auto &[name, place] : fields) {
        test::FileEditor editor(golden.bytes);
        for (std::size_t byte = 0; byte < place.second; ++byte)
            editor.set(place.first + byte, std::uint8_t{0xFF});
        editor.repair();
        bombs.push_back({golden.name + ": as many " + name + " as the field holds", editor.bytes()});
    }
}

double processor_milliseconds() {
    timespec now{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

// The minimum of three runs, least disturbed by other programs.
template <class Work> double least_time(const Work &work) {
    double least = std::numeric_limits<double>::infinity();
    for (int run = 0; run < 3; ++run) {
        const double begin = processor_milliseconds();
        static_cast<void>(work());
        least = std::min(least, processor_milliseconds() - begin);
    }
    return least;
}

// Expects `work` to fail within `max_memory` bytes, and notes the processor time that it takes; with ErrorCode::memory
// if `memory_wanted`.
template <class Work>
void refuse(const std::string &story, Tally &tally, bool memory_wanted, std::uint64_t max_memory, const Work &work) {
    reset_peak();
    const std::uint64_t before = heap_use().live;
    const Status status = work();
    const std::uint64_t most = heap_use().peak - before;
    const double ms = least_time(work);
    tally.add_case();
    if (tally.require(!status.ok(), story + ": taken"))
        tally.add_detected();
    tally.require(status.ok() || !memory_wanted || status.error().code == ErrorCode::memory,
                  story + ": " + (status ? "" : status.error().message));
    tally.require(most < max_memory, story + ": took " + std::to_string(most >> 20) + " MiB");
    tally.note_largest("ms", ms);
    tally.note_largest("MiB", static_cast<double>(most) / (1 << 20));
}

} // namespace

void send_bombs(const Options &options, Tally &tally) {
    std::vector<Bomb> bombs, honest, honest_points;
    for (const Golden &golden : goldens(options.complete ? 64 << 10 : 16 << 10)) {
        add_counts(golden, bombs);
        if (decode_header(golden.bytes)->storage() == Storage::mapped)
            continue;
        add_streams(golden, bombs);
        add_tiles(golden, bombs);
        if (golden.name == "smallest") {
            bombs.push_back({"134 million points", lattice(golden, {.depth = 9, .crowded = 9, .honest = 0})});
            bombs.push_back({"4,096 bad chunks", lattice(golden, {.depth = 7, .crowded = 4, .honest = 6})});
            if (options.complete) // takes longest
                bombs.push_back({"32,768 bad chunks", lattice(golden, {.depth = 8, .crowded = 5, .honest = 7})});
            honest_points.push_back(
                {"17 million points that are there", lattice(golden, {.depth = 8, .crowded = 8, .honest = 8})});
        }
        if (golden.name == "shaded-tiny") {
            bombs.push_back({"a panorama of 400 MB", large_raster(golden)});
            honest.push_back({"a panorama of 400 MB", large_raster(golden)});
        }
    }
    for (const Bomb &bomb : bombs) {
        ::alarm(30);
        refuse(bomb.name + ", validate", tally, false, kMaxMemory, [&]() -> Status {
            const ValidationReport report = validate(bomb.file, {.threads = 1});
            return report.valid() ? Status() : Error{report.findings[0].code, 0, report.findings[0].message};
        });
        refuse(bomb.name + ", verify", tally, false, kMaxMemory, [&] { return verify(bomb.file, {.threads = 1}); });
        tally.note_largest("KB of file", static_cast<double>(bomb.file.size()) / 1000);
    }
    // Small files may decode to huge models: the memory limit must refuse them before allocation. A check of points
    // alone needs a few chunks at a time: it ends with its verdict.
    constexpr std::uint64_t kBudget = std::uint64_t{16} << 20;
    const auto verify_with_budget = [&](const Bomb &bomb, bool memory_wanted) {
        refuse(bomb.name + ", verify with a budget", tally, memory_wanted, kBudget + kBudget / 4,
               [&] { return verify(bomb.file, {.threads = 1, .max_memory = kBudget}); });
    };
    for (const Bomb &bomb : honest)
        verify_with_budget(bomb, true);
    for (const Bomb &bomb : honest_points)
        verify_with_budget(bomb, false);
    honest.insert(honest.end(), honest_points.begin(), honest_points.end());
    for (const Bomb &bomb : honest)
        refuse(bomb.name + ", load_model with a budget", tally, true, kMaxMemory, [&]() -> Status {
            Reader reader = value_of(Reader::open(bomb.file));
            const Result<Model> model = load_model(reader, {.threads = 1, .max_memory = kBudget, .fields = true});
            return model ? Status() : Status(model.error());
        });
    ::alarm(0);
}

} // namespace pbm::faults
