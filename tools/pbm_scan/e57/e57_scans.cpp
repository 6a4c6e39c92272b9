#include "pbm_scan/e57/e57_scans.h"

#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_number.h"
#include "pbm_scan/text/words.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

namespace pbm::build {
namespace {

struct RoleName {
    std::string_view name;
    E57Role role;
};
constexpr std::array kRoleNames{
    RoleName{"cartesianX", E57Role::x},
    RoleName{"cartesianY", E57Role::y},
    RoleName{"cartesianZ", E57Role::z},
    RoleName{"sphericalRange", E57Role::range},
    RoleName{"sphericalAzimuth", E57Role::azimuth},
    RoleName{"sphericalElevation", E57Role::elevation},
    RoleName{"cartesianInvalidState", E57Role::cartesian_state},
    RoleName{"sphericalInvalidState", E57Role::spherical_state},
    RoleName{"colorRed", E57Role::red},
    RoleName{"colorGreen", E57Role::green},
    RoleName{"colorBlue", E57Role::blue},
    RoleName{"isColorInvalid", E57Role::colour_state},
    RoleName{"intensity", E57Role::intensity},
    RoleName{"nor:normalX", E57Role::nx},
    RoleName{"nor:normalY", E57Role::ny},
    RoleName{"nor:normalZ", E57Role::nz},
    RoleName{"rowIndex", E57Role::row},
    RoleName{"columnIndex", E57Role::column},
};

E57Role role_of(std::string_view name) {
    const auto found = std::find_if(kRoleNames.begin(), kRoleNames.end(), [&](auto &r) { return r.name == name; });
    return found == kRoleNames.end() ? E57Role::none : found->role;
}

Error refuse(const E57Element &element, const std::string &what) {
    return bad_input(printable(element.name) + ": " + what + "; export the scan again", element.offset);
}

template <class T> Status read_attribute(const E57Element &element, std::string_view name, T &value) {
    const std::optional<std::string_view> text = element.attribute(name);
    if (!text)
        return {};
    const std::optional<T> number = parse_all<T>(trimmed(*text, " \t\r\n"));
    if (!number)
        return refuse(element, std::string(name) + " is " + printable_in_quotes(*text) + ", which is not a number");
    value = *number;
    return {};
}

std::string_view type_of(const E57Element &element) { return element.attribute("type").value_or(""); }

Status describe_integer(const E57Element &element, E57Field &field) {
    field.minimum = std::numeric_limits<std::int64_t>::min();
    field.maximum = std::numeric_limits<std::int64_t>::max();
    if (Status status = read_attribute(element, "minimum", field.minimum); !status)
        return status;
    if (Status status = read_attribute(element, "maximum", field.maximum); !status)
        return status;
    if (field.minimum > field.maximum)
        return refuse(element, "its minimum is above its maximum");
    field.bits = static_cast<int>(
        std::bit_width(static_cast<std::uint64_t>(field.maximum) - static_cast<std::uint64_t>(field.minimum)));
    if (field.type == E57Type::integer)
        return {};
    if (Status status = read_attribute(element, "scale", field.scale); !status)
        return status;
    if (Status status = read_attribute(element, "offset", field.offset); !status)
        return status;
    if (!std::isfinite(field.scale) || field.scale == 0 || !std::isfinite(field.offset))
        return refuse(element, "its scale or its offset is no finite number, or the scale is 0");
    return {};
}

Result<E57Field> describe_field(const E57Element &element) {
    E57Field field;
    field.name = element.name;
    field.role = role_of(element.name);
    const std::string_view type = type_of(element);
    if (type == "Integer" || type == "ScaledInteger") {
        field.type = type == "Integer" ? E57Type::integer : E57Type::scaled_integer;
        if (Status status = describe_integer(element, field); !status)
            return status.error();
        const double first = static_cast<double>(field.minimum) * field.scale + field.offset;
        const double last = static_cast<double>(field.maximum) * field.scale + field.offset;
        constexpr int kWithoutLimits = 64;
        if (field.bits < kWithoutLimits) {
            field.low = std::min(first, last);
            field.high = std::max(first, last);
        }
    } else if (type == "Float") {
        const std::string_view precision = element.attribute("precision").value_or("double");
        if (precision != "single" && precision != "double")
            return refuse(element, "its precision is neither single nor double");
        field.type = precision == "single" ? E57Type::single_float : E57Type::double_float;
        field.bits = precision == "single" ? 32 : 64;
    } else if (type == "String") {
        field.type = E57Type::text;
        field.role = E57Role::none;
    } else {
        return refuse(element, "a point cannot have a field of type " + printable_in_quotes(type));
    }
    return field;
}

// The fields below the prototype, in the order of their streams: structures of a prototype have no stream of their own.
Status describe_fields(const E57Xml &xml, const E57Element &prototype, std::vector<E57Field> &fields) {
    constexpr std::size_t kMaxFields = 1024;
    std::vector<std::uint32_t> left(prototype.children.rbegin(), prototype.children.rend());
    while (!left.empty()) {
        const E57Element &element = xml.elements[left.back()];
        left.pop_back();
        if (type_of(element) == "Structure" || type_of(element) == "Vector") {
            left.insert(left.end(), element.children.rbegin(), element.children.rend());
            continue;
        }
        if (fields.size() == kMaxFields)
            return too_large("points of more than 1024 fields", element.offset);
        Result<E57Field> field = describe_field(element);
        if (!field)
            return field.error();
        const bool repeats = std::any_of(fields.begin(), fields.end(), [&](const E57Field &other) {
            return other.role == field->role && other.role != E57Role::none;
        });
        if (repeats)
            return refuse(element, "the points have this field twice");
        fields.push_back(std::move(*field));
    }
    return {};
}

Status check_codecs(const E57Xml &xml, const E57Element &points) {
    const E57Element *const codecs = xml.child(points, "codecs");
    if (codecs == nullptr)
        return {};
    for (const std::uint32_t codec : codecs->children)
        for (const std::uint32_t part : xml.elements[codec].children)
            if (const std::string &name = xml.elements[part].name; name != "inputs" && name != "bitPackCodec")
                return unsupported("the points are compressed by " + printable_in_quotes(name) +
                                   "; PBM reads bitPackCodec, which is E57's own");
    return {};
}

// What replaces the limits of the fields of colours: the element `limits`.
Status apply_limits(const E57Xml &xml, const E57Element &scan, std::string_view limits, std::vector<E57Field> &fields) {
    const E57Element *const element = xml.child(scan, limits);
    if (element == nullptr)
        return {};
    for (E57Field &field : fields) {
        const E57Element *const low = xml.child(*element, field.name + "Minimum");
        const E57Element *const high = xml.child(*element, field.name + "Maximum");
        if (low == nullptr || high == nullptr)
            continue;
        const Result<double> black = xml.number(*element, low->name, 0), white = xml.number(*element, high->name, 0);
        if (!black || !white)
            return black ? white.error() : black.error();
        if (*black < *white) {
            field.low = *black;
            field.high = *white;
        }
    }
    return {};
}

Result<std::optional<E57Scan::Pose>> describe_pose(const E57Xml &xml, const E57Element &scan) {
    const E57Element *const element = xml.child(scan, "pose");
    if (element == nullptr)
        return std::optional<E57Scan::Pose>();
    constexpr std::array<std::string_view, 4> kNames{"w", "x", "y", "z"};
    std::array<double, 4> turn{1, 0, 0, 0}, shift{};
    const E57Element *const rotation = xml.child(*element, "rotation");
    const E57Element *const translation = xml.child(*element, "translation");
    for (std::size_t i = 0; i < kNames.size(); ++i) {
        if (rotation != nullptr) {
            const Result<double> number = xml.number(*rotation, kNames[i], 0);
            if (!number)
                return number.error();
            turn[i] = *number;
        }
        if (translation != nullptr && i > 0) {
            const Result<double> number = xml.number(*translation, kNames[i], 0);
            if (!number)
                return number.error();
            shift[i] = *number;
        }
    }
    const double length = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3]);
    if (!(length > 0.5 && length < 2))
        return refuse(*rotation, "the rotation is no unit quaternion");
    E57Scan::Pose pose;
    pose.rotation = glm::dquat(turn[0] / length, turn[1] / length, turn[2] / length, turn[3] / length);
    pose.translation = glm::dvec3(shift[1], shift[2], shift[3]);
    if (!std::isfinite(pose.translation.x + pose.translation.y + pose.translation.z))
        return refuse(*translation, "the translation is not finite");
    return std::optional(pose);
}

Result<E57Scan> describe_scan(const E57Xml &xml, const E57Element &element, const E57Pages &pages) {
    E57Scan scan;
    scan.offset = element.offset;
    const E57Element *const points = xml.child(element, "points");
    if (points == nullptr)
        return refuse(element, "the scan has no points");
    const E57Element *const prototype = xml.child(*points, "prototype");
    if (type_of(*points) != "CompressedVector" || prototype == nullptr)
        return refuse(*points, "it is no compressed vector with a prototype");
    std::uint64_t at = 0;
    if (Status status = read_attribute(*points, "fileOffset", at); !status)
        return status.error();
    if (Status status = read_attribute(*points, "recordCount", scan.records); !status)
        return status.error();
    scan.section = pages.logical(at);
    if (Status status = check_codecs(xml, *points); !status)
        return status.error();
    if (Status status = describe_fields(xml, *prototype, scan.fields); !status)
        return status.error();
    if (Status status = apply_limits(xml, element, "colorLimits", scan.fields); !status)
        return status.error();
    Result<std::optional<E57Scan::Pose>> pose = describe_pose(xml, element);
    if (!pose)
        return pose.error();
    scan.pose = *pose;
    scan.has_groups = xml.child(element, "pointGroupingSchemes") != nullptr;
    return scan;
}

// Notes the elements below one that are not read.
void note_unread(const E57Xml &xml, const E57Element &parent, E57Description &description) {
    constexpr std::array<std::string_view, 7> kRead{"data3D", "images2D",    "coordinateMetadata",  "points",
                                                    "pose",   "colorLimits", "pointGroupingSchemes"};
    constexpr std::array<std::string_view, 24> kAbout{"formatName",
                                                      "guid",
                                                      "versionMajor",
                                                      "versionMinor",
                                                      "e57LibraryVersion",
                                                      "creationDateTime",
                                                      "name",
                                                      "originalGuids",
                                                      "description",
                                                      "sensorVendor",
                                                      "sensorModel",
                                                      "sensorSerialNumber",
                                                      "sensorHardwareVersion",
                                                      "sensorSoftwareVersion",
                                                      "sensorFirmwareVersion",
                                                      "temperature",
                                                      "relativeHumidity",
                                                      "atmosphericPressure",
                                                      "acquisitionStart",
                                                      "acquisitionEnd",
                                                      "indexBounds",
                                                      "cartesianBounds",
                                                      "sphericalBounds",
                                                      "intensityLimits"};
    const auto is_in = [](std::span<const std::string_view> names, const std::string &name) {
        return std::find(names.begin(), names.end(), name) != names.end();
    };
    for (const std::uint32_t child : parent.children)
        if (const std::string &name = xml.elements[child].name; !is_in(kRead, name))
            (is_in(kAbout, name) ? description.about : description.unused).insert(name);
}

} // namespace

const E57Field *E57Scan::field(E57Role role) const {
    const auto found = std::find_if(fields.begin(), fields.end(), [&](const E57Field &f) { return f.role == role; });
    return found == fields.end() ? nullptr : &*found;
}

bool E57Scan::has_all(std::initializer_list<E57Role> roles) const {
    return std::all_of(roles.begin(), roles.end(), [&](E57Role role) { return field(role) != nullptr; });
}

Result<E57Description> describe_e57(const E57Xml &xml, const E57Pages &pages) {
    E57Description description;
    const E57Element &root = xml.root();
    if (root.name != "e57Root")
        return refuse(root, "the XML section does not begin with e57Root");
    for (const auto &[key, value] : root.attributes)
        if (key.starts_with("xmlns:"))
            description.extensions.push_back(key.substr(6));
    note_unread(xml, root, description);
    if (const E57Element *const text = xml.child(root, "coordinateMetadata"))
        description.coordinates = trimmed(text->text, " \t\r\n");
    if (const E57Element *const images = xml.child(root, "images2D"))
        description.images = images->children.size();
    const E57Element *const scans = xml.child(root, "data3D");
    if (scans == nullptr)
        return description;
    for (const std::uint32_t index : scans->children) {
        note_unread(xml, xml.elements[index], description);
        Result<E57Scan> scan = describe_scan(xml, xml.elements[index], pages);
        const std::string label = "scan " + std::to_string(description.scans.size() + 1);
        if (!scan) {
            scan.error().message = label + ": " + scan.error().message;
            return scan.error();
        }
        scan->label = label;
        description.scans.push_back(std::move(*scan));
    }
    return description;
}

} // namespace pbm::build
