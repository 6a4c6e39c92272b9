// A glTF file: its JSON, its buffers, and its typed arrays, which glTF calls accessors.
// Based on: Khronos Group. glTF 2.0 Specification. 2021
#pragma once

#include "pbm_scan/gltf/gltf_json.h"
#include "pbm_scan/surface/scan_format.h"
#include "system/bytes.h"
#include "system/error.h"
#include "system/files/gltf_bytes.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pbm::build {

// Bytes. A file with a larger JSON text is refused.
inline constexpr std::size_t kMaxGltfJson = std::size_t{256} << 20;

// The file that a URI names, without its percent signs; nothing for data in the URI, or if the scan has no place.
std::optional<NamedFile> file_of_uri(const std::string &scan, const std::string &uri);

class GltfDocument {
  public:
    // Opens a file of JSON (.gltf) or its binary form (.glb). The document refers to `file`, which must outlive it.
    //
    // errors  bad_input            damaged or cut short
    //         unsupported_version  glTF 1
    static Result<GltfDocument> open(const ScanFile &file);

    const Json &root() const { return json_; }
    const Json *root(const char *key) const { return member(&json_, key); }
    const std::string &path() const { return path_; }
    // Of the file and of the files and data URIs that were read.
    std::uint64_t bytes() const { return size_ + further_bytes_; }
    // Lines about the file as a whole.
    const std::vector<AttributeReport> &report() const { return report_; }

    // Opens the file that `uri` names, or decodes the bytes that it holds.
    Result<GltfResource> resource(const std::string &uri) const;

    // The bytes of a buffer view. A view with EXT_meshopt_compression is decompressed.
    struct View {
        ByteView bytes;
        std::size_t stride = 0; // bytes from one element to the next; 0: elements follow each other without gap
    };
    Result<View> view(std::size_t index);

    // The elements of an accessor as floats: [count][components]. Normalised integers are divided by the largest value
    // of their type, other integers are converted. If an element of the file is shorter than `components`, the rest is
    // `filled`; if it is longer, its further components are left out.
    //
    // errors  bad_input  damaged
    //         too_large  accessors want many more numbers than the file has bytes
    Result<std::vector<float>> floats(std::size_t accessor, std::size_t components, float filled = 1);
    Result<std::vector<std::uint32_t>> indices(std::size_t accessor);
    // errors  bad_input  the accessor announces elements that are not there
    Status verify(std::size_t accessor);
    // The number of elements of an accessor, as its JSON states it; reads no buffer, so it is untrusted before
    // `verify`.
    std::size_t count(std::size_t accessor) const;
    bool is_normalised(std::size_t accessor) const;
    int component_type(std::size_t accessor) const;

  private:
    // Where the elements of an accessor lie in memory.
    struct Elements {
        ByteView bytes; // of all elements; empty if the accessor has no buffer view: then all elements are zero
        std::size_t stride = 0, count = 0, components = 0;
        int type = 0;
        bool is_normalised = false;
    };

    GltfDocument(Json json, ByteView binary, std::string path, std::size_t size)
        : json_(std::move(json)), binary_(binary), path_(std::move(path)), size_(size) {}

    Result<ByteView> buffer(std::size_t index);
    Result<View> decompressed(const Json &extension, std::size_t index);
    Result<Elements> elements(std::size_t accessor);
    template <class Change> Status for_sparse(std::size_t accessor, const Elements &from, const Change &change);
    // `bytes` bytes of a view from `offset` on. An error names `what` if they lie outside of the view.
    Result<ByteView> part(std::size_t view, std::size_t offset, std::size_t bytes, const std::string &what);

    Json json_;
    ByteView binary_; // the binary chunk of a GLB
    std::string path_;
    std::size_t size_;                // of the file; bounds the count of accessors without a buffer view
    std::uint64_t further_bytes_ = 0; // of other files
    std::uint64_t numbers_ = 0;       // read from accessors
    std::uint64_t unpacked_ = 0;      // bytes of compressed views
    std::vector<AttributeReport> report_;
    std::map<std::size_t, GltfResource> resources_;                 // [index of a buffer]
    std::map<std::size_t, std::vector<std::uint8_t>> decompressed_; // [index of a buffer view]
};

} // namespace pbm::build
