// Per-thread objects, as thread_local. But if memory runs out this throws std::bad_alloc, while some C libraries abort
// when they cannot register the destructor of a thread_local.
#pragma once

#include <memory>
#include <new>

#include <pthread.h>

namespace pbm {

// The calling thread's object of type T, created on first use and destroyed with the thread.
template <class T> T &per_thread() {
    struct Key {
        Key() {
            if (::pthread_key_create(&number, [](void *kept) { delete static_cast<T *>(kept); }) != 0)
                throw std::bad_alloc();
        }
        pthread_key_t number{};
    };
    static const Key key;
    if (void *const kept = ::pthread_getspecific(key.number))
        return *static_cast<T *>(kept);
    auto made = std::make_unique<T>();
    if (::pthread_setspecific(key.number, made.get()) != 0)
        throw std::bad_alloc();
    return *made.release();
}

} // namespace pbm
