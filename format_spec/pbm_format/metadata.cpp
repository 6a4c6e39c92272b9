// The one place of the format library that reads JSON.
#include "pbm_format/catalogue.h"
#include "pbm_format/layout.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <set>

namespace pbm {

Status check_metadata(ByteView bytes) {
    constexpr int kMostNesting = 32;
    using Event = nlohmann::json::parse_event_t;
    if (bytes.size() > kMaxMetadataBytes)
        return broken("3.3.1", 0, "metadata is longer than 4,096 bytes", kMaxMetadataBytes, bytes.size());
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
        return broken("3.3.2", 0, "metadata is not JSON");
    if (!parsed.is_object())
        return broken("3.3.3", 0, "metadata is not a JSON object", "object", parsed.type_name());
    return {};
}

std::vector<MetadataMember> list_metadata(ByteView bytes) {
    using Event = nlohmann::json::parse_event_t;
    std::vector<MetadataMember> members;
    std::vector<std::set<std::string>> open; // keys of the objects around
    const auto note = [&](int, Event event, const nlohmann::json &value) {
        if (event == Event::object_start)
            open.emplace_back();
        else if (event == Event::object_end)
            open.pop_back();
        else if (event == Event::key)
            members.push_back({value.get<std::string>(), "", !open.back().insert(value.get<std::string>()).second});
        else if (event == Event::value && value.is_string() && !members.empty())
            members.back().text = value.get<std::string>();
        return true;
    };
    const auto parsed = nlohmann::json::parse(bytes.begin(), bytes.end(), note, false);
    assert(!parsed.is_discarded());
    static_cast<void>(parsed);
    return members;
}

} // namespace pbm
