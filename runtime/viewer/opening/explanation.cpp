#include "viewer/opening/explanation.h"

#include <utility>

namespace pbm {
namespace {

constexpr const char *kCopyAnew = "Copy or download the file again, or build it anew with pbm-build.";
constexpr const char *kBuildAnew = "Build the file anew with pbm-build; pbm-validate lists all damage.";

std::string sentence(std::string text) {
    if (!text.empty() && text[0] >= 'a' && text[0] <= 'z')
        text[0] = static_cast<char>(text[0] - 'a' + 'A');
    return text.empty() || text.back() == '.' ? text : text + '.';
}

// The message without the rule that it starts with, and the advice that it ends with, else `advice`.
std::pair<std::string, std::string> own_words(const Error &error, const char *advice) {
    std::string text = error.message;
    if (!error.rule.empty() && text.starts_with(error.rule))
        text.erase(0, error.rule.size() + 1);
    const std::size_t end = text.rfind("; ");
    if (end == std::string::npos)
        return {sentence(text), advice};
    return {sentence(text.substr(0, end)), sentence(text.substr(end + 2))};
}

std::pair<std::string, std::string> in_words(const Error &error) {
    switch (error.code) {
    case ErrorCode::not_bvg: return {"This file is not a model of PBM.", "Open a .pbvg file or a scan."};
    case ErrorCode::truncated:
        return {"The file has another length than it should: it was cut off, or it is still being written.", kCopyAnew};
    case ErrorCode::bad_hash: return {"The file is damaged: bytes were changed after it was written.", kCopyAnew};
    case ErrorCode::too_large: return {"The file exceeds the limits of the format.", kBuildAnew};
    case ErrorCode::unsupported_version:
        return {"The file has a format version that this program does not read.", "Install a newer version of PBM."};
    case ErrorCode::unsupported_feature:
        return own_words(error, "Install a newer version of PBM, or convert the file.");
    case ErrorCode::io: return own_words(error, "Check the file's name, its permissions and the disk.");
    case ErrorCode::memory: return own_words(error, "End other programs, or show a smaller model.");
    case ErrorCode::bad_input: return own_words(error, "Export or copy the scan again.");
    default: break;
    }
    if (is_damage(error.code))
        return {"The file contradicts itself: it is damaged, or a faulty program wrote it.", kBuildAnew};
    return own_words(error, "");
}

} // namespace

Explanation explain(const Error &error) {
    auto [what, advice] = in_words(error);
    Explanation explanation{std::move(what), std::move(advice)};
    if (own_words(error, "").first != explanation.what)
        explanation.details.push_back(error.message);
    if (has_offset(error))
        explanation.details.push_back("Byte " + std::to_string(error.offset) + " of the file");
    if (!error.rule.empty())
        explanation.details.push_back("Rule " + std::string(error.rule) + " of BVG.md" +
                                      (error.name.empty() ? "" : ", code " + std::string(error.name)));
    return explanation;
}

} // namespace pbm
