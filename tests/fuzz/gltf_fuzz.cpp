#include "fuzz/surface_law.h"
#include "pbm_scan/gltf/gltf_reader.h"

// Accessors without data, and meshes that several nodes show, have more elements than bytes; the reader limits them to
// 2^24 more, which is too slow here.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    constexpr std::size_t kMax = std::size_t{1} << 25;
    if (size != 0)
        pbm::test::hold_surface(pbm::build::read_gltf({{data, size}}, {}), size, kMax);
    return 0;
}
