#include "viewer/cameras/camera_file.h"

#include "command_line/command_line.h"
#include "system/files/file_names.h"
#include "system/files/gltf_bytes.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace pbm {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxJson = std::size_t{64} << 20, kMaxNumbers = std::size_t{1} << 24, kNone = ~std::size_t{0};

// Thrown within this file alone: read_camera returns it. nlohmann's exceptions are thrown with it where an entry is
// missing or of another type.
struct Refusal {
    Error error;
};
[[noreturn]] void refuse(const std::string &what, ErrorCode code = ErrorCode::bad_input) {
    throw Refusal{{code, 0, what}};
}

// An index or a size. JSON may hold any number.
std::size_t whole(const Json &value) {
    if (!value.is_number_unsigned())
        refuse("an index of the glTF file is no whole number; export it again");
    return value.get<std::size_t>();
}
std::size_t whole(const Json &from, const char *key, std::size_t otherwise) {
    return from.contains(key) ? whole(from.at(key)) : otherwise;
}

std::string entry(const char *array, std::size_t index) {
    return std::string(array) + "[" + std::to_string(index) + "]";
}

Result<GltfResource> read_beside(const std::string &gltf, std::string_view uri) {
    const std::string path = (std::filesystem::path(gltf).parent_path() / without_percents(uri)).string();
    auto file = MappedFile::open(path);
    if (!file)
        return Error{file.error().code, file.error().offset, path + ": " + file.error().message};
    return GltfResource{.file = std::move(*file)};
}

// A file that is open, and its arrays of numbers.
class Gltf {
  public:
    Gltf(const std::string &path, const GltfChunks &chunks)
        : path_(path), chunks_(chunks), json_(Json::parse(chunks.json.begin(), chunks.json.end())) {}

    std::size_t count(const char *array) const { return json_.contains(array) ? json_.at(array).size() : 0; }
    const Json &item(const char *array, std::size_t index) const {
        if (index >= count(array))
            refuse(entry(array, index) + " does not exist; export the file again");
        return json_.at(array).at(index);
    }
    std::string version() const { return json_.at("asset").at("version"); }

    // [count][components] of an accessor; normalised integers become 0..1 or -1..1.
    std::vector<double> numbers(std::size_t accessor, std::size_t components) {
        const Json &described = item("accessors", accessor);
        const std::string name = entry("accessors", accessor);
        if (described.contains("sparse") || !described.contains("bufferView"))
            refuse(name + " is sparse or compressed; export the animation without compression",
                   ErrorCode::unsupported_feature);
        constexpr std::array<const char *, 5> kTypes{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
        const std::size_t kind = whole(described.at("componentType")), size = kind == 5126 ? 4 : kind < 5122 ? 1 : 2;
        if (described.at("type") != kTypes.at(components) || kind < 5120 || (kind > 5123 && kind != 5126))
            refuse(name + " has another type than an animation wants");
        const std::size_t from = whole(described, "byteOffset", 0);
        std::size_t stride = 0;
        const ByteView bytes = view(whole(described.at("bufferView")), stride);
        stride = std::max(stride, size * components);
        const std::size_t count = whole(described.at("count"));
        const std::size_t fitting = from < bytes.size() && bytes.size() - from >= size * components
                                        ? (bytes.size() - from - size * components) / stride + 1
                                        : 0;
        if (count > fitting)
            refuse(name + " announces " + std::to_string(count) + " elements, and its buffer holds " +
                   std::to_string(fitting) + ": the file is cut short or damaged; export it again");
        if ((numbers_ += count * components) > kMaxNumbers)
            refuse("more keys of animations than cameras have; export the cameras alone", ErrorCode::too_large);
        std::vector<double> values;
        for (std::size_t i = 0; i < count * components; ++i)
            values.push_back(number(bytes.data() + from + i / components * stride + i % components * size, kind));
        if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); }))
            refuse(name + " has a value that is no number");
        return values;
    }

  private:
    static double number(const std::uint8_t *at, std::size_t kind) {
        switch (kind) {
        case 5120: return std::max(load<std::int8_t>(at) / 127.0, -1.0);
        case 5121: return *at / 255.0;
        case 5122: return std::max(load<std::int16_t>(at) / 32767.0, -1.0);
        case 5123: return load<std::uint16_t>(at) / 65535.0;
        default: return static_cast<double>(load<float>(at));
        }
    }

    ByteView view(std::size_t index, std::size_t &stride) {
        const Json &described = item("bufferViews", index);
        if (described.contains("extensions"))
            refuse(entry("bufferViews", index) + " is compressed; export the animation without compression",
                   ErrorCode::unsupported_feature);
        const ByteView bytes = buffer(whole(described.at("buffer")));
        const std::size_t offset = whole(described, "byteOffset", 0), length = whole(described.at("byteLength"));
        if (offset > bytes.size() || length > bytes.size() - offset)
            refuse(entry("bufferViews", index) + " goes beyond the end of its buffer; export the file again");
        stride = whole(described, "byteStride", 0);
        if (stride > 252)
            refuse(entry("bufferViews", index) + " has a stride that glTF does not allow");
        return bytes.subspan(offset, length);
    }

    ByteView buffer(std::size_t index) {
        const Json &described = item("buffers", index);
        if (!described.contains("uri"))
            return chunks_.binary;
        if (const auto known = buffers_.find(index); known != buffers_.end())
            return known->second.bytes();
        const auto uri = described.at("uri").get<std::string>();
        auto read = is_data_uri(uri) ? read_data_uri(uri) : read_beside(path_, uri);
        if (!read)
            throw Refusal{read.error()};
        return buffers_.emplace(index, std::move(*read)).first->second.bytes();
    }

    std::string path_;
    GltfChunks chunks_;
    Json json_;
    std::map<std::size_t, GltfResource> buffers_;
    std::size_t numbers_ = 0; // read so far
};

std::string name_of(const Gltf &gltf, std::size_t node) {
    const Json &described = gltf.item("nodes", node), &camera = gltf.item("cameras", whole(described.at("camera")));
    return described.value("name", camera.value("name", entry("nodes", node)));
}

// The node of the camera that is asked for.
std::size_t find_camera(const Gltf &gltf, const std::string &wanted) {
    std::vector<std::size_t> all, named;
    for (std::size_t node = 0; node < gltf.count("nodes"); ++node) {
        const Json &described = gltf.item("nodes", node);
        if (!described.contains("camera"))
            continue;
        all.push_back(node);
        if (name_of(gltf, node) == wanted ||
            gltf.item("cameras", whole(described.at("camera"))).value("name", "") == wanted)
            named.push_back(node);
    }
    if (all.empty())
        refuse("the file has no camera; export it with its cameras", ErrorCode::usage);
    const std::vector<std::size_t> &found = wanted.empty() ? all : named;
    if (found.size() == 1)
        return found.front();
    std::string names;
    constexpr std::size_t kShown = 8;
    for (std::size_t i = 0; i < all.size() && i < kShown; ++i)
        names += (i == 0 ? "" : ", ") + command_line::printable(name_of(gltf, all[i]));
    refuse((wanted.empty() ? std::to_string(all.size()) + " cameras; write FILE,NAME with one of them: "
            : named.empty()
                ? "no camera is named " + command_line::printable(wanted) + "; there are: "
                : "several cameras are named " + command_line::printable(wanted) + "; give them other names: ") +
               names + (all.size() > kShown ? ", ..." : ""),
           ErrorCode::usage);
}

// From the root to `node`.
std::vector<std::size_t> nodes_above(const Gltf &gltf, std::size_t node) {
    std::vector<std::size_t> parents(gltf.count("nodes"), kNone);
    for (std::size_t parent = 0; parent < parents.size(); ++parent)
        if (const Json &described = gltf.item("nodes", parent); described.contains("children"))
            for (const Json &child : described.at("children")) {
                const std::size_t index = whole(child);
                if (index < parents.size())
                    parents[index] = parent;
            }
    std::vector<std::size_t> path{node};
    while (parents[path.back()] != kNone) {
        path.push_back(parents[path.back()]);
        if (path.size() > parents.size())
            refuse(entry("nodes", node) + " lies below itself; export the file again");
    }
    std::reverse(path.begin(), path.end());
    return path;
}

constexpr std::array<const char *, 3> kParts{"translation", "rotation", "scale"};

PathNode read_node(const Json &described) {
    PathNode node;
    node.rest = {glm::dvec4(0), glm::dvec4(0, 0, 0, 1), glm::dvec4(1)};
    node.has_parts = !described.contains("matrix");
    for (int i = 0; i < 16 && !node.has_parts; ++i)
        node.matrix[i / 4][i % 4] = described.at("matrix").at(static_cast<std::size_t>(i));
    for (std::size_t part = 0; part < kParts.size(); ++part)
        if (described.contains(kParts[part]))
            for (int axis = 0; axis < (part == 1 ? 4 : 3); ++axis)
                node.rest[part][axis] = described.at(kParts[part]).at(static_cast<std::size_t>(axis));
    return node;
}

Lens read_lens(const Json &camera) {
    Lens lens{.orthographic = camera.at("type") == "orthographic"};
    const Json &of = camera.at(lens.orthographic ? "orthographic" : "perspective");
    lens.size = of.at(lens.orthographic ? "ymag" : "yfov");
    const double width = lens.orthographic ? of.at("xmag").get<double>() / lens.size : of.value("aspectRatio", 0.0);
    lens.aspect = std::isfinite(width) && width > 0 ? width : 0;
    lens.nearest = of.value("znear", 0.0);
    lens.farthest = of.value("zfar", lens.farthest);
    constexpr double kMaxAngle = 3.1; // radians
    if (!(lens.size > 0) || (!lens.orthographic && lens.size > kMaxAngle))
        refuse("the camera sees nothing: its angle or its height is " + to_string(Value(lens.size)));
    return lens;
}

Keyframes read_keys(Gltf &gltf, const Json &sampler, const std::string &name, std::size_t components) {
    Keyframes keys;
    const std::string word = sampler.value("interpolation", "LINEAR");
    keys.interpolation = word == "STEP"          ? Interpolation::step
                         : word == "CUBICSPLINE" ? Interpolation::cubic
                                                 : Interpolation::linear;
    keys.is_rotation = components == 4;
    keys.times = gltf.numbers(sampler.at("input"), 1);
    const std::vector<double> values = gltf.numbers(sampler.at("output"), components);
    const std::size_t in_key = keys.interpolation == Interpolation::cubic ? 3 : 1;
    if (keys.times.empty() || values.size() != keys.times.size() * in_key * components)
        refuse(name + ": keys and values are not as many; export the file again");
    if (std::adjacent_find(keys.times.begin(), keys.times.end(), std::greater_equal<>()) != keys.times.end())
        refuse(name + ": the times of its keys do not ascend; export the file again");
    for (std::size_t i = 0; i < values.size(); i += components) {
        keys.values.emplace_back(0);
        for (std::size_t axis = 0; axis < components; ++axis)
            keys.values.back()[static_cast<int>(axis)] = values[i + axis];
    }
    return keys;
}

// Where the keys of a channel go: a part of a node of the path, or the lens; null: elsewhere.
std::optional<Keyframes> *target_of(const Json &target, const std::vector<std::size_t> &nodes, std::size_t camera,
                                    CameraPath &path, std::size_t &components) {
    const std::string kind = target.at("path");
    components = 1;
    if (kind == "pointer") {
        const std::string lens = "/cameras/" + std::to_string(camera);
        const std::string pointer = target.at("extensions").at("KHR_animation_pointer").at("pointer");
        const bool is_zoom = pointer == lens + (path.lens.orthographic ? "/orthographic/ymag" : "/perspective/yfov");
        return is_zoom ? &path.lens.zoom : nullptr;
    }
    const std::size_t node = whole(target, "node", kNone);
    const auto at = std::find(nodes.begin(), nodes.end(), node) - nodes.begin();
    const auto part = std::find(kParts.begin(), kParts.end(), kind) - kParts.begin();
    if (at == std::ssize(nodes) || part == std::ssize(kParts))
        return nullptr;
    components = part == 1 ? 4 : 3;
    return &path.nodes[static_cast<std::size_t>(at)].keys[static_cast<std::size_t>(part)];
}

// Notes when a channel moves the camera, and how fast its keys follow each other.
void note_times(const Keyframes &keys, bool is_first, CameraPath &path) {
    path.begin = is_first ? keys.times.front() : std::min(path.begin, keys.times.front());
    path.end = is_first ? keys.times.back() : std::max(path.end, keys.times.back());
    constexpr double kSlowest = 12, kFastest = 120, kTolerance = 0.01; // frames a second
    for (std::size_t i = 1; i < keys.times.size(); ++i) {
        const double rate = 1 / (keys.times[i] - keys.times[i - 1]), whole = std::round(rate);
        if (whole >= kSlowest && whole <= kFastest && std::abs(rate - whole) < kTolerance * whole)
            path.rate = std::max(path.rate.value_or(0), whole);
    }
}

CameraPath read_path(Gltf &gltf, const std::string &wanted) {
    if (!gltf.version().starts_with("2"))
        refuse("not glTF 2; export it as glTF 2", ErrorCode::unsupported_version);
    CameraPath path;
    const std::size_t node = find_camera(gltf, wanted), camera = whole(gltf.item("nodes", node).at("camera"));
    const std::vector<std::size_t> nodes = nodes_above(gltf, node);
    path.name = name_of(gltf, node);
    path.lens = read_lens(gltf.item("cameras", camera));
    for (const std::size_t above : nodes)
        path.nodes.push_back(read_node(gltf.item("nodes", above)));
    bool is_first = true;
    for (std::size_t i = 0; i < gltf.count("animations"); ++i) {
        const Json &animation = gltf.item("animations", i);
        for (const Json &channel : animation.at("channels")) {
            std::size_t components = 0;
            std::optional<Keyframes> *const to = target_of(channel.at("target"), nodes, camera, path, components);
            if (to == nullptr || *to)
                continue;
            const std::size_t sampler = whole(channel.at("sampler"));
            const std::string name = entry("animations", i) + "." + entry("samplers", sampler);
            *to = read_keys(gltf, animation.at("samplers").at(sampler), name, components);
            note_times(**to, std::exchange(is_first, false), path);
        }
    }
    return path;
}

} // namespace

Result<CameraChoice> parse_camera_file(const std::string &text) {
    const std::string lower = lower_case(text);
    for (const char *const extension : {".gltf", ".glb"}) {
        const std::string with_name = std::string(extension) + ",";
        if (lower.ends_with(extension))
            return CameraChoice{text, ""};
        if (const std::size_t at = lower.rfind(with_name); at != std::string::npos)
            return CameraChoice{text.substr(0, at + with_name.size() - 1), text.substr(at + with_name.size())};
    }
    return usage_error("'" + text + "' is no camera file; write FILE.gltf, FILE.glb or FILE.glb,NAME");
}

Result<CameraPath> parse_camera(ByteView file, const CameraChoice &choice) {
    const auto chunks = gltf_chunks(file);
    if (!chunks)
        return chunks.error();
    if (chunks->json.size() > kMaxJson)
        return Error{ErrorCode::too_large, 0, "more than 64 MiB of JSON; export the cameras alone"};
    try {
        Gltf gltf(choice.file, *chunks);
        return read_path(gltf, choice.name);
    } catch (const Refusal &refusal) {
        return refusal.error;
    } catch (const Json::parse_error &error) {
        const auto start = static_cast<std::size_t>(chunks->json.data() - file.data());
        return Error{ErrorCode::bad_input, start + std::min<std::size_t>(error.byte, chunks->json.size()),
                     "the JSON of the glTF file is damaged; export it again"};
    } catch (const Json::exception &error) { // its text names the key or the type, which are ours
        const std::string_view text = error.what();
        return Error{ErrorCode::bad_input, 0,
                     "an entry of the glTF file is missing or of another type (" +
                         std::string(text.substr(text.find(']') + 2)) + "); export it again"};
    }
}

Result<CameraPath> read_camera(const CameraChoice &choice) {
    const auto file = MappedFile::open(choice.file);
    return file ? parse_camera(file->bytes(), choice) : file.error();
}

} // namespace pbm
