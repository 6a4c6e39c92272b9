#include "fuzz/surface_law.h"
#include "pbm_scan/ply/ply_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    pbm::test::hold_surface(pbm::build::read_ply({{data, size}}, pbm::test::with_fields()), size);
    return 0;
}
