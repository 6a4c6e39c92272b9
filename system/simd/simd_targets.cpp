// Detects the processor's Highway targets: defines the functions of Highway's library that its dispatch calls. The
// library itself would add 3 ms to every program's start, since it measures the processor's clock; its headers suffice.
// The symbols are weak, so that a program may also link the library.
#include <hwy/targets.h>

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace hwy {
namespace {

std::atomic<std::int64_t> targets_for_test{0};

std::int64_t find_targets() {
    std::int64_t targets = HWY_STATIC_TARGET;
#if HWY_ARCH_X86
    __builtin_cpu_init();
    // A processor with the last feature of a group has all features of the group that Highway uses.
    const bool ssse3 = __builtin_cpu_supports("ssse3") != 0;
    const bool sse4 = ssse3 && __builtin_cpu_supports("sse4.2") != 0 && __builtin_cpu_supports("pclmul") != 0 &&
                      __builtin_cpu_supports("aes") != 0;
    const bool avx2 = sse4 && __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("fma") != 0 &&
                      __builtin_cpu_supports("bmi") != 0 && __builtin_cpu_supports("bmi2") != 0;
    const bool avx3 = avx2 && __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
                      __builtin_cpu_supports("avx512bw") != 0 && __builtin_cpu_supports("avx512dq") != 0 &&
                      __builtin_cpu_supports("avx512cd") != 0;
    targets |= (ssse3 ? HWY_SSSE3 : 0) | (sse4 ? HWY_SSE4 : 0) | (avx2 ? HWY_AVX2 : 0) | (avx3 ? HWY_AVX3 : 0);
#endif
    return targets;
}

} // namespace

__attribute__((weak)) ChosenTarget &GetChosenTarget() {
    static ChosenTarget chosen;
    return chosen;
}

__attribute__((weak)) std::int64_t SupportedTargets() {
    static const std::int64_t targets = find_targets();
    const std::int64_t forced = targets_for_test;
    return forced != 0 ? forced : targets;
}

__attribute__((weak)) void SetSupportedTargetsForTest(std::int64_t targets) {
    targets_for_test = targets;
    GetChosenTarget().DeInit();
}

// Called by Highway's own checks, which builds with sanitizers enable.
__attribute__((weak)) void Abort(const char *file, int line, const char *, ...) {
    std::fprintf(stderr, "%s:%d: a check of Highway's failed\n", file, line);
    std::abort();
}

} // namespace hwy
