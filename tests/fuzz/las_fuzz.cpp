// LAZ holds up to 200 bytes of records, which have 20 or more, in a byte.
#include "fuzz/surface_law.h"
#include "pbm_scan/las/las_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    constexpr std::size_t kPoints = 10; // of a byte
    pbm::test::hold_surface(pbm::build::read_las({data, size}, pbm::test::with_fields()), size, kPoints);
    return 0;
}
