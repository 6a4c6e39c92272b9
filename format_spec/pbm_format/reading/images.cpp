#include "pbm_format/rasters/image_section.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/reader.h"

#include <memory>
#include <new>

namespace pbm {

std::vector<const SectionEntry *> rasters(const Reader &reader) {
    std::vector<const SectionEntry *> rasters;
    for (const SectionEntry &entry : reader.sections())
        if (is_raster(entry.type))
            rasters.push_back(&entry);
    return rasters;
}

std::vector<FileRange> raster_ranges(const Reader &reader) {
    std::vector<FileRange> ranges;
    for (const SectionEntry *entry : rasters(reader))
        ranges.push_back(image_directory_range(*entry));
    return ranges;
}

Result<TiledImages> read_images(const Reader &reader) try {
    TiledImages images;
    for (const SectionEntry *entry : rasters(reader)) {
        Result<ImageDirectory> directory = read_image_directory(reader.source(), *entry, reader.header().storage());
        if (!directory)
            return std::move(directory).error();
        auto image = std::make_shared<const TiledImage>(
            TiledImage::open(reader.source(), entry->range(), std::move(*directory)));
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

} // namespace pbm
