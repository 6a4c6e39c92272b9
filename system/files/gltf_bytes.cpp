#include "system/files/gltf_bytes.h"

namespace pbm {
namespace {

constexpr std::size_t kGlbHeader = 12, kChunkHeader = 8;
constexpr std::uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A,
                        kBinaryChunk = 0x004E4942; // "glTF", "JSON", "BIN"

std::uint32_t word(ByteView bytes, std::size_t at) { return load<std::uint32_t>(bytes.data() + at); }

Error damaged(std::string what, std::size_t at) { return {ErrorCode::bad_input, at, std::move(what)}; }

// -1: none.
int base64_digit(char c) {
    return c >= 'A' && c <= 'Z'   ? c - 'A'
           : c >= 'a' && c <= 'z' ? c - 'a' + 26
           : c >= '0' && c <= '9' ? c - '0' + 52
           : c == '+' || c == '-' ? 62
           : c == '/' || c == '_' ? 63
                                  : -1;
}

int hex_digit(char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

std::optional<Bytes> from_base64(std::string_view text) {
    Bytes bytes;
    bytes.reserve(text.size() / 4 * 3);
    std::uint32_t bits = 0;
    for (int count = 0; const char c : text.substr(0, text.find('='))) {
        const int digit = base64_digit(c);
        if (digit < 0)
            return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(digit);
        if ((count += 6) >= 8)
            bytes.push_back(static_cast<std::uint8_t>(bits >> (count -= 8)));
    }
    return bytes;
}

} // namespace

Result<GltfChunks> gltf_chunks(ByteView file) {
    GltfChunks chunks;
    if (file.size() < 4 || word(file, 0) != kGlbMagic) {
        chunks.json = file;
        return chunks;
    }
    if (file.size() < kGlbHeader + kChunkHeader)
        return damaged("a GLB file of " + std::to_string(file.size()) + " bytes: it is cut short", 0);
    if (word(file, 4) == 1)
        return Error{ErrorCode::unsupported_version, 4, "glTF 1; export it as glTF 2"};
    const std::size_t announced = word(file, 8);
    if (announced > file.size())
        return damaged("the GLB file announces " + std::to_string(announced) + " bytes and has " +
                           std::to_string(file.size()) + ": it is cut short; copy or export it again",
                       8);
    if (announced >= kGlbHeader + kChunkHeader) {
        chunks.bytes_behind = file.size() - announced;
        file = file.first(announced);
    }
    bool has_json = false;
    const auto is_binary = [&](std::size_t at) {
        return at <= file.size() && file.size() - at >= kChunkHeader && word(file, at + 4) == kBinaryChunk;
    };
    for (std::size_t at = kGlbHeader; file.size() - at >= kChunkHeader;) {
        const std::size_t length = word(file, at), type = word(file, at + 4);
        at += kChunkHeader;
        if (length > file.size() - at)
            return damaged("a chunk of " + std::to_string(length) +
                               " bytes goes beyond the end of the GLB file: it is cut short or damaged",
                           at - kChunkHeader);
        if (type == kJsonChunk && !has_json)
            chunks.json = file.subspan(at, length), has_json = true;
        else if (type == kBinaryChunk && chunks.binary.empty())
            chunks.binary = file.subspan(at, length);
        else if (length != 0)
            chunks.has_further = true;
        at += length;
        if (const std::size_t filled = (at + 3) / 4 * 4; filled != at && !is_binary(at) && is_binary(filled)) {
            chunks.is_miscounted = true;
            at = filled;
        }
    }
    if (!has_json)
        return damaged("the GLB file has no JSON; export it again", kGlbHeader);
    return chunks;
}

Result<GltfResource> read_data_uri(std::string_view uri) {
    const std::size_t comma = uri.find(',');
    if (comma == std::string_view::npos || uri.substr(0, comma).find(";base64") == std::string_view::npos)
        return damaged("a data URI that is not in base64", 0);
    std::optional<Bytes> bytes = from_base64(uri.substr(comma + 1));
    if (!bytes)
        return damaged("a data URI with a character that is not of base64", 0);
    return GltfResource{.decoded = std::move(*bytes)};
}

std::string without_percents(std::string_view uri) {
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const bool is_escape =
            uri[i] == '%' && i + 2 < uri.size() && hex_digit(uri[i + 1]) >= 0 && hex_digit(uri[i + 2]) >= 0;
        text += is_escape ? static_cast<char>(16 * hex_digit(uri[i + 1]) + hex_digit(uri[i + 2])) : uri[i];
        i += is_escape ? 2 : 0;
    }
    return text;
}

} // namespace pbm
