#include "sample_model.h"

#include <filesystem>
#include <system_error>

namespace pbm {

Result<std::string> sample_model() {
    namespace fs = std::filesystem;
    std::error_code ignored;
    const fs::path program = fs::read_symlink("/proc/self/exe", ignored);
    const fs::path sample = (program.parent_path() / PBM_SAMPLE_FROM_PROGRAM).lexically_normal();
    if (fs::is_regular_file(sample, ignored))
        return sample.string();
    return Error{ErrorCode::io, 0,
                 "no FILE is named and the sample " + sample.string() +
                     " is not there; make one: pbm-sample -o sample.ply && pbm-build sample.ply -o sample.pbvg"};
}

} // namespace pbm
