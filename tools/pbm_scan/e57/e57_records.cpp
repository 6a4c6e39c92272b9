#include "pbm_scan/e57/e57_records.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"

#include <algorithm>
#include <array>
#include <functional>

namespace pbm::build {
namespace {

constexpr std::size_t kBlock = 1024; // values decoded at a time
using Block = std::array<double, kBlock>;

// The next `count` values of a field, from bit `bit` of `bytes` on, behind which eight bytes may be read.
using Decode = void (*)(const E57Field &field, const std::uint8_t *bytes, std::size_t bit, std::size_t count,
                        Block &out);

template <class T>
void decode_floats(const E57Field & /*field*/, const std::uint8_t *bytes, std::size_t bit, std::size_t count,
                   Block &out) {
    bytes += bit / 8; // floats begin at bytes
    for (std::size_t i = 0; i < count; ++i)
        out[i] = static_cast<double>(load<T>(bytes + i * sizeof(T)));
}

// A value and the bits before it in its first byte lie in eight bytes, or in nine.
template <bool kWide>
void decode_integers(const E57Field &field, const std::uint8_t *bytes, std::size_t bit, std::size_t count, Block &out) {
    const auto bits = static_cast<std::size_t>(field.bits);
    const std::uint64_t mask = bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
    const auto minimum = static_cast<std::uint64_t>(field.minimum);
    const double scale = field.scale, offset = field.offset;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t at = bit + i * bits;
        std::uint64_t word = load<std::uint64_t>(bytes + at / 8) >> (at % 8);
        if constexpr (kWide)
            if (at % 8 != 0)
                word |= std::uint64_t{bytes[at / 8 + 8]} << (64 - at % 8);
        out[i] = static_cast<double>(static_cast<std::int64_t>((word & mask) + minimum)) * scale + offset;
    }
}

Decode decoder_of(const E57Field &field) {
    if (field.type == E57Type::single_float)
        return decode_floats<float>;
    if (field.type == E57Type::double_float)
        return decode_floats<double>;
    return field.bits <= 57 ? decode_integers<false> : decode_integers<true>;
}

// The byte stream of a field, which goes on from packet to packet.
class Stream {
  public:
    Stream(const E57Field &field, std::uint64_t records, const E57Sink &sink)
        : field_(&field), decode_(decoder_of(field)), records_(records),
          is_wanted_(field.type != E57Type::text &&
                     (field.role != E57Role::none || (sink.wants && sink.wants(field)))) {}

    void add(std::span<const std::uint8_t> bytes, const E57Sink &sink, Block &block) {
        bytes_ += bytes.size();
        if (!is_wanted_ || field_->bits == 0)
            return;
        constexpr std::size_t kMaxLoad = 16;
        const auto bits = static_cast<std::size_t>(field_->bits);
        kept_.insert(kept_.end(), bytes.begin(), bytes.end());
        const std::uint64_t whole = (kept_.size() * 8 - bit_) / bits;
        const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(whole, records_ - done_));
        kept_.resize(kept_.size() + kMaxLoad);
        for (std::size_t i = 0; i < count; i += kBlock) {
            const std::size_t here = std::min(kBlock, count - i);
            decode_(*field_, kept_.data(), bit_ + i * bits, here, block);
            sink.values(*field_, done_ + i, std::span(block).first(here));
        }
        kept_.resize(kept_.size() - kMaxLoad);
        done_ += count;
        const std::size_t end = bit_ + count * bits;
        bit_ = end % 8;
        kept_.erase(kept_.begin(), kept_.begin() + static_cast<std::ptrdiff_t>(end / 8));
        if (done_ == records_)
            kept_.clear(); // the stream may end with bits of no meaning
    }

    // Fields of one value have no bits.
    void add_constants(const E57Sink &sink, Block &block) const {
        if (!is_wanted_ || field_->bits != 0)
            return;
        block.fill(static_cast<double>(field_->minimum) * field_->scale + field_->offset);
        for (std::uint64_t i = 0; i < records_; i += kBlock)
            sink.values(
                *field_, i,
                std::span(block).first(static_cast<std::size_t>(std::min<std::uint64_t>(kBlock, records_ - i))));
    }

    // The records whose value is whole; all of them for texts, whose lengths are not read.
    std::uint64_t whole_records() const {
        if (field_->bits == 0)
            return records_;
        return std::min(records_, bytes_ * 8 / static_cast<std::uint64_t>(field_->bits));
    }
    bool is_whole() const { return whole_records() == records_; }
    bool has_bits() const { return field_->bits != 0; }
    // Whether the stream has another value: a writer may fill up its last word of 64 bits.
    bool has_more() const {
        const auto bits = static_cast<std::uint64_t>(field_->bits);
        return has_bits() && bytes_ * 8 >= records_ * bits + 63 + bits;
    }
    const E57Field &field() const { return *field_; }

  private:
    const E57Field *field_;
    Decode decode_;
    std::uint64_t records_;
    bool is_wanted_;
    std::uint64_t bytes_ = 0; // of the stream so far
    std::uint64_t done_ = 0;  // values decoded
    Bytes kept_;              // bytes that are not decoded, of less than one value between packets
    std::size_t bit_ = 0;     // first bit of `kept_` that is not decoded
};

Error refuse(const E57Scan &scan, const E57Pages &pages, const std::string &what, std::uint64_t at) {
    return bad_input(scan.label + ": " + what + "; export the scan again", pages.physical(at));
}

struct Section {
    std::uint64_t first_packet = 0, end = 0; // logical
};

Result<Section> read_section(const E57Scan &scan, E57Pages &pages) {
    constexpr std::uint64_t kHeaderBytes = 32;
    constexpr std::uint8_t kCompressedVector = 1;
    std::array<std::uint8_t, kHeaderBytes> header{};
    if (scan.section >= pages.logical_size())
        return bad_input(scan.label + ": its points lie outside the file; export the scan again", scan.offset);
    if (Status read = pages.read(scan.section, header); !read)
        return read.error();
    ByteReader in(header);
    const auto id = static_cast<std::uint8_t>(in.read<std::uint64_t>() & 255);
    const auto bytes = in.read<std::uint64_t>(), first = in.read<std::uint64_t>();
    if (id != kCompressedVector)
        return refuse(scan, pages, "there is no section of points where the XML section places it", scan.section);
    if (bytes < kHeaderBytes || bytes > pages.logical_size() - scan.section)
        return refuse(scan, pages, "its section of points says that it has " + std::to_string(bytes) + " bytes",
                      scan.section);
    const Section section{pages.logical(first), scan.section + bytes};
    if (section.first_packet < scan.section + kHeaderBytes || section.first_packet > section.end)
        return refuse(scan, pages, "its first packet lies outside its section of points", scan.section);
    return section;
}

class RecordReader {
  public:
    RecordReader(const E57Scan &scan, E57Pages &pages, const E57Sink &sink) : scan_(scan), pages_(pages), sink_(sink) {
        for (const E57Field &field : scan.fields)
            streams_.emplace_back(field, scan.records, sink);
    }

    // Reads the packet at the logical offset `at` of a section that ends at `end`. Returns its size.
    Result<std::uint64_t> read_packet(std::uint64_t at, std::uint64_t end) {
        constexpr std::uint8_t kIndexPacket = 0, kDataPacket = 1, kIgnoredPacket = 2;
        constexpr std::size_t kMinPacketBytes = 4;
        std::array<std::uint8_t, kMinPacketBytes> start{};
        if (end - at < start.size()) {
            const auto first = std::find_if_not(streams_.begin(), streams_.end(), std::mem_fn(&Stream::is_whole));
            return refuse(scan_, pages_,
                          "the packets end after " + std::to_string(first->whole_records()) + " of " +
                              std::to_string(scan_.records) + " values of " + printable(first->field().name),
                          at);
        }
        if (Status read = pages_.read(at, start); !read)
            return read.error();
        const std::uint64_t bytes = std::uint64_t{start[2]} + (std::uint64_t{start[3]} << 8) + 1;
        if (bytes < kMinPacketBytes || bytes % 4 != 0 || bytes > end - at)
            return refuse(scan_, pages_, "a packet says that it has " + std::to_string(bytes) + " bytes", at);
        if (start[0] == kDataPacket) {
            packet_.resize(static_cast<std::size_t>(bytes));
            if (Status read = pages_.read(at, packet_); !read)
                return read.error();
            if (Status added = add_data_packet(at); !added)
                return added.error();
        } else if (start[0] != kIndexPacket && start[0] != kIgnoredPacket) {
            return refuse(scan_, pages_, "a packet is of the unknown type " + std::to_string(start[0]), at);
        }
        return bytes;
    }

    bool is_whole() const { return std::all_of(streams_.begin(), streams_.end(), std::mem_fn(&Stream::is_whole)); }
    // Whether all streams that have bits go on.
    bool has_more() const {
        const auto count_of = [this](auto which) { return std::count_if(streams_.begin(), streams_.end(), which); };
        return count_of(std::mem_fn(&Stream::has_bits)) > 0 &&
               count_of(std::mem_fn(&Stream::has_bits)) == count_of(std::mem_fn(&Stream::has_more));
    }
    void add_constants() {
        for (const Stream &stream : streams_)
            stream.add_constants(sink_, block_);
    }

  private:
    // Adds what `packet_` holds to the streams.
    Status add_data_packet(std::uint64_t at) {
        constexpr std::size_t kHeaderBytes = 6;
        ByteReader in(packet_);
        in.read<std::uint32_t>();
        const std::size_t count = in.read<std::uint16_t>();
        if (!in.ok() || count != streams_.size() || packet_.size() < kHeaderBytes + 2 * count)
            return refuse(scan_, pages_,
                          "a packet has " + std::to_string(count) + " byte streams, but a point has " +
                              std::to_string(streams_.size()) + " fields",
                          at);
        std::size_t begin = kHeaderBytes + 2 * count;
        for (Stream &stream : streams_) {
            const std::size_t bytes = in.read<std::uint16_t>();
            if (bytes > packet_.size() - begin)
                return refuse(scan_, pages_, "the byte streams of a packet are longer than the packet", at);
            stream.add(std::span(packet_).subspan(begin, bytes), sink_, block_);
            begin += bytes;
        }
        return {};
    }

    const E57Scan &scan_;
    E57Pages &pages_;
    const E57Sink &sink_;
    std::vector<Stream> streams_;
    Bytes packet_;
    Block block_{};
};

} // namespace

Status check_e57_records(const std::vector<E57Scan> &scans, const E57Pages &pages) {
    std::uint64_t left = pages.logical_size() * 8; // bits
    for (const E57Scan &scan : scans) {
        std::uint64_t bits = 0;
        for (const E57Field &field : scan.fields)
            bits += static_cast<std::uint64_t>(field.bits);
        bits = std::max<std::uint64_t>(bits, 8); // smaller points would take too much memory for the size of the file
        if (scan.records > left / bits)
            return bad_input(scan.label + ": the XML section says that it has " + std::to_string(scan.records) +
                                 " points, but the file has room for " + std::to_string(left / bits) +
                                 "; export the scan again",
                             scan.offset);
        left -= scan.records * bits;
    }
    return {};
}

Result<bool> read_e57_records(const E57Scan &scan, E57Pages &pages, const E57Sink &sink) {
    if (scan.records == 0)
        return false;
    const Result<Section> section = read_section(scan, pages);
    if (!section)
        return section.error();
    constexpr int kProgressPackets = 64;
    RecordReader reader(scan, pages, sink);
    std::uint64_t at = section->first_packet;
    for (int packets = 1; !reader.is_whole(); ++packets) {
        const Result<std::uint64_t> bytes = reader.read_packet(at, section->end);
        if (!bytes)
            return bytes.error();
        at += *bytes;
        if (sink.progress && packets % kProgressPackets == 0)
            sink.progress(static_cast<double>(at - section->first_packet) /
                          static_cast<double>(section->end - section->first_packet));
    }
    reader.add_constants();
    return reader.has_more();
}

} // namespace pbm::build
