// Linked into pbm-build: the environment variable PBM_TEST_TARGET selects a SIMD target of the processor before main
// starts. "list" prints the available targets, one number and name per line.
#include <hwy/targets.h>

#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace {

[[maybe_unused]] const bool kChosen = [] {
    const char *wanted = std::getenv("PBM_TEST_TARGET");
    if (wanted == nullptr)
        return false;
    if (std::string_view(wanted) == "list") {
        for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1)
            std::printf("%lld %s\n", static_cast<long long>(left & -left), hwy::TargetName(left & -left));
        std::exit(0);
    }
    hwy::SetSupportedTargetsForTest(std::atoll(wanted));
    return true;
}();

} // namespace
