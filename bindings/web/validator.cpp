// Validates bytes and hands findings to JavaScript.
#include <pbm/pbm.h>

extern "C" {

int pbm_web_report(void *context, const pbm_finding *finding); // callbacks.js

// As pbm_validate_memory.
pbm_code pbm_web_validate(const void *bytes, uint64_t size, pbm_validation *validation, pbm_error *error) {
    validation->report = pbm_web_report;
    return pbm_validate_memory(bytes, size, validation, error);
}
}
