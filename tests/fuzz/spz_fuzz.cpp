#include "fuzz/surface_law.h"
#include "pbm_scan/spz/spz_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    constexpr std::size_t kUnpacked = 1 << 20; // version 4 is compressed
    pbm::test::hold_surface(pbm::build::read_spz({data, size}, pbm::test::with_fields()), size, kUnpacked);
    return 0;
}
