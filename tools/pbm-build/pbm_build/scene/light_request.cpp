#include "pbm_build/scene/light_request.h"

#include "pbm_scan/surface/refusal.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace pbm::build {
namespace {

constexpr double kMaxIntensity = 1e6, kMaxExponent = 1024; // BVG.md 3.7
constexpr std::array<std::string_view, 3> kKinds{"directional", "point", "spot"};
constexpr std::array<std::string_view, 4> kSets{"two", "studio", "sun", "stage"};

double longest_of(const Vector &v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

// Divides by the largest coordinate first, so that the length does not overflow; zero stays zero.
Vector unit(const Vector &v) {
    const double longest = longest_of(v);
    if (longest == 0)
        return v;
    const Vector scaled = v / longest;
    return scaled / glm::length(scaled);
}

std::array<float, 3> as_floats(const glm::vec3 &v) { return {v.x, v.y, v.z}; }

Result<double> read_between(std::string_view text, double least, double most) {
    Result<double> number = read_number(text);
    if (number && (*number < least || *number > most))
        return usage_error(in_quotes(text) + " is not within " + std::to_string(static_cast<int>(least)) + ".." +
                           std::to_string(static_cast<int>(most)));
    return number;
}

Status set_vector(std::string_view text, bool may_be_zero, std::optional<Vector> &to) {
    const Result<Vector> vector = read_vector(text);
    if (!vector)
        return vector.error();
    if (!may_be_zero && *vector == Vector{})
        return usage_error(in_quotes(text) + " has the length zero");
    constexpr double kFarthest = 1e30; // of coordinates that can be built at all (grid_choice.h)
    if (longest_of(*vector) > kFarthest)
        return usage_error(in_quotes(text) + " is too far away");
    to = *vector;
    return {};
}

Status set_intensity(std::string_view text, Vector &to) {
    if (text.find(',') == std::string_view::npos) {
        const Result<double> number = read_between(text, 0, kMaxIntensity);
        if (!number)
            return number.error();
        to = Vector(*number);
        return {};
    }
    if (Status read = take(read_vector(text), to); !read)
        return read;
    for (int channel = 0; channel < 3; ++channel)
        if (to[channel] < 0 || to[channel] > kMaxIntensity)
            return usage_error(in_quotes(text) + " is not within 0..1000000");
    return {};
}

Status set_field(const OptionFields::Field &field, LightRequest &light, Rgb8 &colour) {
    const auto &[key, value] = field;
    const bool directional = light.kind == LightKind::directional, spot = light.kind == LightKind::spot;
    if (key == "from")
        return set_vector(value, !directional, light.from);
    if (key == "position" && !directional)
        return set_vector(value, true, light.position);
    if (key == "direction" && light.kind != LightKind::point)
        return set_vector(value, false, light.direction);
    if (key == "target" && spot)
        return set_vector(value, true, light.target);
    if (key == "exponent" && spot)
        return take(read_between(value, 0, kMaxExponent), light.exponent);
    if (key == "intensity")
        return set_intensity(value, light.intensity);
    if (key == "colour" || key == "color")
        return take(read_colour(value), colour);
    if (key == "size")
        return take(read_between(value, 0, 2), light.size);
    if (key == "shadows" && (value == "on" || value == "off")) {
        light.shadows = value == "on";
        return {};
    }
    if (key == "shadows")
        return usage_error(in_quotes(value) + " is neither on nor off");
    std::string keys = directional ? "direction, from" : "position, from";
    keys += spot ? ", direction, target, exponent" : "";
    const std::string kind(kKinds[static_cast<std::size_t>(light.kind)]);
    return usage_error(kind + " lights have no " + in_quotes(key) + ", but " + keys +
                       ", intensity, colour, shadows, size");
}

// Verifies that place and direction are given exactly once.
Status check_whole(const LightRequest &light) {
    const bool directional = light.kind == LightKind::directional;
    const std::string place = directional ? "direction" : "position";
    if (light.from.has_value() == (directional ? light.direction : light.position).has_value())
        return usage_error(light.from ? in_quotes(place) + " and 'from' say the same; keep one of them"
                                      : "it needs " + place + "=X,Y,Z, or from=RIGHT,UP,FRONT in radii of the model");
    if (light.direction && light.target)
        return usage_error("'direction' and 'target' say the same; keep one of them");
    if (light.target && light.position == light.target)
        return usage_error("'position' and 'target' are the same place");
    if (light.kind == LightKind::spot && light.from == Vector{} && !light.direction && !light.target)
        return usage_error("it stands in the centre of the model and aims there; give direction=X,Y,Z");
    return {};
}

LightRequest from(LightKind kind, Vector place, double intensity) {
    LightRequest light;
    light.kind = kind;
    light.from = place;
    light.intensity = Vector(intensity);
    return light;
}

} // namespace

Result<LightRequest> read_light(std::string_view text) {
    const Result<OptionFields> fields = split_fields(text);
    if (!fields)
        return fields.error();
    const auto kind = std::find(kKinds.begin(), kKinds.end(), fields->word);
    if (kind == kKinds.end())
        return usage_error(in_quotes(fields->word) + " is no kind of light" + suggestion(kKinds));
    LightRequest light;
    light.kind = static_cast<LightKind>(kind - kKinds.begin());
    Rgb8 colour{255, 255, 255};
    for (const OptionFields::Field &field : fields->fields)
        if (Status set = set_field(field, light, colour); !set)
            return usage_error(field.key + ": " + set.error().message);
    if (Status whole = check_whole(light); !whole)
        return whole.error();
    for (int i = 0; i < 3; ++i)
        light.intensity[i] *= static_cast<double>(linear_table()[colour[static_cast<std::size_t>(i)]]) / 65535;
    return light;
}

std::span<const std::string_view> light_set_names() { return kSets; }

std::vector<LightRequest> light_set(std::string_view name) {
    using enum LightKind;
    if (name == "studio") {
        LightRequest key = from(spot, {-2.4, 2.6, 2.6}, 1.0), fill = from(directional, {0.9, 0.25, 0.5}, 0.22),
                     rim = from(spot, {1.6, 2.2, -2.6}, 0.7);
        key.exponent = 2;
        key.size = 0.12;
        rim.exponent = 2;
        fill.shadows = false;
        return {key, rim, fill};
    }
    if (name == "sun")
        return {from(directional, {-0.55, 0.75, 0.45}, 1.15)};
    if (name == "stage") {
        LightRequest left = from(spot, {-2, 3, 2}, 0.9), right = from(spot, {2.2, 2.6, 1.6}, 0.6);
        left.exponent = right.exponent = 12;
        right.intensity = {0.62, 0.55, 0.45};
        return {left, right};
    }
    return {from(directional, {-0.62, 0.6, 0.52}, 1.1), from(directional, {0.85, 0.05, 0.4}, 0.18)};
}

Light place(const LightRequest &request, const ModelFrame &frame) {
    const auto in_model = [&](const Vector &seen, double scale) {
        return (frame.right * seen.x + frame.up * seen.y + frame.front * seen.z) * scale;
    };
    Light light{.kind = request.kind, .intensity = as_floats(request.intensity), .position = {}, .direction = {}};
    if (request.kind == LightKind::directional) {
        light.direction = as_floats(unit(request.from ? in_model(*request.from, -1) : *request.direction));
        return light;
    }
    const Vector position =
        request.from ? frame.centre + in_model(*request.from, frame.radius) : *request.position - frame.origin;
    light.position = as_floats(position);
    if (request.kind == LightKind::spot) {
        const Vector target = request.target ? *request.target - frame.origin : frame.centre;
        const Vector aim = unit(request.direction ? *request.direction : target - position);
        light.direction = as_floats(aim == Vector{} ? Vector(0, 0, -1) : aim); // it stands exactly at its target
        light.exponent = static_cast<float>(request.exponent);
    } else {
        light.direction = {0, 0, -1}; // unused, but its length must not be zero
    }
    return light;
}

std::string lights_nothing(const Light &light, const ModelFrame &frame) {
    if (light.intensity == std::array<float, 3>{})
        return "its intensity is 0: it lights nothing";
    if (light.kind != LightKind::spot)
        return {};
    const Vector aim{light.direction[0], light.direction[1], light.direction[2]};
    const Vector position{light.position[0], light.position[1], light.position[2]};
    if (glm::dot(frame.centre - position, aim) <= -frame.radius)
        return "it points away from the model: it lights nothing of it";
    return {};
}

} // namespace pbm::build
