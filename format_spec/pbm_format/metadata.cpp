// The one place of the format library that reads JSON.
#include "pbm_format/layout.h"

#include <nlohmann/json.hpp>

namespace pbm {

Status check_metadata(ByteView bytes) {
    constexpr int kMostNesting = 32;
    if (bytes.size() > kMaxMetadataBytes)
        return Error{ErrorCode::bad_section, 0, "3.3.1 metadata is longer than 4,096 bytes"};
    bool too_deep = false;
    const auto watch_depth = [&](int depth, nlohmann::json::parse_event_t, const nlohmann::json &) {
        too_deep |= depth > kMostNesting;
        return true;
    };
    const bool byte_order_mark = !bytes.empty() && bytes[0] == 0xEF;
    const auto parsed = nlohmann::json::parse(bytes.begin(), bytes.end(), watch_depth, false);
    if (parsed.is_discarded() || byte_order_mark || too_deep)
        return Error{ErrorCode::bad_section, 0, "3.3.2 metadata is not JSON"};
    if (!parsed.is_object())
        return Error{ErrorCode::bad_section, 0, "3.3.3 metadata is not a JSON object"};
    return {};
}

} // namespace pbm
