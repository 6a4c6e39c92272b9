#include "pbm_scan/gltf/gltf_primitives.h"

#include "pbm_format/model/point_values.h"
#include "pbm_scan/clouds/gaussian_splats.h"
#include "pbm_scan/gltf/gltf_draco.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "pbm_scan/text/text_lines.h"

#include <algorithm>
#include <array>
#include <limits>

namespace pbm::build {
namespace {

enum class Mode : std::uint8_t { points = 0, triangles = 4, strip = 5, fan = 6 };

constexpr std::size_t kMaxJointSets = 4;
constexpr std::uint64_t kFreeVertices = std::uint64_t{1} << 24, kFreeCorners = std::uint64_t{1} << 26;

void add_triangles(Mode mode, const std::vector<std::uint32_t> &corners, GltfPrimitive &out) {
    const auto add = [&out](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && a != c)
            out.triangles.emplace_back(a, b, c);
        else
            ++out.degenerate;
    };
    if (mode == Mode::triangles) {
        out.triangles.reserve(corners.size() / 3);
        for (std::size_t i = 0; i + 3 <= corners.size(); i += 3)
            add(corners[i], corners[i + 1], corners[i + 2]);
        out.degenerate += corners.size() % 3 != 0 ? 1 : 0;
        return;
    }
    // Strips repeat corners to begin anew, so these are no lost triangles.
    const std::size_t degenerate = out.degenerate;
    for (std::size_t i = 2; i < corners.size(); ++i) {
        if (mode == Mode::fan)
            add(corners[0], corners[i - 1], corners[i]);
        else if (i % 2 == 0)
            add(corners[i - 2], corners[i - 1], corners[i]);
        else
            add(corners[i - 1], corners[i - 2], corners[i]);
    }
    out.degenerate = degenerate;
}

constexpr std::size_t kMaxUnusedNames = 256; // of attributes, in the report

constexpr std::string_view kSplatPrefix = "KHR_gaussian_splatting:";
constexpr const char *kRotations = "KHR_gaussian_splatting:ROTATION", *kScales = "KHR_gaussian_splatting:SCALE",
                     *kOpacities = "KHR_gaussian_splatting:OPACITY",
                     *kCoefficients = "KHR_gaussian_splatting:SH_DEGREE_0_COEF_0";

bool has_splats(const Json &attributes) { return index_of(&attributes, kRotations).has_value(); }

std::string numbered(const char *name, std::size_t set) { return name + std::to_string(set); }

} // namespace

GltfPrimitives::GltfPrimitives(GltfDocument &document, GltfMaterials &materials, const ReadOptions &options,
                               std::vector<AttributeReport> &report)
    : document_(document), materials_(materials), options_(options), report_(report) {
    const Json *const meshes = document_.root("meshes");
    for (std::size_t mesh = 0; mesh < items(meshes); ++mesh) {
        const Json *const primitives = member(item(meshes, mesh), "primitives");
        for (std::size_t i = 0; i < items(primitives); ++i)
            if (const auto accessor = index_of(member(item(primitives, i), "attributes"), "POSITION"))
                ++uses_[*accessor];
    }
}

std::uint64_t GltfPrimitives::max_vertices() const {
    return std::min<std::uint64_t>(kMaxVertices, kFreeVertices + document_.bytes());
}

Result<const std::vector<GltfPrimitive> *> GltfPrimitives::of_mesh(const ShownMesh &shown) {
    const auto &[mesh, to_scene, weights, skin] = shown;
    const std::tuple key(mesh, *weights, skin.has_value());
    auto known = meshes_.find(key);
    if (known == meshes_.end()) {
        Result<std::vector<GltfPrimitive>> read = read_mesh(mesh, *weights, skin.has_value());
        if (!read)
            return read.error();
        known = meshes_.emplace(key, std::move(*read)).first;
    }
    return &known->second;
}

Result<std::vector<GltfPrimitive>> GltfPrimitives::read_mesh(std::size_t mesh, const std::vector<double> &weights,
                                                             bool has_skin) {
    const Json *const described = item(document_.root("meshes"), mesh);
    const std::string name = "meshes[" + std::to_string(mesh) + "]";
    if (described == nullptr)
        return bad_input(name + " does not exist");
    const Json *const primitives = member(described, "primitives");
    std::vector<GltfPrimitive> out;
    for (std::size_t i = 0; i < items(primitives); ++i) {
        GltfPrimitive primitive;
        if (const Status read = read_primitive(*item(primitives, i), weights, has_skin, primitive); !read) {
            Error error = read.error();
            error.message = name + ".primitives[" + std::to_string(i) + "]: " + error.message;
            return error;
        }
        vertices_ += primitive.vertices();
        if (vertices_ > max_vertices())
            return too_large("meshes with more than " + std::to_string(max_vertices()) +
                             " vertices in all; export fewer");
        if (!primitive.positions.empty())
            out.push_back(std::move(primitive));
        else if (!primitive.is_lines && !primitive.are_splats)
            drop_once(report_, "primitives without POSITION", "there is nothing to show");
    }
    return out;
}

void GltfPrimitives::report_attributes(const Json &attributes, const GltfPrimitive &out, bool has_skin) {
    const bool are_splats = has_splats(attributes);
    for (const auto &[name, accessor] : attributes.items()) {
        const bool moves = has_skin && (name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_"));
        if (are_splats && name.starts_with(kSplatPrefix)) {
            if (name.find("SH_DEGREE_0") == std::string::npos && name.find("SH_DEGREE") != std::string::npos)
                drop_once(report_, "spherical harmonics", kSplatHarmonicsNote);
            continue;
        }
        bool is_used = name == "POSITION" || name == "NORMAL" || name == "COLOR_0" || moves ||
                       (name == "TANGENT" && out.material->has_image_of(Layer::normals));
        out.material->for_images(
            [&, &used = name](const GltfImage &image) { is_used = is_used || used == image.coordinates; });
        if (is_used)
            used_.insert(printable(name));
        else if (index_of(&accessor) && unused_.size() < kMaxUnusedNames && unused_.insert(name).second)
            drop_once(report_, printable(name),
                      name.starts_with("TEXCOORD") ? "no image belongs to them"
                      : name == "TANGENT"          ? "no normal map belongs to them"
                                                   : "not used by PBM");
    }
}

Status GltfPrimitives::read_primitive(const Json &described, const std::vector<double> &weights, bool has_skin,
                                      GltfPrimitive &out) {
    constexpr std::size_t kTriangles = 4;
    const std::size_t mode = index_of(&described, "mode").value_or(kTriangles);
    if (mode >= 1 && mode <= 3) {
        drop_once(report_, "lines", "PBM shows no lines");
        out.is_lines = true;
        return {};
    }
    if (mode > 6)
        return bad_input("mode " + std::to_string(mode) + " is none of glTF");
    out.is_points = mode == 0;
    out.material = &materials_.get(index_of(&described, "material"));
    if (out.is_points && out.material->has_image_of(Layer::emission))
        drop_once(report_, "emission of points", "only faces emit light");
    const Json *const attributes = member(&described, "attributes");
    if (attributes == nullptr || !attributes->is_object())
        return {};
    report_attributes(*attributes, out, has_skin);
    Reading reading{described, *attributes, weights, has_skin, {}, {}};
    const Json *const draco = member(member(&described, "extensions"), "KHR_draco_mesh_compression");
    if (Status read = draco != nullptr ? read_compressed(*draco, reading, out) : read_plain(reading, out); !read)
        return read;
    const std::size_t count = out.vertices();
    if (out.positions.empty())
        return {};
    if (out.weights.size() != out.joints.size())
        return bad_input("JOINTS and WEIGHTS do not belong together");
    std::vector parallel{std::tuple(&out.normals, std::size_t{3}, "NORMAL"),
                         {&out.tangents, std::size_t{4}, "TANGENT"},
                         {&out.colours, std::size_t{4}, "COLOR_0"},
                         {&out.joints, 4 * out.joint_sets, "JOINTS"}};
    for (auto &[name, places] : out.places)
        parallel.emplace_back(&places, std::size_t{2}, "texture coordinates");
    for (const auto &[values, width, name] : parallel)
        if (!values->empty() && values->size() != count * width)
            return bad_input(std::string(name) + " are not as many as POSITION");
    if (!out.is_points && reading.corners.empty())
        return {};
    if (const auto beyond =
            std::find_if(reading.corners.begin(), reading.corners.end(), [&](auto c) { return c >= count; });
        beyond != reading.corners.end())
        return bad_input("vertex index " + std::to_string(*beyond) + ", but there are " + std::to_string(count) +
                         " vertices");
    if (Status morphed = morph(reading, out); !morphed)
        return morphed;
    if (out.is_points && has_splats(*attributes))
        return read_splats(reading, out);
    if (!out.is_points)
        add_triangles(static_cast<Mode>(mode), reading.corners, out);
    return {};
}

// The corners, and which vertices of the accessor they need.
Status GltfPrimitives::read_corners(Reading &reading, const GltfPrimitive &out) {
    const auto accessor = index_of(&reading.described, "indices"),
               positions = index_of(&reading.attributes, "POSITION");
    if (positions)
        if (Status verified = document_.verify(*positions); !verified)
            return verified;
    const std::size_t count = positions ? document_.count(*positions) : 0;
    const auto uses = positions ? uses_.find(*positions) : uses_.end();
    const bool is_shared = uses != uses_.end() && uses->second > 1;
    corners_ += accessor ? document_.count(*accessor) : out.is_points ? 0 : count;
    if (corners_ > kFreeCorners + document_.bytes())
        return too_large("many more corners of faces than the file has bytes; export fewer");
    if (!accessor) {
        if (is_shared)
            shared_[*positions].are_all_named = true;
        reading.corners.resize(out.is_points ? 0 : count);
        for (std::uint32_t i = 0; i < reading.corners.size(); ++i)
            reading.corners[i] = i;
        return {};
    }
    auto indices = document_.indices(*accessor);
    if (!indices)
        return indices.error();
    reading.corners = std::move(*indices);
    reading.is_compact = positions && (out.is_points || (is_shared && count > reading.corners.size()));
    if (!positions || (!is_shared && !reading.is_compact))
        return {};
    for (const std::uint32_t corner : reading.corners)
        if (corner >= count)
            return bad_input("vertex index " + std::to_string(corner) + ", but there are " + std::to_string(count) +
                             " vertices");
    Shared own;
    Shared &vertices = is_shared ? shared_[*positions] : own;
    vertices.is_named.resize(count);
    for (const std::uint32_t corner : reading.corners)
        vertices.is_named[corner] = true;
    if (reading.is_compact)
        compact(reading, vertices);
    return {};
}

// Numbers the vertices that the corners name, each once.
void GltfPrimitives::compact(Reading &reading, Shared &vertices) {
    vertices.numbers.resize(vertices.is_named.size());
    vertices.round.resize(vertices.is_named.size());
    ++vertices.rounds;
    for (std::uint32_t &corner : reading.corners) {
        if (vertices.round[corner] != vertices.rounds) {
            vertices.round[corner] = vertices.rounds;
            vertices.numbers[corner] = static_cast<std::uint32_t>(reading.sources.size());
            reading.sources.push_back(corner);
        }
        corner = vertices.numbers[corner];
    }
}

Status GltfPrimitives::read_attribute(Reading &reading, const Json &from, const char *name, std::size_t components,
                                      std::vector<float> &to) {
    const auto accessor = index_of(&from, name);
    if (!accessor)
        return {};
    if (!reading.is_compact) {
        auto values = document_.floats(*accessor, components);
        if (!values)
            return values.error();
        to = std::move(*values);
        return {};
    }
    auto known = values_.find({*accessor, components});
    if (known == values_.end()) {
        auto values = document_.floats(*accessor, components);
        if (!values)
            return values.error();
        known = values_.emplace(std::pair(*accessor, components), std::move(*values)).first;
    }
    const std::size_t count = document_.count(*index_of(&reading.attributes, "POSITION"));
    if (known->second.size() != count * components)
        return bad_input(std::string(name) + " are not as many as POSITION");
    to.reserve(reading.sources.size() * components);
    for (const std::uint32_t source : reading.sources)
        for (std::size_t k = 0; k < components; ++k)
            to.push_back(known->second[source * components + k]);
    return {};
}

Status GltfPrimitives::read_plain(Reading &reading, GltfPrimitive &out) {
    if (Status read = read_corners(reading, out); !read)
        return read;
    const Json &from = reading.attributes;
    if (Status read = read_attribute(reading, from, "POSITION", 3, out.positions); !read)
        return read;
    if (Status read = read_attribute(reading, from, "NORMAL", 3, out.normals); !read)
        return read;
    if (Status read = read_attribute(reading, from, "COLOR_0", 4, out.colours); !read)
        return read;
    if (out.material->has_image_of(Layer::normals))
        if (Status read = read_attribute(reading, from, "TANGENT", 4, out.tangents); !read)
            return read;
    Status read_places;
    out.material->for_images([&](const GltfImage &image) {
        if (read_places && out.places[image.coordinates].empty())
            read_places = read_attribute(reading, from, image.coordinates.c_str(), 2, out.places[image.coordinates]);
    });
    if (!read_places)
        return read_places;
    return reading.has_skin ? read_joints(reading, out) : Status();
}

// Puts discs in place of Gaussian splats, and leaves faint ones out.
// Based on: Khronos Group. KHR_gaussian_splatting. 2025
Status GltfPrimitives::read_splats(Reading &reading, GltfPrimitive &out) {
    const std::size_t count = out.vertices();
    out.are_splats = true;
    std::vector<float> rotations, scales, opacities, coefficients;
    for (const auto &[name, components, values] : {std::tuple(kRotations, std::size_t{4}, &rotations),
                                                   {kScales, std::size_t{3}, &scales},
                                                   {kOpacities, std::size_t{1}, &opacities},
                                                   {kCoefficients, std::size_t{3}, &coefficients}}) {
        if (Status read = read_attribute(reading, reading.attributes, name, components, *values); !read)
            return read;
        if (index_of(&reading.attributes, name) && values->size() != count * components)
            return bad_input(std::string(name) + " are not as many as POSITION");
    }
    for (const auto &[name, values] : {std::pair(kScales, &scales), {kRotations, &rotations}})
        if (values->empty())
            return bad_input(std::string(name) + " is missing");
    // Files of drafts of the extension have logarithms.
    const bool are_logarithms = std::any_of(scales.begin(), scales.end(), [](float scale) { return scale < 0; });
    const auto scale = [&](std::size_t i) { return are_logarithms ? exponential(scales[i]) : scales[i]; };
    const bool has_own_colours = !coefficients.empty();
    std::vector<float> positions, colours, joints, weights;
    const std::size_t moves = 4 * out.joint_sets;
    out.normals.clear();
    for (std::size_t i = 0; i < count; ++i) {
        if (!opacities.empty() && is_faint(opacities[i], options_))
            continue;
        const SplatDisc disc =
            disc_of({scale(3 * i), scale(3 * i + 1), scale(3 * i + 2)},
                    {rotations[4 * i + 3], rotations[4 * i], rotations[4 * i + 1], rotations[4 * i + 2]});
        positions.insert(positions.end(), &out.positions[3 * i], &out.positions[3 * i] + 3);
        out.normals.insert(out.normals.end(), {disc.normal.x, disc.normal.y, disc.normal.z});
        out.radii.push_back(disc.radius);
        const auto from = static_cast<std::ptrdiff_t>(moves * i), end = static_cast<std::ptrdiff_t>(moves * (i + 1));
        joints.insert(joints.end(), out.joints.begin() + from, out.joints.begin() + end);
        weights.insert(weights.end(), out.weights.begin() + from, out.weights.begin() + end);
        if (has_own_colours) {
            for (const std::uint8_t channel :
                 splat_colour({coefficients[3 * i], coefficients[3 * i + 1], coefficients[3 * i + 2]}))
                colours.push_back(static_cast<float>(linear_table()[channel]) / 65535);
            colours.push_back(1);
        } else if (!out.colours.empty()) {
            colours.insert(colours.end(), &out.colours[4 * i], &out.colours[4 * i] + 4);
        }
    }
    splats_ += count;
    faint_splats_ += count - out.radii.size();
    out.positions = std::move(positions);
    out.colours = std::move(colours);
    out.joints = std::move(joints);
    out.weights = std::move(weights);
    out.tangents.clear();
    out.places.clear();
    return {};
}

Status GltfPrimitives::report_splats(bool are_alone) {
    if (splats_ == 0)
        return {};
    if (are_alone && faint_splats_ == splats_)
        return all_splats_are_faint(options_);
    report_.push_back({"KHR_gaussian_splatting", Fate::converted, kSplatShapeNote});
    report_.push_back(faint_splats_report(faint_splats_, splats_, options_));
    return {};
}

// All sets of four joints of each vertex, one set behind the other.
Status GltfPrimitives::read_joints(Reading &reading, GltfPrimitive &out) {
    std::array<std::vector<float>, kMaxJointSets> joints, weights;
    std::size_t sets = 0;
    for (; sets < kMaxJointSets && index_of(&reading.attributes, numbered("JOINTS_", sets).c_str()); ++sets) {
        if (Status read =
                read_attribute(reading, reading.attributes, numbered("JOINTS_", sets).c_str(), 4, joints[sets]);
            !read)
            return read;
        if (Status read =
                read_attribute(reading, reading.attributes, numbered("WEIGHTS_", sets).c_str(), 4, weights[sets]);
            !read)
            return read;
        if (joints[sets].size() != 4 * out.vertices() || weights[sets].size() != joints[sets].size())
            return bad_input("JOINTS and WEIGHTS are not as many as POSITION");
    }
    out.joint_sets = sets;
    for (std::size_t i = 0; i < 4 * out.vertices(); i += 4)
        for (std::size_t set = 0; set < sets; ++set) {
            const auto at = static_cast<std::ptrdiff_t>(i);
            out.joints.insert(out.joints.end(), joints[set].begin() + at, joints[set].begin() + at + 4);
            out.weights.insert(out.weights.end(), weights[set].begin() + at, weights[set].begin() + at + 4);
        }
    return {};
}

Status GltfPrimitives::read_compressed(const Json &draco, Reading &reading, GltfPrimitive &out) {
    const auto view = document_.view(index_of(&draco, "bufferView").value_or(~std::size_t{0}));
    if (!view)
        return view.error();
    const Json *const ids = member(&draco, "attributes");
    std::vector<DracoRequest> requests;
    std::vector<std::vector<float> *> to;
    std::vector<std::tuple<std::string, std::size_t, std::vector<float> *>> plain; // not among the compressed ones
    const auto want = [&](const std::string &name, std::uint32_t components, std::vector<float> &values) {
        const auto id = index_of(ids, name.c_str());
        const auto accessor = index_of(&reading.attributes, name.c_str());
        if (!accessor)
            return;
        if (!id) {
            plain.emplace_back(name, components, &values);
            return;
        }
        requests.push_back({static_cast<std::uint32_t>(*id), components, document_.is_normalised(*accessor)});
        to.push_back(&values);
    };
    want("POSITION", 3, out.positions);
    want("NORMAL", 3, out.normals);
    want("COLOR_0", 4, out.colours);
    if (out.material->has_image_of(Layer::normals))
        want("TANGENT", 4, out.tangents);
    out.material->for_images([&](const GltfImage &image) {
        if (out.places.emplace(image.coordinates, std::vector<float>()).second)
            want(image.coordinates, 2, out.places[image.coordinates]);
    });
    if (reading.has_skin) {
        want("JOINTS_0", 4, out.joints);
        want("WEIGHTS_0", 4, out.weights);
    }
    Result<DracoMesh> mesh = decode_draco(view->bytes, requests);
    if (!mesh)
        return mesh.error();
    for (std::size_t i = 0; i < to.size(); ++i)
        *to[i] = std::move(mesh->attributes[i]);
    for (const auto &[name, components, values] : plain)
        if (Status read = read_attribute(reading, reading.attributes, name.c_str(), components, *values); !read)
            return read;
    out.joint_sets = out.joints.empty() ? 0 : 1;
    reading.corners = std::move(mesh->corners);
    return {};
}

// Moves vertices by the morph targets whose weights are not 0.
Status GltfPrimitives::morph(Reading &reading, GltfPrimitive &out) {
    const Json *const targets = member(&reading.described, "targets");
    for (std::size_t i = 0; i < items(targets); ++i)
        if (const Json *const target = item(targets, i); target->is_object())
            for (const auto &[name, accessor] : target->items())
                if (name != "POSITION" && name != "NORMAL" && index_of(&accessor))
                    drop_once(report_, printable(name) + " of morph targets", "not used by PBM");
    if (items(targets) == 0)
        return {};
    if (reading.weights.empty()) {
        drop_once(report_, "morph targets", "PBM's models stand still");
        return {};
    }
    for (std::size_t i = 0; i < std::min(items(targets), reading.weights.size()); ++i) {
        const auto weight = static_cast<float>(reading.weights[i]);
        if (weight == 0)
            continue;
        for (const auto &[name, values] : {std::pair("POSITION", &out.positions), {"NORMAL", &out.normals}}) {
            std::vector<float> moved;
            if (Status read = read_attribute(reading, *item(targets, i), name, 3, moved); !read)
                return read;
            if (moved.empty() || values->empty())
                continue;
            if (moved.size() != values->size())
                return bad_input("a morph target has another number of vertices");
            for (std::size_t k = 0; k < moved.size(); ++k)
                (*values)[k] += weight * moved[k];
        }
    }
    report_once(report_, {"morph targets", Fate::converted, "with the weights that the file gives them"});
    return {};
}

ColourRange GltfPrimitives::colour_range() const {
    ColourCounts counts;
    const auto is_bright = [](float channel) { return channel > 1; };
    const auto for_colours = [this](const auto &use) {
        for (const auto &[key, primitives] : meshes_)
            for (const GltfPrimitive &primitive : primitives)
                use(primitive.colours);
    };
    bool has_bright = false; // opacities included
    for_colours([&](const std::vector<float> &colours) {
        has_bright = has_bright || std::any_of(colours.begin(), colours.end(), is_bright);
    });
    if (has_bright)
        for_colours([&](const std::vector<float> &colours) {
            for (std::size_t i = 0; i < colours.size(); i += 4)
                counts.add({colours[i], colours[i + 1], colours[i + 2]});
        });
    return counts.range(ColourNumbers::any);
}

void GltfPrimitives::finish_report() {
    std::erase_if(report_, [&](const AttributeReport &line) {
        return line.name.starts_with("TEXCOORD") && line.fate == Fate::dropped && used_.contains(line.name);
    });
    std::uint64_t loose = 0;
    for (const auto &[accessor, vertices] : shared_)
        if (!vertices.are_all_named && vertices.rounds != 0)
            loose += static_cast<std::uint64_t>(std::count(vertices.is_named.begin(), vertices.is_named.end(), false));
    if (loose != 0)
        report_.push_back(
            line_of(Warning::loose_vertices, "vertices", std::to_string(loose) + " that no primitive names left out"));
}

} // namespace pbm::build
