#include "pbm_scan/packing/compressed.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/text_lines.h"
#include "system/threads/cancellation.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <string>

namespace pbm::build {
namespace {

using Unpacked = Result<std::vector<std::uint8_t>>;

// Grows by half as long as a step fills it.
class Output {
  public:
    explicit Output(std::uint64_t limit) : limit_(limit) {}

    // Room behind what is written, for a step of unpacking; empty at the limit.
    std::span<std::uint8_t> room() {
        check_cancelled();
        if (size_ == bytes_.size())
            bytes_.resize(static_cast<std::size_t>(
                std::min<std::uint64_t>(limit_, std::max<std::uint64_t>(kFirst, size_ + size_ / 2))));
        return std::span(bytes_).subspan(size_, std::min(bytes_.size() - size_, kStep));
    }
    void wrote(std::size_t count) { size_ += count; }
    std::vector<std::uint8_t> take() {
        bytes_.resize(size_);
        return std::move(bytes_);
    }
    Error refusal() const {
        return out_of_memory("more than " + std::to_string(limit_ >> 20) + " MiB when unpacked; unpack it yourself");
    }

  private:
    static constexpr std::uint64_t kFirst = std::uint64_t{1} << 20;
    static constexpr std::size_t kStep = std::size_t{4} << 20;

    std::vector<std::uint8_t> bytes_;
    std::size_t size_ = 0;
    std::uint64_t limit_;
};

Error damaged(const char *program, std::size_t at, const char *what) {
    return bad_input(std::string("compressed by ") + program + ", and " + what + "; copy it again", at);
}

Unpacked unpack_gzip(std::span<const std::uint8_t> file, std::uint64_t limit) {
    struct End {
        void operator()(z_stream *stream) const { inflateEnd(stream); }
    };
    constexpr int kGzip = 15 + 16; // the largest window, with a gzip header
    z_stream state{};
    if (inflateInit2(&state, kGzip) != Z_OK)
        return out_of_memory("too little memory to unpack it");
    const std::unique_ptr<z_stream, End> stream(&state);
    Output output(limit);
    std::size_t at = 0;
    constexpr std::size_t kAtOnce = std::size_t{1} << 30; // zlib counts in 32 bits
    while (true) {
        const std::span<std::uint8_t> room = output.room();
        if (room.empty())
            return output.refusal();
        const std::size_t input = std::min(file.size() - at, kAtOnce);
        state.next_in = const_cast<std::uint8_t *>(file.data() + at); // zlib does not write there
        state.avail_in = static_cast<uInt>(input);
        state.next_out = room.data();
        state.avail_out = static_cast<uInt>(room.size());
        const int status = inflate(&state, Z_NO_FLUSH);
        at += input - state.avail_in;
        output.wrote(room.size() - state.avail_out);
        if (status == Z_STREAM_END) {
            // Some programs fill the end with zeros.
            if (std::all_of(file.begin() + static_cast<std::ptrdiff_t>(at), file.end(), [](auto b) { return b == 0; }))
                return output.take();
            if (inflateReset(&state) != Z_OK)
                return damaged("gzip", at, "damaged");
        } else if (status == Z_BUF_ERROR && at == file.size()) {
            return damaged("gzip", at, "cut short");
        } else if (status != Z_OK && status != Z_BUF_ERROR) {
            return damaged("gzip", at, "damaged");
        }
    }
}

Unpacked unpack_zstd(std::span<const std::uint8_t> file, std::uint64_t limit) {
    struct End {
        void operator()(ZSTD_DCtx *context) const { ZSTD_freeDCtx(context); }
    };
    const std::unique_ptr<ZSTD_DCtx, End> context(ZSTD_createDCtx());
    if (!context)
        return out_of_memory("too little memory to unpack it");
    Output output(limit);
    ZSTD_inBuffer in{file.data(), file.size(), 0};
    while (true) {
        const std::span<std::uint8_t> room = output.room();
        if (room.empty())
            return output.refusal();
        ZSTD_outBuffer out{room.data(), room.size(), 0};
        const std::size_t before = in.pos;
        const std::size_t status = ZSTD_decompressStream(context.get(), &out, &in);
        output.wrote(out.pos);
        if (ZSTD_isError(status) != 0)
            return damaged("zstd", in.pos, "damaged");
        if (status == 0 && in.pos == in.size)
            return output.take();
        if (status != 0 && in.pos == in.size && out.pos < out.size && in.pos == before)
            return damaged("zstd", in.pos, "cut short");
    }
}

} // namespace

std::optional<Unpacked> unpacked(std::span<const std::uint8_t> file, std::uint64_t max_bytes) {
    const std::uint64_t limit =
        std::min(max_bytes, std::max(kMinUnpackedLimit, kMaxUnpackedFactor * std::uint64_t{file.size()}));
    if (as_text(file).starts_with("\x1f\x8b"))
        return unpack_gzip(file, limit);
    if (as_text(file).starts_with("\x28\xb5\x2f\xfd"))
        return unpack_zstd(file, limit);
    return std::nullopt;
}

} // namespace pbm::build
