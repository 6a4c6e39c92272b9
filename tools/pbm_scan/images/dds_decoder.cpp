#include "pbm_scan/images/dds_decoder.h"

#include "pbm_scan/surface/refusal.h"

#include <squish.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

namespace pbm::build {
namespace {

constexpr std::size_t kDdsHeader = 128, kDdsHeader10 = 20; // the second one follows where the code is "DX10"

struct BlockCode {
    std::string_view name;                // of four characters
    std::array<std::uint32_t, 2> numbers; // of DXGI_FORMAT, in a header of DirectX 10
    int squish;                           // 0: not read
    std::string_view compression;
};
constexpr std::array kBlockCodes{BlockCode{"DXT1", {71, 72}, squish::kDxt1, "BC1"},
                                 BlockCode{"DXT2", {74, 75}, squish::kDxt3, "BC2"},
                                 BlockCode{"DXT3", {74, 75}, squish::kDxt3, "BC2"},
                                 BlockCode{"DXT4", {77, 78}, squish::kDxt5, "BC3"},
                                 BlockCode{"DXT5", {77, 78}, squish::kDxt5, "BC3"},
                                 BlockCode{"ATI1", {80, 80}, squish::kBc4, "BC4"},
                                 BlockCode{"BC4U", {80, 80}, squish::kBc4, "BC4"},
                                 BlockCode{"ATI2", {83, 83}, squish::kBc5, "BC5"},
                                 BlockCode{"BC5U", {83, 83}, squish::kBc5, "BC5"},
                                 BlockCode{"BC4S", {81, 81}, 0, "BC4 with signs"},
                                 BlockCode{"BC5S", {84, 84}, 0, "BC5 with signs"},
                                 BlockCode{"BC6H", {95, 96}, 0, "BC6H"},
                                 BlockCode{"BC7L", {98, 99}, 0, "BC7"}};

struct DdsImage {
    ImageSize size;
    int squish = 0;
    ByteView blocks; // to the end of the file
};

Result<DdsImage> open_dds(ByteView bytes) {
    if (bytes.size() < kDdsHeader)
        return damaged_image("its header has no end");
    DdsImage image{.size = {load<std::uint32_t>(&bytes[16]), load<std::uint32_t>(&bytes[12])}, .blocks = {}};
    const std::string_view code(reinterpret_cast<const char *>(&bytes[84]), 4);
    const bool has_more = code == "DX10";
    const std::size_t header = kDdsHeader + (has_more ? kDdsHeader10 : 0);
    if (bytes.size() < header)
        return damaged_image("its header has no end");
    const std::uint32_t number = has_more ? load<std::uint32_t>(&bytes[kDdsHeader]) : 0;
    const auto *const known = std::find_if(kBlockCodes.begin(), kBlockCodes.end(), [&](const BlockCode &each) {
        return has_more ? each.numbers[0] == number || each.numbers[1] == number : each.name == code;
    });
    if (known == kBlockCodes.end() || known->squish == 0)
        return unsupported(
            "a DDS image with " +
            (known == kBlockCodes.end() ? "pixels of another kind than BC1 to BC5" : std::string(known->compression)) +
            ", which is not read here; convert it to PNG");
    image.squish = known->squish;
    image.blocks = bytes.subspan(header);
    return image;
}

constexpr std::size_t kBlockEdge = 4;
using BlockPixels = std::array<std::uint8_t, kBlockEdge * kBlockEdge * 4>;

// libsquish decompresses BC1 to BC3. A channel of BC4 and BC5 is packed as the opacity of BC3.
void decode_block(const std::uint8_t *block, int squish, BlockPixels &to) {
    if (squish != squish::kBc4 && squish != squish::kBc5) {
        squish::Decompress(to.data(), block, squish);
        return;
    }
    constexpr std::size_t kChannelBytes = 8;
    for (std::size_t channel = 0; channel < 3; ++channel) {
        std::array<std::uint8_t, 2 * kChannelBytes> packed{};
        BlockPixels unpacked{};
        const bool is_there = squish == squish::kBc4 || channel < 2;
        if (is_there) {
            std::memcpy(packed.data(), block + (squish == squish::kBc4 ? 0 : kChannelBytes * channel), kChannelBytes);
            squish::Decompress(unpacked.data(), packed.data(), squish::kDxt5);
        }
        for (std::size_t i = 0; i < to.size(); i += 4) {
            to[i + channel] = unpacked[i + 3];
            to[i + 3] = 255;
        }
    }
}

} // namespace

Result<ImageSize> dds_size(ByteView bytes) {
    const Result<DdsImage> image = open_dds(bytes);
    if (!image)
        return image.error();
    return image->size;
}

Status decode_dds(ByteView bytes, std::size_t channels, const RowSink &take) {
    const Result<DdsImage> image = open_dds(bytes);
    if (!image)
        return image.error();
    const std::size_t width = image->size.width, height = image->size.height;
    const std::size_t across = (width + kBlockEdge - 1) / kBlockEdge, down = (height + kBlockEdge - 1) / kBlockEdge;
    const bool is_short = image->squish == squish::kDxt1 || image->squish == squish::kBc4;
    const std::size_t block_bytes = is_short ? 8 : 16;
    if (image->blocks.size() / std::max(across * block_bytes, std::size_t{1}) < down)
        return damaged_image("pixels are missing");
    std::vector<BlockPixels> blocks(across);
    Bytes row(width * channels);
    for (std::size_t y = 0; y < height; ++y) {
        for (std::size_t b = 0; b < across && y % kBlockEdge == 0; ++b)
            decode_block(&image->blocks[(y / kBlockEdge * across + b) * block_bytes], image->squish, blocks[b]);
        for (std::size_t x = 0; x < width; ++x)
            std::memcpy(&row[channels * x], &blocks[x / kBlockEdge][4 * (y % kBlockEdge * kBlockEdge + x % kBlockEdge)],
                        channels);
        take(row);
    }
    return {};
}

} // namespace pbm::build
