#include "viewer/pictures/image_writer.h"

#include "system/threads/parallel.h"
#include "system/threads/thread_pool.h"
#include "viewer/pictures/row_filter.h"

#include <isa-l/crc.h>
#include <isa-l/igzip_lib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <string>
#include <string_view>

namespace pbm {
namespace {

static_assert(std::endian::native == std::endian::little, "pixels lie in memory as R G B A");

constexpr std::uint8_t kSignature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
constexpr std::uint8_t kEightBits = 8, kRgb = 2, kRgba = 6, kPerceptual = 0;
constexpr std::uint8_t kUp = 2;                      // filter type: difference to the row above
constexpr std::uint8_t kZlibHeader[] = {0x78, 0x01}; // deflate, window of 32 KB, fastest level (RFC 1950)
// Start of a band's deflate data: its first byte, which is the filter type of its first row, as an uncompressed block
// (RFC 1951, 3.2.4: type, padding, length, complement of the length).
constexpr std::uint8_t kBandStart[] = {0x00, 0x01, 0x00, 0xFE, 0xFF, kUp};
constexpr std::size_t kStoredBytes = 1;
constexpr std::size_t kLengthBytes = 4, kTypeBytes = 4; // at the start of a chunk
// Approximate bytes of a band: small enough to stay in the cache from filter to compressor and to balance the threads,
// large enough that matches lost at the borders of bands cost little.
constexpr std::size_t kBandBytes = std::size_t{1} << 17;

std::array<std::uint8_t, 4> big_endian(std::uint32_t value) {
    return {static_cast<std::uint8_t>(value >> 24), static_cast<std::uint8_t>(value >> 16),
            static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
}

template <class Range> void append(Bytes &bytes, const Range &more) {
    bytes.insert(bytes.end(), std::begin(more), std::end(more));
}

// Starts a chunk with room for its length; the data are appended next.
void open_chunk(Bytes &chunk, std::string_view type) {
    append(chunk, big_endian(0));
    append(chunk, type);
}

// Ends the chunk that starts at `start`: fills in its length and appends its checksum.
void close_chunk(Bytes &bytes, std::size_t start) {
    std::uint8_t *const chunk = bytes.data() + start;
    const std::size_t checked = bytes.size() - start - kLengthBytes; // type and data
    const auto length = big_endian(static_cast<std::uint32_t>(checked - kTypeBytes));
    std::copy(length.begin(), length.end(), chunk);
    append(bytes, big_endian(crc32_gzip_refl(0, chunk + kLengthBytes, checked)));
}

template <class Range> void append_chunk(Bytes &bytes, std::string_view type, const Range &data) {
    const std::size_t start = bytes.size();
    open_chunk(bytes, type);
    append(bytes, data);
    close_chunk(bytes, start);
}

// How a picture is divided into bands.
struct Bands {
    Bands(const Framebuffer &picture, bool opaque)
        : channels(opaque ? 3 : 4), row_bytes(1 + static_cast<std::size_t>(picture.width) * channels),
          rows(std::max<std::size_t>(1, kBandBytes / row_bytes)), height(static_cast<std::size_t>(picture.height)),
          count((height + rows - 1) / rows) {}

    std::size_t channels;
    std::size_t row_bytes; // filtered, with the filter type in front
    std::size_t rows;      // of a band; the last one may have fewer
    std::size_t height, count;
};

struct EncodedBand {
    Bytes chunk;               // a complete IDAT chunk
    std::uint32_t adler32 = 1; // of the filtered bytes
    std::size_t filtered = 0;  // number of filtered bytes
    bool failed = false;
};

// The Adler-32 checksum of two strings of bytes in a row, from the checksum of each. RFC 1950
std::uint32_t join_adler32(std::uint32_t first, std::uint32_t second, std::size_t second_bytes) {
    constexpr std::uint64_t kBase = 65521;
    const std::uint64_t sum = (first & 0xFFFF) + (second & 0xFFFF) + kBase - 1;
    const std::uint64_t sum_of_sums =
        (first >> 16) + (second >> 16) + second_bytes % kBase * ((first & 0xFFFF) + kBase - 1);
    return static_cast<std::uint32_t>(sum_of_sums % kBase << 16 | sum % kBase);
}

// Encodes bands with the memory of one thread.
class BandEncoder {
  public:
    BandEncoder(const Framebuffer &picture, const Bands &bands)
        : picture_(picture), bands_(bands), above_first_(static_cast<std::size_t>(picture.width)),
          filtered_(bands.rows * bands.row_bytes + 1), level_memory_(ISAL_DEF_LVL1_MEDIUM) {}

    EncodedBand encode(std::size_t band) {
        const std::size_t first = band * bands_.rows, end = std::min(first + bands_.rows, bands_.height);
        for (std::size_t y = first; y < end; ++y)
            filter(y, filtered_.data() + (y - first) * bands_.row_bytes);
        const std::size_t size = (end - first) * bands_.row_bytes;

        EncodedBand result;
        open_chunk(result.chunk, "IDAT");
        if (band == 0)
            append(result.chunk, kZlibHeader);
        append(result.chunk, kBandStart);
        result.failed = !deflate(size, end == bands_.height, result.chunk);
        close_chunk(result.chunk, 0);
        result.adler32 = isal_adler32(1, filtered_.data(), size);
        result.filtered = size;
        return result;
    }

  private:
    // Filters a row. If pixels have three bytes, writes one byte beyond the row.
    void filter(std::size_t y, std::uint8_t *filtered) {
        const std::size_t columns = above_first_.size();
        const std::uint32_t *const pixels = picture_.colour.data() + y * columns;
        const auto *const row = reinterpret_cast<const std::uint8_t *>(pixels);
        const auto *const above =
            reinterpret_cast<const std::uint8_t *>(y == 0 ? above_first_.data() : pixels - columns);
        *filtered++ = kUp;
        if (bands_.channels == 3)
            filter_opaque_row(row, above, columns, filtered);
        else
            for (std::size_t i = 0; i < columns * 4; ++i)
                filtered[i] = static_cast<std::uint8_t>(row[i] - above[i]);
    }

    // Appends the compressed filtered bytes, without those of kBandStart; all bands but the last end with a full flush.
    //
    // The stored byte serves as a dictionary. Without one, ISA-L 2.30 enters the third byte's position in its hash
    // table under a hash of bits 16 to 47 of the stream's own address: the code for the first byte
    // (igzip_icf_body_h1_gr_bt.asm, .write_first_byte) takes a register for data that still holds this address. The
    // compressed bytes, though not their meaning, would then depend on the layout of memory.
    bool deflate(std::size_t size, bool last, Bytes &out) {
        isal_deflate_init(&stream_);
        stream_.level = 1;
        stream_.level_buf = level_memory_.data();
        stream_.level_buf_size = static_cast<std::uint32_t>(level_memory_.size());
        stream_.flush = last ? NO_FLUSH : FULL_FLUSH;
        stream_.end_of_stream = last ? 1 : 0;
        if (isal_deflate_set_dict(&stream_, filtered_.data(), kStoredBytes) != COMP_OK)
            return false;
        stream_.next_in = filtered_.data() + kStoredBytes;
        stream_.avail_in = static_cast<std::uint32_t>(size - kStoredBytes);
        stream_.avail_out = 0;
        while (stream_.avail_out == 0) { // room is left: all output is written
            const std::size_t before = out.size();
            out.resize(before + size / 4 + 1024);
            stream_.next_out = out.data() + before;
            stream_.avail_out = static_cast<std::uint32_t>(out.size() - before);
            if (isal_deflate(&stream_) != COMP_OK)
                return false;
        }
        out.resize(out.size() - stream_.avail_out);
        return true;
    }

    const Framebuffer &picture_;
    const Bands &bands_;
    std::vector<std::uint32_t> above_first_; // zeros: the row above the first row
    Bytes filtered_, level_memory_;
    isal_zstream stream_;
};

} // namespace

bool is_opaque(const Framebuffer &picture) {
    const auto columns = static_cast<std::size_t>(picture.width);
    for (std::size_t at = 0; at < picture.pixels(); at += columns) {
        std::uint32_t all = 0xFFFFFFFF;
        for (std::size_t x = 0; x < columns; ++x)
            all &= picture.colour[at + x];
        if (all >> 24 != 255)
            return false;
    }
    return true;
}

struct PngBands::Parts {
    Parts(const Framebuffer &shown, bool is_opaque, int threads)
        : picture(shown), opaque(is_opaque), bands(shown, is_opaque), encoded(bands.count),
          encoders(static_cast<std::size_t>(threads)) {}

    const Framebuffer &picture;
    const bool opaque;
    const Bands bands;
    std::vector<EncodedBand> encoded;
    std::vector<std::unique_ptr<BandEncoder>> encoders; // [threads], created on first use
};

PngBands::PngBands(const Framebuffer &picture, bool opaque, int threads)
    : parts_(std::make_unique<Parts>(picture, opaque, threads)) {}

PngBands::~PngBands() = default;

std::size_t PngBands::count() const { return parts_->bands.count; }

int PngBands::end_row(std::size_t band) const {
    const Bands &bands = parts_->bands;
    return static_cast<int>(std::min((band + 1) * bands.rows, bands.height));
}

void PngBands::encode(std::size_t band, std::size_t thread) {
    std::unique_ptr<BandEncoder> &encoder = parts_->encoders[thread];
    if (encoder == nullptr)
        encoder = std::make_unique<BandEncoder>(parts_->picture, parts_->bands);
    parts_->encoded[band] = encoder->encode(band);
}

Result<Bytes> PngBands::finish() {
    const Framebuffer &picture = parts_->picture;
    assert(parts_->opaque == is_opaque(picture));
    std::uint32_t adler32 = 1;
    std::size_t size = 128; // everything but the bands takes 91
    for (const EncodedBand &band : parts_->encoded) {
        if (band.failed)
            return Error{ErrorCode::memory, 0, "the PNG encoder failed"};
        adler32 = join_adler32(adler32, band.adler32, band.filtered);
        size += band.chunk.size();
    }
    Bytes header;
    append(header, big_endian(static_cast<std::uint32_t>(picture.width)));
    append(header, big_endian(static_cast<std::uint32_t>(picture.height)));
    append(header, std::array<std::uint8_t, 5>{kEightBits, parts_->opaque ? kRgb : kRgba}); // deflate, adaptive
                                                                                            // filters, no interlace
    Bytes file;
    file.reserve(size);
    append(file, kSignature);
    append_chunk(file, "IHDR", header);
    append_chunk(file, "sRGB", std::array{kPerceptual});
    for (const EncodedBand &band : parts_->encoded)
        append(file, band.chunk);
    append_chunk(file, "IDAT", big_endian(adler32));
    append_chunk(file, "IEND", Bytes());
    return file;
}

Result<Bytes> encode_png(const Framebuffer &picture, int threads) {
    const int workers = resolve_threads(threads);
    PngBands bands(picture, is_opaque(picture), workers);
    ThreadPool pool(static_cast<int>(std::min(bands.count(), static_cast<std::size_t>(workers))));
    pool.run(bands.count(), [&](std::size_t band, std::size_t thread) { bands.encode(band, thread); });
    return bands.finish();
}

void set_png_density(std::uint32_t pixels_per_metre, Bytes &file) {
    constexpr std::ptrdiff_t kHeaders = 8 + 25 + 13; // bytes of signature, IHDR and sRGB
    constexpr std::uint8_t kMetre = 1;
    Bytes body, chunk;
    append(body, big_endian(pixels_per_metre));
    append(body, big_endian(pixels_per_metre));
    append(body, std::array{kMetre});
    append_chunk(chunk, "pHYs", body);
    file.insert(file.begin() + kHeaders, chunk.begin(), chunk.end());
}

Bytes encode_depth_pfm(const Framebuffer &picture) {
    const std::string header =
        "Pf\n" + std::to_string(picture.width) + " " + std::to_string(picture.height) + "\n-1.0\n";
    const auto row_bytes = static_cast<std::size_t>(picture.width) * sizeof(float);
    Bytes file(header.size() + row_bytes * static_cast<std::size_t>(picture.height));
    std::copy(header.begin(), header.end(), file.begin());
    const auto *const depths = reinterpret_cast<const std::uint8_t *>(picture.depth.data());
    for (std::size_t y = 0; y < static_cast<std::size_t>(picture.height); ++y) {
        const std::size_t from_bottom = static_cast<std::size_t>(picture.height) - 1 - y;
        std::copy_n(depths + from_bottom * row_bytes, row_bytes, file.data() + header.size() + y * row_bytes);
    }
    return file;
}

} // namespace pbm
