#include "fuzz/surface_law.h"
#include "pbm_scan/ptx/ptx_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    if (pbm::build::is_ptx({data, size}))
        pbm::test::hold_surface(pbm::build::read_ptx({data, size}, pbm::test::with_fields()), size);
    return 0;
}
