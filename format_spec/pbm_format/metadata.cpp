// The one place of the format library that reads JSON.
#include "pbm_format/layout.h"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace pbm {

Status check_metadata(ByteView bytes) {
    constexpr int kMostNesting = 32;
    using Event = nlohmann::json::parse_event_t;
    if (bytes.size() > kMaxMetadataBytes)
        return Error{ErrorCode::bad_section, 0, "3.3.1 metadata is longer than 4,096 bytes"};
    bool too_deep = false;
    const auto watch_depth = [&](int depth, Event event, const nlohmann::json &) {
        too_deep |= depth >= kMostNesting && (event == Event::object_start || event == Event::array_start);
        return true;
    };
    // The library skips a byte order mark and takes a zero byte for the end: neither is JSON.
    const bool foreign =
        (!bytes.empty() && bytes[0] == 0xEF) || std::find(bytes.begin(), bytes.end(), 0) != bytes.end();
    const auto parsed = nlohmann::json::parse(bytes.begin(), bytes.end(), watch_depth, false);
    if (parsed.is_discarded() || foreign || too_deep)
        return Error{ErrorCode::bad_section, 0, "3.3.2 metadata is not JSON"};
    if (!parsed.is_object())
        return Error{ErrorCode::bad_section, 0, "3.3.3 metadata is not a JSON object"};
    return {};
}

} // namespace pbm
