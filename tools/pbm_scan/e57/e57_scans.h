// The scans that the XML section of an E57 file describes.
// Format: ASTM E2807-11, sections 8.4.3 (data3D), 8.4.4 (points), 9.2 to 9.7 (element types)
#pragma once

#include "pbm_scan/e57/e57_xml.h"

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace pbm::build {

// What a field of a point is for. Triples are in order.
enum class E57Role : std::uint8_t {
    none,
    x,
    y,
    z,
    range,
    azimuth,
    elevation,
    cartesian_state,
    spherical_state, // 0: valid, 1: a direction only, 2: nothing
    red,
    green,
    blue,
    colour_state, // 1: no colour
    intensity,
    nx,
    ny,
    nz,
    row,
    column,
};
inline constexpr std::size_t kE57Roles = static_cast<std::size_t>(E57Role::column) + 1;

enum class E57Type : std::uint8_t { integer, scaled_integer, single_float, double_float, text };

// A field of the records; each has a byte stream of its own.
struct E57Field {
    std::string name; // in the file
    E57Role role = E57Role::none;
    E57Type type = E57Type::double_float;
    int bits = 0;                    // of a value in the stream; integers that have one value only take none
    std::int64_t minimum = 0;        // of an integer: the stream holds the difference to it
    std::int64_t maximum = 0;        // of an integer
    double scale = 1, offset = 0;    // of a scaled integer
    std::optional<double> low, high; // the values of black and white, of a field of colours; absent: the file has none
};

struct E57Scan {
    std::string label;            // "scan 2", for messages
    std::vector<E57Field> fields; // in the order of the streams
    std::uint64_t records = 0;
    std::uint64_t section = 0; // logical offset of the compressed vector
    std::uint64_t offset = 0;  // physical, of its element in the XML section
    bool has_groups = false;   // pointGroupingSchemes
    struct Pose {
        glm::dquat rotation{1, 0, 0, 0};
        glm::dvec3 translation{0};
    };
    std::optional<Pose> pose;

    const E57Field *field(E57Role role) const; // null: there is none
    bool has_all(std::initializer_list<E57Role> roles) const;
    bool is_cartesian() const { return has_all({E57Role::x, E57Role::y, E57Role::z}); }
    bool is_spherical() const { return has_all({E57Role::range, E57Role::azimuth, E57Role::elevation}); }
    bool has_colours() const { return has_all({E57Role::red, E57Role::green, E57Role::blue}); }
    // Whether one of its fields of colours has no limits.
    bool has_open_colours() const {
        const auto is_open = [](const E57Field &f) {
            return f.role >= E57Role::red && f.role <= E57Role::blue && !f.high;
        };
        return has_colours() && std::any_of(fields.begin(), fields.end(), is_open);
    }
    bool has_normals() const { return has_all({E57Role::nx, E57Role::ny, E57Role::nz}); }
};

struct E57Description {
    std::vector<E57Scan> scans;
    std::size_t images = 0;              // images2D
    std::string coordinates;             // coordinateMetadata: the coordinate reference system
    std::vector<std::string> extensions; // prefixes of namespaces that are declared
    std::set<std::string> about, unused; // elements that describe the file or its scans, and those that are not known
};

// errors  bad_input            an element is missing or contradicts itself, a number is none
//         unsupported_feature  points that are compressed otherwise than by bitPackCodec
Result<E57Description> describe_e57(const E57Xml &xml, const E57Pages &pages);

} // namespace pbm::build
