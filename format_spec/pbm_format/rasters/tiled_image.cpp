#include "pbm_format/rasters/tiled_image.h"

#include <atomic>
#include <mutex>
#include <new>
#include <utility>

namespace pbm {

namespace {

// Where tiles point that cannot be had.
constexpr std::uint8_t kDamaged = 0;

} // namespace

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

    TileGrid grid;
    std::unique_ptr<Slot[]> tiles;
    bool owns_tiles = false; // each is an allocation of its own
    Bytes memory;            // else: texels of a raster in memory
    ByteView section;        // of a file
    std::uint64_t offset = 0;
    ImageDirectory directory;
    std::atomic<std::uint64_t> tiles_read{0}, stored_bytes{0}, memory_bytes{0};
    std::mutex errors_mutex;
    std::vector<Error> errors;
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
    const std::lock_guard lock(errors_mutex);
    errors.push_back(std::move(error));
    return &kDamaged;
}

const std::uint8_t *TiledImage::State::read_tile(std::size_t number) try {
    if (directory.storage == Storage::mapped) {
        Status status = prove_tile_hash(section, offset, directory, number);
        return status ? keep(number, section.data() + directory.tiles[number].offset)
                      : refuse(number, std::move(status).error());
    }
    const std::size_t bytes = grid.tile_bytes(grid.level_of(number));
    auto texels = std::make_unique_for_overwrite<std::uint8_t[]>(bytes);
    Status status = decode_tile(section, offset, directory, number, {texels.get(), bytes});
    return status ? keep(number, texels.release()) : refuse(number, std::move(status).error());
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
    state->memory.reserve(grid.texel_bytes());
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
    return open(section, offset_in_file, std::move(directory).value());
}

TiledImage TiledImage::open(ByteView section, std::uint64_t offset_in_file, ImageDirectory directory) {
    auto state = std::make_unique<State>(directory.grid);
    state->owns_tiles = directory.storage == Storage::packed;
    state->section = section;
    state->offset = offset_in_file;
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
    if (!state_->section.empty()) // past the tiles that are kept: whoever copies a level wants no second copy of it
        return decode_level(state_->section, state_->offset, state_->directory, level, threads);
    Image image{.width = width(level), .height = height(level), .channels = channels(), .texels = {}};
    image.texels.resize(std::size_t{image.width} * image.height * image.channels);
    const std::size_t first = grid().first_tile(level);
    for (std::size_t i = 0; i < std::size_t{grid().tiles_across(level)} * grid().tiles_down(level); ++i)
        place_tile(grid(), level, i, state_->tiles[first + i].load(std::memory_order_relaxed), image);
    return image;
}

std::vector<Error> TiledImage::take_errors() const {
    const std::lock_guard lock(state_->errors_mutex);
    return std::exchange(state_->errors, {});
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
