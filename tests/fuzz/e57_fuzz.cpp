// The input is what lies in the pages: a checksum that fits is added to each, since nearly every other file is refused
// for its checksums.
#include "fuzz/surface_law.h"
#include "pbm_scan/e57/e57_reader.h"
#include "unit/scan/e57_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    const std::string file = pbm::test::e57_with_length({reinterpret_cast<const char *>(data), size});
    constexpr std::size_t kTrianglesOfPoint = 2;
    pbm::test::hold_surface(pbm::build::read_e57({reinterpret_cast<const std::uint8_t *>(file.data()), file.size()},
                                                 pbm::test::with_fields()),
                            file.size(), kTrianglesOfPoint);
    return 0;
}
