#include "system/threads/cancellation.h"

#include <utility>

namespace pbm {
namespace {

thread_local const std::atomic<bool> *cancellation_flag = nullptr;

} // namespace

CancellationScope::CancellationScope(const std::atomic<bool> *flag) : outer_(std::exchange(cancellation_flag, flag)) {}
CancellationScope::~CancellationScope() { cancellation_flag = outer_; }

const std::atomic<bool> *CancellationScope::current() { return cancellation_flag; }

void check_cancelled() {
    if (cancellation_flag != nullptr && *cancellation_flag)
        throw Cancelled();
}

} // namespace pbm
