// The bytes of a glTF file before anybody reads its JSON: the chunks of a GLB, and what a URI stands for.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (sections 3.6 and 4.4)
#pragma once

#include "system/bytes.h"
#include "system/error.h"
#include "system/files/mapped_file.h"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace pbm {

struct GltfChunks {
    ByteView json, binary;        // binary: empty without such a chunk
    std::size_t bytes_behind = 0; // behind the end that the header states
    bool has_further = false;     // chunks of other kinds, or several of one
    bool is_miscounted = false;   // a length leaves out the bytes that fill its chunk up to a multiple of four
};

// The chunks of a GLB, or all of the file as JSON.
//
// errors  bad_input            cut short, or without JSON
//         unsupported_version  glTF 1
Result<GltfChunks> gltf_chunks(ByteView file);

// The bytes that a URI of a glTF file stands for.
struct GltfResource {
    std::optional<MappedFile> file{}; // if it names a file
    Bytes decoded{};                  // if it holds the bytes itself, as a data: URI does
    ByteView bytes() const { return file ? file->bytes() : ByteView(decoded); }
};
inline bool is_data_uri(std::string_view uri) { return uri.starts_with("data:"); }
// errors  bad_input  not in base64
Result<GltfResource> read_data_uri(std::string_view uri);
// Of a URI that names a file: its name.
std::string without_percents(std::string_view uri);

} // namespace pbm
