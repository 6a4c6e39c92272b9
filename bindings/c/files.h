// Models of files.
#pragma once

#include "boundary.h"

namespace pbm::c_api {

// As add_model; errors name the file.
Status add_file(const char *path, pbm_model **model);

} // namespace pbm::c_api
