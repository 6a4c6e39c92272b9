// Encodes pictures as bytes of image files; replace_file() writes them.
#pragma once

#include "pbm_render/picture/framebuffer.h"
#include "system/bytes.h"
#include "system/error.h"

#include <memory>

namespace pbm {

// PNG, 8 bits per channel, sRGB; RGB if every pixel is opaque, else RGBA with straight alpha. For speed, rows are
// filtered by the row above and compressed in bands of a fixed size, one chunk each; so the bytes do not depend on the
// number of threads (0: one per processor). The only user of ISA-L.
// Based on: PNG Specification (Third Edition), W3C 2025; RFC 1950, RFC 1951
//
// errors  memory  the deflate library fails
Result<Bytes> encode_png(const Framebuffer &picture, int threads = 1);

// Adds to a PNG of encode_png how many pixels of it make a metre.
void set_png_density(std::uint32_t pixels_per_metre, Bytes &file);

// The same band by band, so that bands can be encoded while other rows are still drawn.
class PngBands {
  public:
    // `picture` must outlive this. `opaque`: whether every pixel is going to be. `threads` threads call `encode`.
    PngBands(const Framebuffer &picture, bool opaque, int threads);
    ~PngBands();
    PngBands(const PngBands &) = delete;
    PngBands &operator=(const PngBands &) = delete;

    std::size_t count() const;
    // A band needs all rows of the picture before this one.
    int end_row(std::size_t band) const;
    // Called once per band; the calls of one `thread` follow each other.
    void encode(std::size_t band, std::size_t thread);
    // The file, once all bands are encoded. errors  as encode_png
    Result<Bytes> finish();

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

// BMP, the format of the dissertation's program. Uncompressed, bottom row first: 24 bits per pixel if all are opaque,
// else 32 with straight alpha (BITMAPV4HEADER).
//
// errors  memory  larger than the format's limit of 4 GiB
Result<Bytes> encode_bmp(const Framebuffer &picture);

// PFM (portable float map) of the depths: one channel, little-endian, bottom row first, +infinity where empty.
Bytes encode_depth_pfm(const Framebuffer &picture);

// Whether every pixel is opaque.
bool is_opaque(const Framebuffer &picture);

} // namespace pbm
