#include "fuzz/surface_law.h"
#include "pbm_scan/mesh/mesh_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    using namespace pbm::build;
    if (size == 0)
        return 0;
    pbm::test::hold_surface(read_obj({{data, size}}, {}), size);
    pbm::test::hold_surface(read_off({data, size}, {}), size);
    pbm::test::hold_surface(read_stl({data, size}, {}), size);
    return 0;
}
