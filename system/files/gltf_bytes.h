// The bytes of a glTF file before anybody reads its JSON: the chunks of a GLB, and what a URI stands for.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (sections 3.6 and 4.4)
#pragma once

#include "system/bytes.h"
#include "system/error.h"
#include "system/files/mapped_file.h"

#include <optional>
#include <string>
#include <string_view>

namespace pbm {

struct GltfChunks {
    ByteView json, binary; // binary: empty without such a chunk
};

// The chunks of a GLB, or all of the file as JSON.
//
// errors  bad_input            cut short, or without JSON
//         unsupported_version  glTF 1
Result<GltfChunks> gltf_chunks(ByteView file);

// A buffer: a file beside `gltf`, or the base64 text of a data: URI.
struct GltfBuffer {
    std::optional<MappedFile> file{};
    Bytes decoded{};
    ByteView bytes() const { return file ? file->bytes() : ByteView(decoded); }
};
// errors  bad_input  a data: URI that is not base64
//         io         the file cannot be opened
Result<GltfBuffer> read_uri(const std::string &gltf, std::string_view uri);

} // namespace pbm
