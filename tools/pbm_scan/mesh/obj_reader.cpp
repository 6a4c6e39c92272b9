#include "pbm_format/model/point_values.h"
#include "pbm_scan/images/files_beside.h"
#include "pbm_scan/images/read_image.h"
#include "pbm_scan/images/texture_images.h"
#include "pbm_scan/mesh/material_text.h"
#include "pbm_scan/mesh/mesh_attributes.h"
#include "pbm_scan/mesh/mesh_reader.h"
#include "pbm_scan/mesh/obj_text.h"
#include "pbm_scan/mesh/vertex_copies.h"
#include "pbm_scan/surface/polygon.h"
#include "pbm_scan/text/encoding.h"
#include "pbm_scan/text/text_lines.h"
#include "system/files/mapped_file.h"
#include "system/free_memory.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

namespace pbm::build {
namespace {

// A line names several files (Wavefront), or one file with spaces in its name (most writers): takes the one if it
// exists, else the several.
std::vector<NamedFile> material_files(const std::string &path, std::span<const std::string> lines) {
    std::vector<NamedFile> files;
    if (path.empty())
        return files;
    // Whether it is there.
    const auto add = [&](std::string_view name) {
        if (files.size() == kMaxFurtherFiles)
            return false;
        files.push_back(name_beside(path, name));
        return !files.back().file.empty();
    };
    for (std::string_view names : lines) {
        if (files.size() == kMaxFurtherFiles || add(names))
            continue;
        while (!names.empty()) {
            const std::size_t quote = names.find_first_of("\"'") == 0 ? names.find(names.front(), 1) : names.npos;
            const std::size_t end =
                quote != names.npos ? quote + 1 : std::min(names.find_first_of(" \t"), names.size());
            add(names.substr(0, end));
            names.remove_prefix(std::min(names.find_first_not_of(" \t", end), names.size()));
        }
    }
    return files;
}

// What the material files of an OBJ say.
struct MaterialFiles {
    std::vector<NamedMaterial> materials; // images by the names of existing files, or empty
    std::vector<NamedFile> images;        // in the order of materials
    std::vector<AttributeReport> report;
};

// Images of how a material reflects become one, so they have to lie alike.
void lay_reflectance_alike(NamedMaterial &material, std::vector<AttributeReport> &report) {
    MaterialImage &roughness = material.roughness_image, &metal = material.metal_image;
    if (roughness.file.empty() || metal.file.empty() || roughness.lies_as(metal))
        return;
    metal.file.clear();
    drop_once(report, "map_Pm of materials", "it does not lie as map_Pr does");
}

// One place in both images belongs to a point of the surface.
void lay_alike(NamedMaterial &material, std::vector<AttributeReport> &report) {
    MaterialImage &image = material.image, &opacity = material.opacity_image;
    if (opacity.file.empty())
        return;
    if (image.file.empty()) {
        image = opacity;
        image.file.clear();
    }
    if (image.lies_as(opacity))
        return;
    opacity.file.clear();
    drop_once(report, "map_d of materials", "it does not lie as map_Kd does");
}

// A map of normals says more than one of heights.
void choose_relief(NamedMaterial &material, std::vector<AttributeReport> &report) {
    if (material.normal_image.file.empty() || material.bump_image.file.empty())
        return;
    material.bump_image.file.clear();
    drop_once(report, "bump of materials", "norm says the same, and more");
}

// Reads each material file once; skips those that are too large. Images that do not exist are named.
MaterialFiles read_material_files(std::span<const NamedFile> files, const Material &default_material) {
    MaterialFiles found;
    std::set<std::string> known{""};
    for (const NamedFile &named : files) {
        const std::string &file = named.file;
        if (!known.insert(file).second)
            continue;
        const Result<MappedFile> materials = MappedFile::open(file);
        if (!materials || materials->bytes().size() > kMaxMaterialBytes)
            continue;
        const Result<Utf8Text> text = as_utf8(materials->bytes());
        if (!text)
            continue;
        const std::size_t first = found.materials.size();
        read_materials(as_text(text->bytes), default_material, found.materials, found.report);
        const auto find = [&](std::string &image) {
            if (image.empty())
                return;
            found.images.push_back(name_beside(file, image));
            if (found.images.back().file.empty())
                drop_once(found.report, "texture image " + printable_in_quotes(image), why_missing(image),
                          Warning::missing_image);
            image = found.images.back().file;
        };
        for (std::size_t i = first; i < found.materials.size(); ++i) {
            NamedMaterial &material = found.materials[i];
            for (MaterialImage *const image :
                 {&material.image, &material.opacity_image, &material.normal_image, &material.bump_image,
                  &material.roughness_image, &material.metal_image, &material.emission_image})
                find(image->file);
            lay_alike(material, found.report);
            choose_relief(material, found.report);
            lay_reflectance_alike(material, found.report);
            finish_reflectance(material);
        }
    }
    finish_colours(found.materials, found.report);
    return found;
}

// Materials and images by the numbers that names have in the text.
class MaterialTable {
  public:
    MaterialTable(const ObjText &text, const std::vector<NamedMaterial> &named, const Material &default_material)
        : used_{default_material}, reflectances_(1), numbers_(text.materials.size(), 0), looks_(text.materials.size()) {
        for (std::size_t i = 0; i < text.materials.size(); ++i) {
            auto found = std::find_if(named.begin(), named.end(), [&](const NamedMaterial &material) {
                return material.name == text.materials[i];
            });
            if (found == named.end())
                found = std::find_if(named.begin(), named.end(), [&](const NamedMaterial &material) {
                    return lower_case(material.name) == lower_case(text.materials[i]);
                });
            if (found == named.end()) {
                if (!text.materials[i].empty())
                    undefined_.push_back(text.materials[i]);
                continue;
            }
            std::size_t number = 0;
            while (number < used_.size() &&
                   (used_[number] != found->material || reflectances_[number] != found->reflectance))
                ++number;
            numbers_[i] = static_cast<std::uint16_t>(number);
            if (number == used_.size()) {
                used_.push_back(found->material);
                reflectances_.push_back(found->reflectance);
            }
            looks_[i] = *found;
        }
    }

    // The default one is the first.
    const std::vector<Material> &used() const { return used_; }
    // [used] what they come from; none: from coefficients.
    const std::vector<std::optional<Reflectance>> &reflectances() const { return reflectances_; }
    bool has_several() const { return used_.size() > 1; }
    // Names that no file defines.
    const std::vector<std::string> &undefined() const { return undefined_; }
    std::uint16_t number_of(std::uint16_t name) const {
        return name < numbers_.size() ? numbers_[name] : std::uint16_t{0};
    }
    // What a file says of the material. Null: no file does.
    const NamedMaterial *look_of(std::uint16_t name) const { return name < looks_.size() ? &looks_[name] : nullptr; }

  private:
    std::vector<Material> used_;
    std::vector<std::optional<Reflectance>> reflectances_;
    std::vector<std::uint16_t> numbers_; // [names] of `used_`
    std::vector<NamedMaterial> looks_;   // [names]
    std::vector<std::string> undefined_;
};

TextureUse use_of(Wrap wrap) { return {.wrap = {wrap, wrap}}; }

// An image of the current faces, and how it lies.
struct LaidImage {
    std::uint16_t texture = Surface::kNoTexture;
    MaterialImage lies{};
    bool is_uniform = false; // one texel, which lies everywhere
};

// Builds the triangles of the faces, with the copies of vertices that they need.
class ObjFaces {
  public:
    ObjFaces(ObjText &text, const MaterialTable &materials, TextureImages &images, bool is_green_down, Surface &surface)
        : text_(text), materials_(materials), images_(images), surface_(surface),
          copies_(text.positions.size(), materials.has_several()), is_green_down_(is_green_down) {
        if (!text.face_sizes.empty())
            place_of_.resize(text.positions.size());
        surface.positions = std::move(text.positions);
    }

    void run(const std::function<void(double)> &progress) {
        PolygonTriangulator triangulator;
        std::size_t run = 0, first = 0, smoothing_run = 0;
        std::uint32_t group = 0; // as the format says for faces before the first statement
        select(kNoMaterial);
        for (std::size_t face = 0; face < text_.face_sizes.size(); ++face) {
            for (; run < text_.material_runs.size() && text_.material_runs[run].first_face <= face; ++run)
                select(text_.material_runs[run].material);
            for (;
                 smoothing_run < text_.smoothing_runs.size() && text_.smoothing_runs[smoothing_run].first_face <= face;
                 ++smoothing_run)
                group = text_.smoothing_runs[smoothing_run].group;
            const auto corners = std::span(text_.corners).subspan(first, text_.face_sizes[face]);
            const std::size_t before = surface_.triangles.size();
            surface_.dropped_triangles += triangulator.triangulate(corners, surface_.positions, surface_.triangles);
            add_textures(corners, first, before);
            if (!text_.corner_normals.empty())
                for (std::size_t i = 0; i < corners.size(); ++i)
                    if (const std::uint32_t normal = text_.corner_normals[first + i]; normal != ObjText::kNone)
                        copies_.add_normal(corners[i], text_.normals[normal]);
            copies_.apply(corners, material_, std::span(surface_.triangles).subspan(before));
            if (!text_.smoothing_runs.empty())
                surface_.smoothing_groups.resize(surface_.triangles.size(), group == 0 ? Surface::kFlat : group);
            first += corners.size();
            constexpr std::size_t kReported = 1 << 16;
            if (progress && (face % kReported == 0 || face + 1 == text_.face_sizes.size()))
                progress(static_cast<double>(face + 1) / static_cast<double>(text_.face_sizes.size()));
        }
        finish();
    }

    // Materials of the vertices; empty where there is only one.
    const std::vector<std::uint16_t> &materials() const { return copies_.materials(); }

  private:
    void select(std::uint16_t name) {
        material_ = materials_.number_of(name);
        const NamedMaterial *const look = materials_.look_of(name);
        const bool has_image = look != nullptr && !(look->image.file.empty() && look->opacity_image.file.empty());
        colours_ = has_image ? LaidImage{texture_of(*look), look->image} : LaidImage{};
        relief_ = look == nullptr ? LaidImage{} : relief_of(*look);
        reflectance_ = look == nullptr ? LaidImage{} : reflectance_of(*look);
        emission_ = look == nullptr ? LaidImage{} : emission_of(*look);
        plain_reflectance_ =
            emission_.texture == Surface::kNoTexture
                ? Surface::kNoTexture
                : images_.of_texel({.content = ImageContent::roughness_metal, .factors = *look->reflectance});
    }

    LaidImage reflectance_of(const NamedMaterial &look) {
        std::vector<ReflectanceImage> images;
        LaidImage laid;
        for (const auto &[image, part] : {std::pair(&look.metal_image, ReflectancePart::metal),
                                          {&look.roughness_image, ReflectancePart::roughness}})
            if (const std::string &file = image->file; !file.empty()) {
                images.push_back({.name = file, .part = part, .read = [file] { return read_image_file(file, false); }});
                laid.lies = *image;
            }
        if (images.empty())
            return {};
        const auto byte = [](double share) { return static_cast<std::uint8_t>(share * 255 + 0.5); };
        TextureUse use = use_of(laid.lies.is_clamped ? Wrap::clamp : Wrap::repeat);
        use.factors = {.roughness = 1, .metal = 1};
        laid.texture = images_.of_reflectance(images, use,
                                              {255, byte(look.reflectance->roughness), byte(look.reflectance->metal)});
        return laid;
    }

    LaidImage emission_of(const NamedMaterial &look) {
        TextureUse use = use_of(look.emission_image.is_clamped ? Wrap::clamp : Wrap::repeat);
        use.content = ImageContent::emission;
        if (!look.emission_image.file.empty())
            if (const std::uint16_t texture = images_.of_file(look.emission_image.file, use);
                texture != Surface::kNoTexture)
                return {.texture = texture, .lies = look.emission_image};
        if (look.emission == Rgb8{})
            return {};
        for (std::size_t c = 0; c < 3; ++c)
            use.light[c] = static_cast<float>(linear_table()[look.emission[c]]) / 65535;
        return {.texture = images_.of_texel(use), .is_uniform = true};
    }

    LaidImage relief_of(const NamedMaterial &look) {
        const bool has_normals = !look.normal_image.file.empty();
        const MaterialImage &image = has_normals ? look.normal_image : look.bump_image;
        if (image.file.empty())
            return {};
        TextureUse use = use_of(image.is_clamped ? Wrap::clamp : Wrap::repeat);
        use.content = has_normals ? ImageContent::normals : ImageContent::relief;
        use.relief = image.bump;
        use.is_green_down = is_green_down_;
        return {images_.of_file(image.file, use), image};
    }

    std::uint16_t texture_of(const NamedMaterial &look) {
        TextureUse use = use_of(look.image.is_clamped ? Wrap::clamp : Wrap::repeat);
        if (look.opacity_image.file.empty())
            return images_.of_file(look.image.file, use);
        use.is_blended = true;
        use.least_opacity = kUsualAlphaCutoff;
        use.opacity = look.opacity > 0 ? look.opacity : 1; // some programs write 0 beside an image
        return images_.of_files(look.image.file, look.material.colour,
                                {look.opacity_image.file, look.is_opacity_inverted}, use);
    }

    // Where an image lies at the corners of the face, for set_textures; false: nowhere.
    bool lay(const LaidImage &image, std::span<const std::uint32_t> corners, std::size_t first_corner) {
        if (image.is_uniform) {
            for (const std::uint32_t corner : corners)
                place_of_[corner] = {};
            return image.texture != Surface::kNoTexture;
        }
        bool is_laid = image.texture != Surface::kNoTexture && !text_.corner_textures.empty();
        for (std::size_t i = 0; i < corners.size() && is_laid; ++i) {
            const std::uint32_t place = text_.corner_textures[first_corner + i];
            is_laid = place != ObjText::kNone;
            if (is_laid) {
                const glm::vec2 at = text_.texture_coordinates[place] * image.lies.scale + image.lies.offset;
                place_of_[corners[i]] = {at.x, 1 - at.y};
            }
        }
        return is_laid;
    }

    // The places in images at the corners of the face's triangles, which begin at `first_triangle`.
    void add_textures(std::span<const std::uint32_t> corners, std::size_t first_corner, std::size_t first_triangle) {
        const auto set = [&](const LaidImage &image, const auto &set_one) {
            const bool is_laid = lay(image, corners, first_corner);
            for (std::size_t i = first_triangle; i < surface_.triangles.size(); ++i) {
                const glm::uvec3 &t = surface_.triangles[i];
                set_one(i, is_laid ? image.texture : Surface::kNoTexture,
                        is_laid ? TextureCorners{place_of_[t.x], place_of_[t.y], place_of_[t.z]} : TextureCorners{});
            }
        };
        set(colours_, [&](std::size_t i, std::uint16_t texture, const TextureCorners &at) {
            set_texture(surface_, i, texture, at);
        });
        set(relief_, [&](std::size_t i, std::uint16_t texture, const TextureCorners &at) {
            set_texture(surface_, Layer::normals, i, texture, at);
        });
        set(reflectance_, [&](std::size_t i, std::uint16_t texture, const TextureCorners &at) {
            set_texture(surface_, Layer::reflectance, i, texture == Surface::kNoTexture ? plain_reflectance_ : texture,
                        at);
        });
        set(emission_, [&](std::size_t i, std::uint16_t texture, const TextureCorners &at) {
            set_texture(surface_, Layer::emission, i, texture, at);
        });
    }

    // Gives copies of vertices their places and colours.
    void finish() {
        surface_.vertex_copies = copies_.copies().size();
        for (const std::uint32_t vertex : copies_.copies()) {
            surface_.positions.push_back(surface_.positions[vertex]);
            if (!text_.colours.empty())
                text_.colours.push_back(text_.colours[vertex]);
        }
        if (!text_.corner_normals.empty()) {
            surface_.normals = copies_.normals();
            surface_.normals.resize(surface_.normals.empty() ? 0 : surface_.positions.size(), glm::vec3(0.0F));
            return;
        }
        surface_.normals = std::move(text_.normals); // of the vertices, if there are any
        for (const std::uint32_t vertex : copies_.copies())
            if (!surface_.normals.empty())
                surface_.normals.push_back(surface_.normals[vertex]);
    }

    ObjText &text_;
    const MaterialTable &materials_;
    TextureImages &images_;
    Surface &surface_;
    VertexCopies copies_;
    std::vector<glm::vec2> place_of_;                       // [vertices] in the image of the current face
    std::uint16_t material_ = 0;                            // of the current face
    LaidImage colours_, relief_, reflectance_, emission_;   // the same
    std::uint16_t plain_reflectance_ = Surface::kNoTexture; // where there is emission, and no image of reflectance
    bool is_green_down_;                                    // of normal maps
};

// Smoothing groups count where corners have no normals.
void keep_smoothing(Surface &surface) {
    if (surface.smoothing_groups.empty())
        return;
    std::vector<std::uint32_t> &groups = surface.smoothing_groups;
    const bool has_normals = !surface.normals.empty() && std::find(surface.normals.begin(), surface.normals.end(),
                                                                   glm::vec3(0.0F)) == surface.normals.end();
    if (has_normals) {
        surface.report.push_back({"smoothing groups", Fate::kept, "as the normals have it"});
        free_memory(groups);
        return;
    }
    const auto flat = static_cast<std::size_t>(std::count(groups.begin(), groups.end(), Surface::kFlat));
    surface.report.push_back({"smoothing groups", Fate::kept,
                              flat == groups.size()
                                  ? "all faces are flat; --crease-angle shades them smoothly"
                                  : counted(flat, "triangle") + " of " + std::to_string(groups.size()) +
                                        " flat, others smooth within their group; --crease-angle overrules them"});
    if (flat != groups.size())
        return;
    surface.crease_angle = 0;
    free_memory(groups);
}

// More materials than a model holds become colours of vertices.
void keep_materials(std::vector<std::uint16_t> of_vertices, const MaterialTable &table, Surface &surface) {
    const std::vector<Material> &materials = table.used();
    if (materials.size() == 1)
        return;
    of_vertices.resize(surface.positions.size(), 0);
    std::vector<std::uint16_t> numbers(materials.size(), kNoMaterial); // of those that a vertex has
    for (std::uint16_t &material : of_vertices) {
        material = material == kNoMaterial ? std::uint16_t{0} : material;
        if (numbers[material] == kNoMaterial) {
            numbers[material] = static_cast<std::uint16_t>(surface.materials.size());
            surface.materials.push_back(materials[material]);
            surface.reflectances.push_back(table.reflectances()[material]);
        }
    }
    if (surface.materials.size() <= kMaxMaterials) {
        for (const std::uint16_t material : of_vertices)
            surface.material_ids.push_back(static_cast<std::uint8_t>(numbers[material]));
        return;
    }
    const std::string count =
        std::to_string(surface.materials.size()) + " of them, a model has " + std::to_string(kMaxMaterials);
    surface.materials.clear();
    surface.reflectances.clear();
    if (!surface.colours.empty()) {
        surface.report.push_back({"materials", Fate::dropped, count + "; the points have colours of their own"});
        return;
    }
    for (const std::uint16_t material : of_vertices)
        surface.colours.push_back(materials[material].colour);
    surface.report.push_back({"materials", Fate::converted, count + ": their colours are those of the points"});
}

} // namespace

Result<Surface> read_obj(const ScanFile &file, const ReadOptions &options) {
    const auto part = [&](double from, double to) {
        return !options.progress ? std::function<void(double)>()
                                 : [&options, from, to](double done) { options.progress(from + done * (to - from)); };
    };
    ReadOptions of_text = options;
    of_text.progress = part(0, 0.7);
    Result<ObjText> text = read_obj_text(as_text(file.bytes), of_text);
    if (!text)
        return text.error();
    MaterialFiles found =
        read_material_files(material_files(file.path, text->material_lines), options.default_material);
    if (!found.materials.empty()) // they are read
        std::erase_if(text->report, [](const auto &line) { return line.name.starts_with(kMaterialsLine); });
    const MaterialTable materials(*text, found.materials, options.default_material);

    Surface surface;
    surface.dropped_triangles = text->dropped_faces;
    surface.report.push_back({"positions", Fate::kept, ""});
    if (!text->face_sizes.empty() || text->dropped_faces != 0)
        surface.report.push_back({"faces", Fate::kept, "polygons as triangles"});
    surface.report.insert(surface.report.end(), text->report.begin(), text->report.end());
    TextureImages images(surface, found.report);
    ObjFaces faces(*text, materials, images, options.flip_green, surface);
    faces.run(part(0.7, 1));
    keep_normals(surface, surface.vertex_copies == 0 ? "normals" : "each corner has its own");
    keep_smoothing(surface);
    keep_colours(text->colours, surface, [&](std::size_t vertex) {
        const std::vector<std::uint16_t> &of_vertices = faces.materials();
        const bool has_one = vertex < of_vertices.size() && of_vertices[vertex] != kNoMaterial;
        return materials.used()[has_one ? of_vertices[vertex] : 0].colour;
    });
    if (!text->texture_coordinates.empty())
        report_textures(surface);
    const bool is_said = found.materials.empty() && !text->material_lines.empty(); // none of the files is there
    if (!materials.undefined().empty() && !is_said)
        surface.report.push_back({"materials " + listed(materials.undefined()), Fate::converted,
                                  "no file defines them: the default material"});
    keep_materials(faces.materials(), materials, surface);
    if (options.progress)
        options.progress(1.0);
    surface.report.insert(surface.report.end(), found.report.begin(), found.report.end());
    return finished(std::move(surface), options);
}

std::vector<NamedFile> files_of_obj(const ScanFile &file) {
    std::vector<NamedFile> files = material_files(file.path, material_lines_of(as_text(file.bytes)));
    std::vector<NamedFile> images = read_material_files(files, {}).images;
    std::move(images.begin(), images.end(), std::back_inserter(files));
    return files;
}

} // namespace pbm::build
