#include "fuzz/surface_law.h"
#include "pbm_scan/las/las_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    pbm::test::hold_surface(pbm::build::read_las({data, size}, pbm::test::with_fields()), size);
    return 0;
}
