#include "system/threads/large_stack.h"

#ifdef __GLIBC__
#include <pthread.h>
#include <thread>
#endif

namespace pbm {

int run_with_large_stack(const std::function<int()> &program) {
#ifdef __GLIBC__
    constexpr std::size_t kLarge = std::size_t{8} << 20;
    pthread_attr_t attributes;
    if (::pthread_getattr_default_np(&attributes) != 0)
        return program();
    std::size_t size = kLarge; // of threads' stacks, which is the shell's limit
    ::pthread_attr_getstacksize(&attributes, &size);
    int code = 0;
    if (size < kLarge && ::pthread_attr_setstacksize(&attributes, kLarge) == 0 &&
        ::pthread_setattr_default_np(&attributes) == 0)
        std::thread([&] { code = program(); }).join();
    else
        code = program();
    ::pthread_attr_destroy(&attributes);
    return code;
#else
    return program();
#endif
}

} // namespace pbm
