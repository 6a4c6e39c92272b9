#include "pbm_format/law/catalogue.h"

#include <algorithm>

namespace pbm {

std::string_view to_string(Severity severity) {
    switch (severity) {
    case Severity::info: return "info";
    case Severity::warning: return "warning";
    case Severity::error: return "error";
    }
    return "unknown";
}

std::span<const CatalogueEntry> catalogue() { return kCatalogue; }

const CatalogueEntry *find_code(std::string_view name) {
    const auto found = std::find_if(kCatalogue.begin(), kCatalogue.end(),
                                    [&](const CatalogueEntry &entry) { return entry.name == name; });
    return found == kCatalogue.end() ? nullptr : &*found;
}

const CatalogueEntry *find_rule(std::string_view rule) {
    const auto found = std::find_if(kCatalogue.begin(), kCatalogue.end(),
                                    [&](const CatalogueEntry &entry) { return entry.stands_for(rule); });
    return found == kCatalogue.end() ? nullptr : &*found;
}

const CatalogueEntry *entry_of(const Error &error) {
    // Errors from `broken` share the name's string with their entry.
    for (const CatalogueEntry &entry : kCatalogue)
        if (entry.name.data() == error.name.data())
            return &entry;
    if (const CatalogueEntry *entry = find_code(error.name))
        return entry;
    return find_code(error.code == ErrorCode::io ? "io.read" : "system.memory");
}

Error broken(Reason reason, std::uint64_t offset, std::string_view text, Value expected, Value actual) {
    std::string message;
    message.reserve(reason.rule().size() + 1 + text.size());
    message = reason.rule();
    message += message.empty() ? "" : " ";
    message += text;
    return {.code = reason.code().kind,
            .offset = offset,
            .message = std::move(message),
            .name = reason.code().name,
            .rule = reason.rule(),
            .expected = std::move(expected),
            .actual = std::move(actual)};
}

Error broken(Wording wording, Reason reason, std::uint64_t offset, std::string_view text, Value expected,
             Value actual) {
    if (wording == Wording::none)
        return {.code = reason.code().kind, .offset = offset, .name = reason.code().name, .rule = reason.rule()};
    return broken(reason, offset, text, std::move(expected), std::move(actual));
}

} // namespace pbm
