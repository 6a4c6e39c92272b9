#include "pbm_format/rasters/tiled_image.h"

#include "pbm_format/rasters/image_section.h"

#include <atomic>
#include <mutex>
#include <new>
#include <optional>
#include <set>
#include <utility>

namespace pbm {

namespace {

// Where tiles point that cannot be had.
constexpr std::uint8_t kDamaged = 0;

} // namespace

TileGrid::TileGrid(std::uint32_t width, std::uint32_t height, std::uint32_t channels)
    : width_(width), height_(height), channels_(channels), levels_(mip_levels(height)) {
    assert(is_storable(width, height, channels));
    for (int level = levels_ - 1; level >= 0; --level) {
        first_tile_[static_cast<std::size_t>(level)] = tiles_;
        tiles_ += std::size_t{tiles_across(level)} * tiles_down(level);
    }
}

int TileGrid::level_of(std::size_t tile) const {
    int level = 0;
    while (first_tile(level) > tile)
        ++level;
    return level;
}

std::uint64_t TileGrid::texel_bytes() const {
    std::uint64_t bytes = 0;
    for (int level = 0; level < levels_; ++level)
        bytes += std::uint64_t{width(level)} * height(level) * channels_;
    return bytes;
}

struct TiledImage::State {
    explicit State(TileGrid of) : grid(of), tiles(std::make_unique<Slot[]>(of.tiles())) {}
    State(const State &) = delete;
    State &operator=(const State &) = delete;
    ~State() {
        for (std::size_t i = 0; i < grid.tiles(); ++i)
            if (owns_tiles && tiles[i].load(std::memory_order_relaxed) != &kDamaged)
                delete[] tiles[i].load(std::memory_order_relaxed);
    }

    using Slot = std::atomic<const std::uint8_t *>; // null: not asked for yet

    const std::uint8_t *read_tile(std::size_t number);
    const std::uint8_t *keep(std::size_t number, const std::uint8_t *texels);
    const std::uint8_t *refuse(std::size_t number, Error error);
    FileRange range_of(std::size_t number) const {
        return {section.offset + directory.tiles[number].offset, directory.tiles[number].stream.stored_bytes};
    }

    TileGrid grid;
    std::unique_ptr<Slot[]> tiles;
    bool owns_tiles = false;        // each is an allocation of its own
    Bytes memory;                   // else: texels of a raster in memory
    std::optional<ByteSource> file; // or of a file
    FileRange section;
    std::uint64_t offset = 0; // of the section, for errors
    ImageDirectory directory;
    std::atomic<std::uint64_t> tiles_read{0}, stored_bytes{0}, memory_bytes{0};
    std::mutex mutex; // of both:
    std::vector<Error> errors;
    std::set<std::size_t> wanted; // tiles
};

// The first of several threads that read the same tile wins; what the others read is the same.
const std::uint8_t *TiledImage::State::keep(std::size_t number, const std::uint8_t *texels) {
    const std::uint8_t *expected = nullptr;
    if (!tiles[number].compare_exchange_strong(expected, texels, std::memory_order_acq_rel)) {
        if (owns_tiles)
            delete[] texels;
        return expected;
    }
    ++tiles_read;
    stored_bytes += directory.tiles[number].stream.stored_bytes;
    if (owns_tiles)
        memory_bytes += grid.tile_bytes(grid.level_of(number));
    return texels;
}

const std::uint8_t *TiledImage::State::refuse(std::size_t number, Error error) {
    const std::uint8_t *expected = nullptr;
    if (!tiles[number].compare_exchange_strong(expected, &kDamaged, std::memory_order_acq_rel))
        return expected;
    const std::lock_guard lock(mutex);
    errors.push_back(std::move(error));
    return &kDamaged;
}

// Null if it is not there yet.
const std::uint8_t *TiledImage::State::read_tile(std::size_t number) try {
    const FileRange range = range_of(number);
    const std::optional<HeldBytes> stored = file->view(range);
    if (!stored) {
        if (const std::uint8_t *const kept =
                tiles[number].load(std::memory_order_acquire)) // by another thread meanwhile
            return kept;
        const std::lock_guard lock(mutex);
        wanted.insert(number);
        return nullptr;
    }
    if (!owns_tiles) {
        Status status = verify_tile_hash(stored->bytes, offset, directory, number);
        return status ? keep(number, stored->bytes.data()) : refuse(number, std::move(status).error());
    }
    const std::size_t bytes = grid.tile_bytes(grid.level_of(number));
    auto texels = std::make_unique_for_overwrite<std::uint8_t[]>(bytes);
    Status status = decode_tile(stored->bytes, offset, directory, number, {texels.get(), bytes});
    const std::uint8_t *const kept =
        status ? keep(number, texels.release()) : refuse(number, std::move(status).error());
    file->drop(range);
    return kept;
} catch (const std::bad_alloc &) {
    return refuse(number, out_of_memory());
}

TiledImage::TiledImage(std::unique_ptr<State> state) : state_(std::move(state)) {}
TiledImage::TiledImage(TiledImage &&) noexcept = default;
TiledImage &TiledImage::operator=(TiledImage &&) noexcept = default;
TiledImage::~TiledImage() = default;

TiledImage TiledImage::of(const Image &image) {
    auto state = std::make_unique<State>(TileGrid(image.width, image.height, image.channels));
    const TileGrid &grid = state->grid;
    state->memory.reserve(static_cast<std::size_t>(grid.texel_bytes()));
    Image coarser;
    for (int level = 0; level < grid.levels(); ++level) {
        if (level > 0)
            coarser = halved(level == 1 ? image : coarser);
        for (std::uint32_t ty = 0; ty < grid.tiles_down(level); ++ty)
            for (std::uint32_t tx = 0; tx < grid.tiles_across(level); ++tx) {
                const Bytes texels = cut_tile(grid, level, level == 0 ? image : coarser, tx, ty);
                state->tiles[grid.tile_number(level, tx, ty)] = state->memory.data() + state->memory.size();
                state->memory.insert(state->memory.end(), texels.begin(), texels.end());
            }
    }
    state->memory_bytes = state->memory.size();
    return TiledImage(std::move(state));
}

Result<TiledImage> TiledImage::open(ByteView section, std::uint64_t offset_in_file) {
    Result<ImageDirectory> directory = decode_image_directory(section, offset_in_file);
    if (!directory)
        return std::move(directory).error();
    TiledImage image = open(ByteSource(section), {0, section.size()}, std::move(directory).value());
    image.state_->offset = offset_in_file;
    return image;
}

TiledImage TiledImage::open(ByteSource file, FileRange section, ImageDirectory directory) {
    auto state = std::make_unique<State>(directory.grid);
    state->owns_tiles = directory.storage == Storage::packed || !file.is_whole();
    state->file = std::move(file);
    state->section = section;
    state->offset = section.offset;
    state->stored_bytes = image_directory_bytes(directory.grid);
    state->memory_bytes = directory.tiles.size() * (sizeof(TileEntry) + sizeof(State::Slot));
    state->directory = std::move(directory);
    return TiledImage(std::move(state));
}

const TileGrid &TiledImage::grid() const { return state_->grid; }

const std::uint8_t *TiledImage::tile(int level, std::uint32_t tx, std::uint32_t ty) const {
    assert(level >= 0 && level < levels() && tx < grid().tiles_across(level) && ty < grid().tiles_down(level));
    const std::size_t number = grid().tile_number(level, tx, ty);
    const std::uint8_t *texels = state_->tiles[number].load(std::memory_order_acquire);
    if (texels == nullptr)
        texels = state_->read_tile(number);
    return texels == &kDamaged ? nullptr : texels;
}

const std::uint8_t *TiledImage::texel(int level, std::uint32_t x, std::uint32_t y) const {
    const std::uint8_t *texels = tile(level, x / kTileEdge, y / kTileEdge);
    const std::size_t at = std::size_t{y % kTileEdge} * grid().tile_width(level) + x % kTileEdge;
    return texels == nullptr ? nullptr : texels + at * channels();
}

Result<Image> TiledImage::level_image(int level, int threads) const {
    if (state_->file) { // past the tiles that are kept: whoever copies a level wants no second copy of it
        const Result<HeldBytes> section = state_->file->require(state_->section);
        if (!section)
            return section.error();
        return decode_level(section->bytes, state_->offset, state_->directory, level, threads);
    }
    Image image{.width = width(level), .height = height(level), .channels = channels(), .texels = {}};
    image.texels.resize(std::size_t{image.width} * image.height * image.channels);
    const std::size_t first = grid().first_tile(level);
    for (std::size_t i = 0; i < std::size_t{grid().tiles_across(level)} * grid().tiles_down(level); ++i)
        place_tile(grid(), level, i, state_->tiles[first + i].load(std::memory_order_relaxed), image);
    return image;
}

std::vector<Error> TiledImage::take_errors() const {
    const std::lock_guard lock(state_->mutex);
    return std::exchange(state_->errors, {});
}

std::vector<FileRange> TiledImage::take_wanted() const {
    const std::lock_guard lock(state_->mutex);
    std::vector<FileRange> ranges;
    for (const std::size_t number : std::exchange(state_->wanted, {}))
        if (const FileRange range = state_->range_of(number); !state_->file->has(range))
            ranges.push_back(range);
    return ranges;
}

TiledImage::Statistics TiledImage::statistics() const {
    return {.tiles = state_->tiles_read, .stored_bytes = state_->stored_bytes, .memory_bytes = state_->memory_bytes};
}

TiledImages TiledImages::of(const ModelImages &images) {
    const auto tiled = [](const Image &image) {
        return image.empty() ? nullptr : std::make_shared<const TiledImage>(TiledImage::of(image));
    };
    TiledImages all{
        .panorama = tiled(images.panorama), .ground_texture = tiled(images.ground_texture), .ground_lit = {}};
    for (const Image &lit : images.ground_lit)
        all.ground_lit.push_back(tiled(lit));
    return all;
}

} // namespace pbm
