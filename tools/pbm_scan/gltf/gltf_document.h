// A glTF file: its JSON, buffers, and typed arrays (accessors).
// Based on: Khronos Group. glTF 2.0 Specification. 2021
#pragma once

#include "pbm_scan/gltf/gltf_json.h"
#include "pbm_scan/surface/scan_format.h"
#include "system/bytes.h"
#include "system/error.h"
#include "system/files/mapped_file.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pbm::build {

// A JSON text larger than this is refused.
inline constexpr std::size_t kMaxGltfJson = std::size_t{256} << 20;

// What a URI of a glTF file names.
struct GltfResource {
    std::optional<MappedFile> file{};    // a file beside the scan
    std::vector<std::uint8_t> decoded{}; // else bytes in the URI itself
    ByteView bytes() const { return file ? file->bytes() : ByteView(decoded); }
};

// The file that a URI names, without its percent signs; nothing for data in the URI, or if there is no such file.
std::optional<std::string> file_of_uri(const std::string &scan, const std::string &uri);

class GltfDocument {
  public:
    // Refers to `file`. A file of JSON, or a GLB.
    //
    // errors  bad_input            damaged or cut short
    //         unsupported_version  glTF 1
    static Result<GltfDocument> open(const ScanFile &file);

    const Json *root(const char *key) const { return member(&json_, key); }
    const std::string &path() const { return path_; }
    // Of the file and of the files and data URIs that were read.
    std::uint64_t bytes() const { return size_ + further_bytes_; }
    // Lines about the file as a whole.
    const std::vector<AttributeReport> &report() const { return report_; }

    // What `uri` names, or bytes that it holds itself.
    Result<GltfResource> resource(const std::string &uri) const;

    // The bytes of a buffer view; decompressed (EXT_meshopt_compression) where it says so.
    struct View {
        ByteView bytes;
        std::size_t stride = 0; // 0: none given
    };
    Result<View> view(std::size_t index);

    // Elements of an accessor, one after the other; integers as they are, or divided by their maximum where the
    // accessor says so. `components`: wanted per element; absent ones of a shorter element are `filled`.
    //
    // errors  bad_input  damaged
    //         too_large  accessors want many more numbers than the file has bytes
    Result<std::vector<float>> floats(std::size_t accessor, std::size_t components, float filled = 1);
    Result<std::vector<std::uint32_t>> indices(std::size_t accessor);
    // errors  bad_input  the accessor announces elements that are not there
    Status verify(std::size_t accessor);
    // Elements of an accessor, without reading it: untrusted before `verify`.
    std::size_t count(std::size_t accessor) const;
    bool is_normalised(std::size_t accessor) const;
    int component_type(std::size_t accessor) const;

  private:
    // An accessor's elements in memory.
    struct Elements {
        ByteView bytes; // of all elements; empty: all are zero
        std::size_t stride = 0, count = 0, components = 0;
        int type = 0;
        bool is_normalised = false;
    };

    GltfDocument(Json json, ByteView binary, std::string path, std::size_t size)
        : json_(std::move(json)), binary_(binary), path_(std::move(path)), size_(size) {}

    Result<ByteView> buffer(std::size_t index);
    Result<View> decompressed(const Json &extension, std::size_t index);
    Result<Elements> elements(std::size_t accessor);
    // Bytes that element i of a view takes, or an error naming `what`.
    Result<ByteView> part(std::size_t view, std::size_t offset, std::size_t bytes, const std::string &what);

    Json json_;
    ByteView binary_; // chunk of a GLB
    std::string path_;
    std::size_t size_;                              // of the file, which bounds what accessors without data may claim
    std::uint64_t further_bytes_ = 0, numbers_ = 0; // of other files; read from accessors
    std::vector<AttributeReport> report_;
    std::map<std::size_t, GltfResource> resources_;                 // of buffers
    std::map<std::size_t, std::vector<std::uint8_t>> decompressed_; // views
};

} // namespace pbm::build
