#include "viewer/cameras/gltf_bytes.h"

#include <algorithm>
#include <filesystem>

namespace pbm {
namespace {

constexpr std::size_t kGlbHeader = 12, kGlbChunkHeader = 8;
constexpr std::uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A,
                        kBinaryChunk = 0x004E4942; // "glTF", "JSON", "BIN"

std::uint32_t word(ByteView bytes, std::size_t at) { return load<std::uint32_t>(bytes.data() + at); }

Error damaged(std::size_t at, std::string what) { return {ErrorCode::bad_input, at, std::move(what)}; }

int digit_of(char c, std::string_view digits) {
    const std::size_t at = digits.find(c);
    return at == std::string_view::npos ? -1 : static_cast<int>(at);
}

std::optional<Bytes> from_base64(std::string_view text) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    Bytes bytes;
    std::uint32_t bits = 0;
    for (int count = 0; const char c : text.substr(0, text.find('='))) {
        const int digit = digit_of(c, kDigits);
        if (digit < 0)
            return std::nullopt;
        bits = bits << 6 | static_cast<std::uint32_t>(digit);
        if ((count += 6) >= 8)
            bytes.push_back(static_cast<std::uint8_t>(bits >> (count -= 8)));
    }
    return bytes;
}

std::string without_percents(std::string_view uri) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const bool is_escape = uri[i] == '%' && i + 2 < uri.size();
        const int high = is_escape ? digit_of(static_cast<char>(uri[i + 1] | 0x20), kDigits) : -1;
        const int low = is_escape ? digit_of(static_cast<char>(uri[i + 2] | 0x20), kDigits) : -1;
        const bool is_byte = high >= 0 && low >= 0;
        text += is_byte ? static_cast<char>(16 * high + low) : uri[i];
        i += is_byte ? 2 : 0;
    }
    return text;
}

} // namespace

Result<GltfChunks> gltf_chunks(ByteView file) {
    if (file.size() < 4 || word(file, 0) != kGlbMagic)
        return GltfChunks{.json = file, .binary = {}};
    if (file.size() < kGlbHeader + kGlbChunkHeader)
        return damaged(file.size(), "the GLB file is cut short; copy or export it again");
    if (word(file, 4) != 2)
        return Error{ErrorCode::unsupported_version, 4, "not glTF 2; export it as glTF 2"};
    if (word(file, 8) > file.size())
        return damaged(8, "the GLB file announces " + std::to_string(word(file, 8)) + " bytes and has " +
                              std::to_string(file.size()) + ": it is cut short; copy or export it again");
    GltfChunks chunks;
    for (std::size_t at = kGlbHeader; file.size() - at >= kGlbChunkHeader;) {
        const std::size_t length = word(file, at), kind = word(file, at + 4);
        at += kGlbChunkHeader;
        if (length > file.size() - at)
            return damaged(at - kGlbChunkHeader, "a chunk goes beyond the end of the GLB file; export it again");
        if (kind == kJsonChunk && chunks.json.empty())
            chunks.json = file.subspan(at, length);
        if (kind == kBinaryChunk && chunks.binary.empty())
            chunks.binary = file.subspan(at, length);
        at += length;
    }
    if (chunks.json.empty())
        return damaged(kGlbHeader, "the GLB file has no JSON; export it again");
    return chunks;
}

Result<GltfBuffer> read_uri(const std::string &gltf, std::string_view uri) {
    if (!uri.starts_with("data:")) {
        const std::string path = (std::filesystem::path(gltf).parent_path() / without_percents(uri)).string();
        auto file = MappedFile::open(path);
        if (!file)
            return Error{file.error().code, file.error().offset, path + ": " + file.error().message};
        return GltfBuffer{.file = std::move(*file)};
    }
    const std::size_t comma = std::min(uri.find(','), uri.size());
    auto bytes = uri.substr(0, comma).ends_with(";base64") && comma < uri.size() ? from_base64(uri.substr(comma + 1))
                                                                                 : std::nullopt;
    if (!bytes)
        return damaged(0, "a data URI is not in base64; export it again");
    return GltfBuffer{.decoded = std::move(*bytes)};
}

} // namespace pbm
