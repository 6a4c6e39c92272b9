// Opens models whose bytes JavaScript has.
#include <pbm/pbm.h>

extern "C" {

int pbm_web_read(void *context, uint64_t offset, uint64_t size, void *to); // callbacks.js

// As pbm_open_ranges.
pbm_code pbm_web_open(void *context, uint64_t size, pbm_model **model, pbm_error *error) {
    return pbm_open_ranges(pbm_web_read, context, size, model, error);
}
}
