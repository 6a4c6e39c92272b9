#include "check_mutations/removed_check.h"

#include <cstdlib>

namespace pbm {

const int removed_check = [] {
    const char *number = std::getenv("PBM_REMOVED_CHECK");
    return number == nullptr ? 0 : std::atoi(number);
}();

} // namespace pbm
