// Writes E57 files (ASTM E2807-11) as strings.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace pbm::test {

template <class T> std::string little_endian(T value) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    return bytes;
}

// A field of all points: its element in the prototype, and its byte stream.
struct E57Column {
    std::string element, stream;
    std::uint64_t records = 0;
};

template <class Float> E57Column e57_floats(const std::string &name, const std::vector<Float> &values) {
    E57Column column;
    column.element = "<" + name + R"( type="Float" precision=")" + (sizeof(Float) == 4 ? "single" : "double") + "\"/>";
    column.records = values.size();
    for (const Float value : values)
        column.stream += little_endian(value);
    return column;
}

// `more`: further attributes, which make a scaled integer of it.
inline E57Column e57_integers(const std::string &name, std::int64_t minimum, std::int64_t maximum,
                              const std::vector<std::int64_t> &values, const std::string &more = "") {
    E57Column column;
    column.element = "<" + name + " type=\"" + (more.empty() ? "Integer" : "ScaledInteger") + "\" minimum=\"" +
                     std::to_string(minimum) + "\" maximum=\"" + std::to_string(maximum) + "\" " + more + "/>";
    column.records = values.size();
    const int bits =
        static_cast<int>(std::bit_width(static_cast<std::uint64_t>(maximum) - static_cast<std::uint64_t>(minimum)));
    int used = 8; // bits of the last byte
    for (const std::int64_t value : values) {
        const std::uint64_t word = static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(minimum);
        for (int bit = 0; bit < bits; ++bit, ++used) {
            if (used == 8) {
                column.stream += '\0';
                used = 0;
            }
            column.stream.back() = static_cast<char>(column.stream.back() | static_cast<int>(word >> bit & 1) << used);
        }
    }
    return column;
}

struct E57ScanText {
    std::vector<E57Column> columns;
    std::string more = "";         // elements of the scan: pose, colorLimits
    std::size_t stream_bytes = 64; // of each column in a packet, at most
    bool other_packets = false;    // an index packet and an ignored one before each data packet
    std::string codecs = "";
};

inline std::string e57_packets(const E57ScanText &scan) {
    const auto length = [](std::size_t bytes) { return little_endian(static_cast<std::uint16_t>(bytes - 1)); };
    std::string out;
    std::size_t longest = 0;
    for (const E57Column &column : scan.columns)
        longest = std::max(longest, column.stream.size());
    for (std::size_t at = 0; at < longest; at += scan.stream_bytes) {
        std::string sizes, streams;
        for (const E57Column &column : scan.columns) {
            const std::string part = at < column.stream.size() ? column.stream.substr(at, scan.stream_bytes) : "";
            sizes += little_endian(static_cast<std::uint16_t>(part.size()));
            streams += part;
        }
        std::string packet = little_endian(static_cast<std::uint16_t>(scan.columns.size()));
        packet.append(sizes).append(streams);
        packet.resize((packet.size() + 4 + 3) / 4 * 4 - 4);
        if (scan.other_packets) {
            out += std::string("\0\0", 2) + length(32) + std::string(28, '\1'); // index
            out += std::string("\2\0", 2) + length(8) + std::string(4, '\1');   // ignored
        }
        out += std::string("\1\0", 2) + length(packet.size() + 4) + packet;
    }
    return out;
}

constexpr std::size_t kE57Page = 1024, kE57Payload = kE57Page - 4;

inline std::uint64_t e57_physical(std::uint64_t logical) {
    return logical / kE57Payload * kE57Page + logical % kE57Payload;
}

// CRC-32C bit by bit, RFC 3720.
inline std::uint32_t e57_checksum(std::string_view bytes) {
    std::uint32_t crc = 0xffffffff;
    for (const char byte : bytes) {
        crc ^= static_cast<std::uint8_t>(byte);
        for (int bit = 0; bit < 8; ++bit)
            crc = crc >> 1 ^ ((crc & 1) != 0 ? 0x82F63B78U : 0U);
    }
    return ~crc;
}

// The pages of a file of these logical bytes.
inline std::string e57_pages(std::string logical) {
    logical.resize((logical.size() + kE57Payload - 1) / kE57Payload * kE57Payload);
    std::string file;
    for (std::size_t at = 0; at < logical.size(); at += kE57Payload) {
        const std::string page = logical.substr(at, kE57Payload), crc = little_endian(e57_checksum(page));
        file += page;
        file.append(crc.rbegin(), crc.rend());
    }
    return file;
}

// The pages of a file whose header says how long it is and how long its pages are.
inline std::string e57_with_length(std::string logical) {
    const std::uint64_t pages = (logical.size() + kE57Payload - 1) / kE57Payload;
    if (logical.size() >= 48)
        logical.replace(16, 8, little_endian(pages * std::uint64_t{kE57Page}))
            .replace(40, 8, little_endian(std::uint64_t{kE57Page}));
    return e57_pages(std::move(logical));
}

// What lies in the pages of a file whose XML section is `xml` and lies behind `sections`, which begin at byte 48.
inline std::string e57_logical(const std::string &sections, const std::string &xml) {
    const std::uint64_t xml_at = 48 + sections.size();
    return "ASTM-E57" + little_endian(std::uint32_t{1}) + std::string(12, '\0') + little_endian(e57_physical(xml_at)) +
           little_endian(std::uint64_t{xml.size()}) + std::string(8, '\0') + sections + xml;
}

inline std::string e57_around(const std::string &sections, const std::string &xml) {
    return e57_with_length(e57_logical(sections, xml));
}

// What lies in the pages of a file. `more`: elements of the root; `attributes`: of the root.
inline std::string e57_contents(const std::vector<E57ScanText> &scans, const std::string &more = "",
                                const std::string &attributes = "") {
    std::string sections, data;
    for (const E57ScanText &scan : scans) {
        const std::string packets = e57_packets(scan);
        const std::uint64_t at = 48 + sections.size();
        std::string prototype;
        for (const E57Column &column : scan.columns)
            prototype += column.element;
        data += R"(<vectorChild type="Structure"><points type="CompressedVector" fileOffset=")" +
                std::to_string(e57_physical(at)) + "\" recordCount=\"" +
                std::to_string(scan.columns.empty() ? 0 : scan.columns.front().records) +
                R"("><prototype type="Structure">)" + prototype + R"(</prototype><codecs type="Vector">)" +
                scan.codecs + "</codecs></points>" + scan.more + "</vectorChild>";
        sections += std::string("\1\0\0\0\0\0\0\0", 8) + little_endian(std::uint64_t{32 + packets.size()}) +
                    little_endian(e57_physical(at + 32)) + little_endian(std::uint64_t{0}) + packets;
    }
    return e57_logical(sections, R"(<?xml version="1.0" encoding="UTF-8"?><e57Root type="Structure" )"
                                 R"(xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0" )" +
                                     attributes + R"(><data3D type="Vector">)" + data + "</data3D>" + more +
                                     "</e57Root>");
}

inline std::string e57_file(const std::vector<E57ScanText> &scans, const std::string &more = "",
                            const std::string &attributes = "") {
    return e57_with_length(e57_contents(scans, more, attributes));
}

} // namespace pbm::test
