// The one place of the format library that reads JSON.
#include "pbm_format/layout.h"

#include <nlohmann/json.hpp>

namespace pbm {

Status check_metadata(ByteView bytes) {
    if (bytes.size() > kMaxMetadataBytes)
        return Error{ErrorCode::bad_section, 0, "3.3.1 metadata is longer than 4,096 bytes"};
    const auto parsed = nlohmann::json::parse(bytes.begin(), bytes.end(), nullptr, false);
    if (parsed.is_discarded())
        return Error{ErrorCode::bad_section, 0, "3.3.2 metadata is not JSON"};
    if (!parsed.is_object())
        return Error{ErrorCode::bad_section, 0, "3.3.3 metadata is not a JSON object"};
    return {};
}

} // namespace pbm
