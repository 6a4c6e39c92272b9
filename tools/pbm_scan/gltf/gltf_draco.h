// Primitives of glTF that are compressed by Draco (KHR_draco_mesh_compression).
#pragma once

#include "system/bytes.h"
#include "system/error.h"

#include <cstdint>
#include <span>
#include <vector>

namespace pbm::build {

// An attribute that is wanted: its id in the Draco data, and numbers per vertex.
struct DracoRequest {
    std::uint32_t id = 0;
    std::uint32_t components = 0;
    bool is_normalised = false; // integers are divided by their maximum
};

struct DracoMesh {
    std::uint64_t vertices = 0;
    std::vector<std::uint32_t> corners;         // three of each triangle; empty for points
    std::vector<std::vector<float>> attributes; // [requests][vertices x components]
};

// Decodes in a child process (child_process.h): the data is untrusted, and libdraco may crash.
//
// errors  bad_input  damaged, or without one of the attributes
//         memory     the child reached a limit
Result<DracoMesh> decode_draco(ByteView bytes, std::span<const DracoRequest> requests);

} // namespace pbm::build
