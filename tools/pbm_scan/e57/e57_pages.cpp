#include "pbm_scan/e57/e57_pages.h"

#include "pbm_scan/e57/crc32c.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"

#include <algorithm>

namespace pbm::build {

Result<E57Pages> E57Pages::open(std::span<const std::uint8_t> file) {
    constexpr std::uint64_t kSignatureBytes = 8, kMinPageBytes = 64, kMaxPageBytes = 1 << 20;
    ByteReader in(file.subspan(std::min<std::size_t>(file.size(), kSignatureBytes)));
    const std::uint32_t major = in.read<std::uint32_t>(), minor = in.read<std::uint32_t>();
    const auto length = in.read<std::uint64_t>(), xml_at = in.read<std::uint64_t>();
    const auto xml_bytes = in.read<std::uint64_t>(), page_bytes = in.read<std::uint64_t>();
    if (!in.ok())
        return bad_input("the E57 header is cut short: the file has " + std::to_string(file.size()) +
                         " bytes; export the scan again");
    if (major != 1)
        return unsupported("the E57 file is of version " + std::to_string(major) + "." + std::to_string(minor) +
                           "; PBM reads version 1.0");
    if (page_bytes < kMinPageBytes || page_bytes > kMaxPageBytes || page_bytes % 4 != 0)
        return bad_input("the E57 header says that a page has " + std::to_string(page_bytes) +
                             " bytes: it is damaged; export the scan again",
                         40);
    if (length > file.size())
        return bad_input("the E57 header says that the file has " + std::to_string(length) + " bytes, but there are " +
                             std::to_string(file.size()) + ": the file is cut short; copy or export it again",
                         16);
    if (length == 0 || length % page_bytes != 0)
        return bad_input("the E57 header says that the file has " + std::to_string(length) +
                             " bytes, which is no whole number of pages of " + std::to_string(page_bytes) +
                             ": it is damaged; export the scan again",
                         16);
    E57Pages pages;
    pages.file_ = file.first(static_cast<std::size_t>(length));
    pages.page_bytes_ = page_bytes;
    pages.trailing_ = file.size() - length;
    pages.verified_.resize(static_cast<std::size_t>(length / page_bytes));
    if (Status first = pages.verify(0); !first) // that of the header
        return first.error();
    pages.xml_ = {pages.logical(xml_at), xml_bytes};
    if (pages.xml_.offset > pages.logical_size() || xml_bytes > pages.logical_size() - pages.xml_.offset)
        return bad_input("the E57 header places the XML section outside the file: it is damaged; export the scan again",
                         24);
    return pages;
}

std::uint64_t E57Pages::logical_size() const { return file_.size() / page_bytes_ * (page_bytes_ - kChecksumBytes); }

std::uint64_t E57Pages::physical(std::uint64_t logical) const {
    const std::uint64_t payload = page_bytes_ - kChecksumBytes;
    return logical / payload * page_bytes_ + logical % payload;
}

std::uint64_t E57Pages::logical(std::uint64_t physical) const {
    const std::uint64_t payload = page_bytes_ - kChecksumBytes;
    if (physical >= file_.size() || physical % page_bytes_ >= payload)
        return logical_size();
    return physical / page_bytes_ * payload + physical % page_bytes_;
}

Status E57Pages::verify(std::uint64_t page) {
    std::uint8_t &verified = verified_[static_cast<std::size_t>(page)];
    if (verified != 0)
        return {};
    const std::uint64_t first = page * page_bytes_;
    const ByteView bytes = slice(file_, first, page_bytes_);
    const ByteView stored = bytes.last(kChecksumBytes);
    const std::uint32_t expected = std::uint32_t{stored[0]} << 24 | std::uint32_t{stored[1]} << 16 |
                                   std::uint32_t{stored[2]} << 8 | std::uint32_t{stored[3]}; // big-endian
    const std::uint32_t actual = crc32c(bytes.first(bytes.size() - kChecksumBytes));
    if (actual != expected)
        return bad_input(formatted("page %llu (bytes %llu to %llu) does not match its checksum (CRC-32C %08x, stored "
                                   "%08x): the file is damaged; copy or export it again",
                                   static_cast<unsigned long long>(page), static_cast<unsigned long long>(first),
                                   static_cast<unsigned long long>(first + page_bytes_ - 1), actual, expected),
                         first);
    verified = 1;
    return {};
}

Status E57Pages::read(std::uint64_t at, std::span<std::uint8_t> out) {
    if (at > logical_size() || out.size() > logical_size() - at)
        return bad_input("the E57 file is cut short: " + std::to_string(out.size()) +
                             " bytes are missing at its end; "
                             "export the scan again",
                         physical(at));
    const std::uint64_t payload = page_bytes_ - kChecksumBytes;
    while (!out.empty()) {
        const std::uint64_t page = at / payload, within = at % payload;
        if (Status verified = verify(page); !verified)
            return verified;
        const std::uint64_t count = std::min<std::uint64_t>(payload - within, out.size());
        const ByteView from = slice(file_, page * page_bytes_ + within, count);
        std::copy(from.begin(), from.end(), out.begin());
        out = out.subspan(from.size());
        at += count;
    }
    return {};
}

} // namespace pbm::build
