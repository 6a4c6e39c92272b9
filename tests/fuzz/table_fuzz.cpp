#include "fuzz/surface_law.h"
#include "pbm_scan/table/pcd_reader.h"
#include "pbm_scan/table/text_cloud.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    constexpr std::size_t kUnpacked = 88; // bytes of a byte of LZF
    pbm::test::hold_surface(pbm::build::read_pcd({data, size}, pbm::test::with_fields()), size, kUnpacked);
    pbm::test::hold_surface(pbm::build::read_text_cloud({data, size}, pbm::test::with_fields()), size);
    return 0;
}
