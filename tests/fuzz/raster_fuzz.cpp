// Law: for any bytes of a raster's section with repaired hashes, each tile is decoded or refused, TiledImage and
// check_raster agree on each, and encode_image and decoding reproduce a valid raster.
#include "pbm_format/checking/raster_rules.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/writing/raster_encoder.h"

#include <cstdlib>
#include <cstring>

namespace {

template <class T> T get(const pbm::Bytes &bytes, std::size_t at) {
    T value{};
    std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
}

void set_hash(pbm::Bytes &section, std::size_t at, std::uint64_t first, std::uint64_t size) {
    if (first > section.size() || size > section.size() - first)
        return;
    const std::uint64_t hash = pbm::hash64(pbm::ByteView(section).subspan(first, size));
    std::memcpy(section.data() + at, &hash, sizeof(hash));
}

void repair(pbm::Bytes &section) {
    if (section.size() < 32)
        return;
    const std::uint64_t directory = 32 + 16 * std::uint64_t{get<std::uint32_t>(section, 16)};
    if (directory > section.size())
        return;
    const bool mapped = get<std::uint16_t>(section, 20) == pbm::kMappedStreamAlignment;
    std::uint64_t end = directory;
    for (std::size_t tile = 32; tile < directory; tile += 16) {
        end = mapped ? pbm::align_stream(end) : end;
        const std::uint64_t stored = get<std::uint32_t>(section, tile + 8) & 0xFFFFFF;
        set_hash(section, tile, end, stored);
        end += stored;
    }
    set_hash(section, 0, 8, directory - 8);
}

void check(bool holds) {
    if (!holds)
        std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    pbm::Bytes section(data, data + size);
    repair(section);
    const pbm::Result<pbm::TiledImage> image = pbm::TiledImage::open(section, 0);
    const pbm::Result<pbm::ImageDirectory> directory = pbm::decode_image_directory(section, 0);
    check(image.ok() == directory.ok());
    if (!image)
        return 0;
    std::size_t refused = 0;
    for (int level = 0; level < image->levels(); ++level)
        for (std::uint32_t ty = 0; ty < image->grid().tiles_down(level); ++ty)
            for (std::uint32_t tx = 0; tx < image->grid().tiles_across(level); ++tx)
                refused += image->tile(level, tx, ty) == nullptr ? 1 : 0;
    check(image->take_errors().size() == refused);
    std::vector<pbm::Error> faults;
    pbm::FaultSink sink{.wants = [](const pbm::CatalogueEntry &) { return true; },
                        .take = [&](pbm::Error error) { faults.push_back(std::move(error)); }};
    const pbm::Image level_0 = pbm::check_raster({section, 0, *directory}, 1, true, sink);
    check(sink.count == faults.size());
    check(faults.size() >= refused);
    if (!faults.empty())
        return 0;
    const pbm::Bytes again = pbm::encode_image(level_0, directory->storage, 1, 1);
    check(pbm::TiledImage::open(again, 0)->level_image(0).value() == level_0);
    return 0;
}
