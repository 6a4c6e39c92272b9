#include "viewer/command_line.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>

namespace pbm {
namespace {

struct OldSwitch {
    std::string_view name;
    std::string_view option; // today's spelling; empty: not there yet
};

constexpr std::array<OldSwitch, 7> kOldSwitches{{{"-IGNORE_POINT_COLOURS", "--ignore-point-colours"},
                                                 {"-AVI", ""},
                                                 {"-FLYING_CAMERA", ""},
                                                 {"-BACKGROUND", ""},
                                                 {"-SHADOW", ""},
                                                 {"-TEXTURE", ""},
                                                 {"-ENVIRONMENT_MAP", ""}}};

// `count` finite numbers with one of `separators` between them.
std::optional<std::vector<double>> parse_numbers(std::string_view text, std::string_view separators,
                                                 std::size_t count) {
    std::vector<double> numbers;
    const char *at = text.data();
    const char *const end = at + text.size();
    while (true) {
        double number = 0;
        const auto [after, error] = std::from_chars(at, end, number);
        if (error != std::errc() || !std::isfinite(number))
            return std::nullopt;
        numbers.push_back(number);
        if (after == end)
            break;
        if (separators.find(*after) == std::string_view::npos)
            return std::nullopt;
        at = after + 1;
    }
    if (numbers.size() != count)
        return std::nullopt;
    return numbers;
}

Error usage(std::string message) { return {ErrorCode::usage, 0, std::move(message)}; }

} // namespace

Result<std::vector<std::string>> modern_arguments(int argc, const char *const *argv) {
    std::vector<std::string> arguments;
    for (int i = 1; i < argc; ++i) {
        std::string argument = argv[i];
        for (const OldSwitch &old : kOldSwitches) {
            if (argument != old.name)
                continue;
            if (old.option.empty())
                return usage(argument + " is not supported yet; leave it out");
            argument = old.option;
            break;
        }
        arguments.push_back(argument == "--json" ? "--json=-" : std::move(argument));
    }
    return arguments;
}

Result<glm::ivec2> parse_resolution(const std::string &text) {
    const auto numbers = parse_numbers(text, ",x", 2);
    const auto is_edge = [](double n) { return n >= 1 && n <= kMaxPictureEdge && n == std::floor(n); };
    if (!numbers || !is_edge((*numbers)[0]) || !is_edge((*numbers)[1]))
        return usage("'" + text + "' is no resolution; write 1280,720 or 1280x720, at most " +
                     std::to_string(kMaxPictureEdge) + " each");
    return glm::ivec2((*numbers)[0], (*numbers)[1]);
}

Result<glm::dvec3> parse_vector(const std::string &text) {
    const auto numbers = parse_numbers(text, ",", 3);
    if (!numbers)
        return usage("'" + text + "' is no vector; write three numbers like 0,0.5,-2");
    return glm::dvec3((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

Result<Rgba8> parse_colour(const std::string &text) {
    const auto numbers = parse_numbers(text, ",", 3);
    Rgba8 colour{0, 0, 0, 255};
    for (std::size_t i = 0; i < 3; ++i) {
        if (!numbers || (*numbers)[i] < 0 || (*numbers)[i] > 1)
            return usage("'" + text + "' is no colour; write three numbers from 0 to 1 like 0.2,0.2,0.2");
        colour[i] = static_cast<std::uint8_t>(std::lround((*numbers)[i] * 255));
    }
    return colour;
}

Result<std::uint64_t> parse_bytes(const std::string &text) {
    std::uint64_t number = 0;
    const char *const end = text.data() + text.size();
    const auto [after, error] = std::from_chars(text.data(), end, number);
    constexpr std::string_view kUnits = "kMGT";
    std::size_t shift = 0;
    const char *rest = after;
    if (error == std::errc() && rest != end) {
        const std::size_t unit = kUnits.find(*rest == 'K' ? 'k' : *rest);
        if (unit != std::string_view::npos) {
            shift = 10 * (unit + 1);
            ++rest;
        }
    }
    if (error != std::errc() || rest != end || number == 0 || number > std::uint64_t{1} << (63 - shift))
        return usage("'" + text + "' is no amount of memory; write bytes like 500M or 8G");
    return number << shift;
}

std::string_view advice(ErrorCode code) {
    switch (code) {
    case ErrorCode::memory: return "; allow more with --max-memory or draw a coarser --level";
    case ErrorCode::unsupported_version:
    case ErrorCode::unsupported_feature: return "; a newer pbm-render is needed";
    case ErrorCode::usage:
    case ErrorCode::io:
    case ErrorCode::not_bvg: return ""; // the message says it
    default: return "; pbm-validate names all damage, build the file anew";
    }
}

std::string describe(const std::string &file, const Error &error) {
    std::string text = file + ": " + error.message + std::string(advice(error.code));
    if (error.offset != 0)
        text += " (offset " + std::to_string(error.offset) + ")";
    return text;
}

} // namespace pbm
