// What finds the handler of an exception in WebAssembly with threads, in place of libunwind's functions: those keep
// their state in a variable of each thread, but the code that clang 14 makes for a handler writes one for all threads.
// With them, `catch (...)` is the only handler that is ever found. Two threads that look for one at the same moment may
// miss it; handlers with a type only run where a call of the interface ends, or memory does.
// Based on: WebAssembly tool conventions. Exception handling. 2022
#include <cstdint>
#include <unwind.h>

extern "C" {

struct LandingPad {
    std::uintptr_t index, table; // written by the code of the handler
    std::uintptr_t selector;     // read by it
};
LandingPad __wasm_lpad_context;

_Unwind_Reason_Code __gxx_personality_wasm0(int version, _Unwind_Action actions, std::uint64_t kind,
                                            _Unwind_Exception *exception, _Unwind_Context *context);

_Unwind_Reason_Code _Unwind_CallPersonality(void *exception) {
    auto *const thrown = static_cast<_Unwind_Exception *>(exception);
    __wasm_lpad_context.selector = 0;
    return __gxx_personality_wasm0(1, _UA_CLEANUP_PHASE, thrown->exception_class, thrown,
                                   reinterpret_cast<_Unwind_Context *>(&__wasm_lpad_context));
}

// Called by the personality, with the address of __wasm_lpad_context.
_Unwind_Word _Unwind_GetIP(_Unwind_Context *context) {
    return reinterpret_cast<const LandingPad *>(context)->index + 2; // numbers from 1; it goes back to the call
}
void *_Unwind_GetLanguageSpecificData(_Unwind_Context *context) {
    return reinterpret_cast<void *>(reinterpret_cast<const LandingPad *>(context)->table);
}
_Unwind_Ptr _Unwind_GetRegionStart(_Unwind_Context *) { return 0; }
void _Unwind_SetGR(_Unwind_Context *context, int index, _Unwind_Word value) {
    if (index == 1)
        reinterpret_cast<LandingPad *>(context)->selector = value;
}
void _Unwind_SetIP(_Unwind_Context *, _Unwind_Word) {}

_Unwind_Reason_Code _Unwind_RaiseException(_Unwind_Exception *exception) { __builtin_wasm_throw(0, exception); }
void _Unwind_DeleteException(_Unwind_Exception *exception) {
    if (exception->exception_cleanup != nullptr)
        exception->exception_cleanup(_URC_FOREIGN_EXCEPTION_CAUGHT, exception);
}
}
