#include "web_page.h"

#include "command_line/command_line.h"
#include "command_line/web_viewer.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/model/las_classes.h"
#include "pbm_render/camera/camera.h"
#include "system/files/file_names.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"
#include "viewer/options/option_values.h"
#include "viewer/pictures/jpeg_encoder.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <sstream>
#include <utility>
#include <vector>

namespace pbm {
namespace {

namespace fs = std::filesystem;

constexpr const char *kViewer = "pbm-viewer";                                                        // folder
constexpr const char *kPoster = "poster.jpg", *kTurned = "poster-turned.jpg", *kStyles = "page.css"; // files in it
constexpr int kPosterQuality = 80;

Error of_file(const fs::path &file, Error error) {
    error.message = file.string() + ": " + error.message;
    return error;
}

Result<std::string> read_text(const fs::path &file) {
    const Result<MappedFile> mapped = MappedFile::open(file.string());
    if (!mapped)
        return of_file(file, mapped.error());
    const ByteView bytes = mapped->bytes();
    return std::string(bytes.begin(), bytes.end());
}

Status write_file(const fs::path &file, ByteView bytes) {
    const Status written = replace_file(file.string(), bytes, Durability::cached);
    return written ? written : Status(of_file(file, written.error()));
}

Status put_file(const fs::path &from, const fs::path &to) {
    std::error_code ignored;
    if (fs::equivalent(from, to, ignored))
        return {};
    const Result<MappedFile> file = MappedFile::open(from.string());
    return file ? write_file(to, file->bytes()) : Status(of_file(from, file.error()));
}

// The query of an address that changes with the contents of a file.
std::string version_of(ByteView bytes) {
    std::ostringstream text;
    text << "?v=" << std::hex << std::setw(8) << std::setfill('0') << (hash64(bytes) & 0xFFFFFFFF);
    return text.str();
}

// Writes a file into the folder pbm-viewer of a page. Returns its address.
Result<std::string> put_made(const fs::path &folder, const std::string &name, ByteView bytes) {
    if (Status written = write_file(folder / kViewer / name, bytes); !written)
        return std::move(written).error();
    return std::string("./") + kViewer + "/" + name + version_of(bytes);
}

nlohmann::json metadata_of(const WebPage &page) { return nlohmann::json::parse(page.metadata, nullptr, false); }

std::string title_of(const WebPage &page) {
    const nlohmann::json metadata = metadata_of(page);
    if (metadata.is_object() && metadata.contains("name") && metadata["name"].is_string())
        return metadata["name"];
    return fs::path(page.name).stem().string();
}

// The smaller one of half the vertical and half the horizontal view angle.
double half_angle(double view_angle, glm::ivec2 size) {
    const double vertical = view_angle / 2;
    return std::min(vertical, std::atan(std::tan(vertical) * size.x / size.y));
}

// What search engines and previews say of a page.
std::string description_of(const WebPage &page) {
    const bool is_german = page.language == "de" || page.language.starts_with("de-");
    std::string text =
        title_of(page) + (is_german ? ": ein 3D-Scan zum Drehen und Vergrößern." : ": a 3D scan to turn and zoom.");
    const nlohmann::json metadata = metadata_of(page);
    if (metadata.is_object() && metadata.contains("credit") && metadata["credit"].is_string())
        text += " " + metadata["credit"].get<std::string>();
    return text;
}

// The distance that the element calls 100 % (orbitFrom in bindings/web/viewer/orbit.js): the sphere around the model's
// box touches the nearer borders of the picture.
double whole_radius(const WebPage &page) {
    glm::dvec3 lowest(std::numeric_limits<double>::infinity()), highest = -lowest;
    for (const glm::dvec3 &corner : page.extent.corners) {
        lowest = glm::min(lowest, corner);
        highest = glm::max(highest, corner);
    }
    return glm::length(highest - lowest) / 2 /
           std::sin(half_angle(page.camera.view_angle, {page.poster.width, page.poster.height}));
}

// The attributes of a camera that the command line asks for; without one the element frames the model itself.
std::string camera_attributes(const WebPage &page) {
    const ViewOptions &view = page.view;
    if (!view.position && !view.focal_point && !view.view_up && view.view_angle == ViewOptions().view_angle)
        return {};
    const Camera &camera = page.camera;
    const glm::dvec3 up = up_direction(page.up), front = front_direction(page.up), right = glm::cross(up, front);
    const glm::dvec3 away = camera.position - camera.focal_point;
    const double radius = glm::length(away), percent = 100 * radius / whole_radius(page);
    std::ostringstream text;
    text.precision(9);
    text << "\n            camera-orbit=\"" << std::atan2(glm::dot(away, right), glm::dot(away, front)) << "rad "
         << std::acos(std::clamp(glm::dot(away, up) / radius, -1.0, 1.0)) << "rad " << percent << "%\" camera-target=\""
         << camera.focal_point.x << ' ' << camera.focal_point.y << ' ' << camera.focal_point.z << "\" field-of-view=\""
         << camera.view_angle << "rad\"";
    return text.str();
}

// All attributes that the command line asks for.
std::string view_attributes(const WebPage &page) {
    const ViewOptions &view = page.view;
    std::string text = camera_attributes(page);
    if (view.backs != Backs::automatic)
        text += " backs=\"" + word_of(view.backs) + '"';
    const LookOptions &look = view.look;
    if (look.render.shading != Shading::automatic)
        text += " shading=\"" + word_of(look.render.shading) + '"';
    if (look.lights_follow)
        text += " light-follows=\"" + word_of(*look.lights_follow) + '"';
    if (look.headlight)
        text += " headlight=\"" + to_string(Value(look.headlight->right)) + "deg " +
                to_string(Value(look.headlight->up)) + "deg\"";
    if (look.colour_by)
        text += " colour-by=\"" + command_line::markup(colour_by_text(*look.colour_by)) + '"' +
                (look.legend ? "" : " no-legend");
    if (look.classes.dropped.any())
        text += " drop-class=\"" + list_of(look.classes.dropped) + '"';
    if (look.classes.shown)
        text += " show-class=\"" + list_of(*look.classes.shown) + '"';
    return text;
}

std::string background_of(const ViewOptions &view) {
    const auto css = [](const Rgba8 &colour) {
        std::ostringstream text;
        text << "rgb(" << int{colour[0]} << ' ' << int{colour[1]} << ' ' << int{colour[2]} << " / " << colour[3] / 255.0
             << ')';
        return text.str();
    };
    const RenderOptions &render = view.look.render;
    return render.background_below
               ? "linear-gradient(" + css(render.background) + ", " + css(*render.background_below) + ")"
               : css(render.background);
}

// Fills the places of a text; values may look like places.
std::string filled(const std::string &text, const std::vector<std::pair<std::string_view, std::string>> &values) {
    std::string out;
    for (std::size_t at = 0; at < text.size();) {
        const auto found = std::find_if(values.begin(), values.end(), [&](const auto &value) {
            return std::string_view(text).substr(at).starts_with(value.first);
        });
        out += found == values.end() ? text.substr(at, 1) : found->second;
        at += found == values.end() ? 1 : found->first.size();
    }
    return out;
}

// Copies the files of the list; adds their sizes.
Status copy_viewer(const fs::path &from, const fs::path &to, WebPageSizes &sizes) {
    const Result<std::string> list = read_text(from / command_line::kPageFiles);
    if (!list)
        return list.error();
    std::istringstream lines(*list);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string name, use;
        std::uint64_t bytes = 0;
        words >> name >> bytes >> use;
        if (Status copied = put_file(from / name, to / name); !copied)
            return copied;
        (use == "isolated" ? sizes.threaded_viewer : sizes.viewer) += bytes;
    }
    return {};
}

struct PageContents {
    ByteView poster, turned, model;
};

// Posters, styles and index.html, unless it is to stay. Adds the size of the page.
Status write_texts(const fs::path &viewer, const WebPage &page, const PageContents &contents, WebPageSizes &sizes) {
    const fs::path folder = page.folder;
    const Result<std::string> form = read_text(viewer / command_line::kPageForm);
    const Result<std::string> style_form = read_text(viewer / kStyles);
    if (!form || !style_form)
        return form ? style_form.error() : form.error();
    const std::string background = background_of(page.view);
    const std::string styles = filled(*style_form, {{"@BACKGROUND@", background}});
    const Result<std::string> poster = put_made(folder, kPoster, contents.poster);
    const Result<std::string> turned = put_made(folder, kTurned, contents.turned);
    const Result<std::string> style = put_made(folder, kStyles, as_bytes(styles));
    for (const Result<std::string> *made : {&poster, &turned, &style})
        if (!*made)
            return made->error();
    const bool is_wide = page.poster.width >= page.poster.height;
    const std::string base = page.url.empty() || page.url.ends_with('/') ? page.url : page.url + "/";
    const std::string text = command_line::sealed_page(
        filled(*form, {{"@LANGUAGE@", command_line::markup(page.language)},
                       {"@TITLE@", command_line::markup(title_of(page))},
                       {"@DESCRIPTION@", command_line::markup(description_of(page))},
                       {"@MODEL@", "./" + uri_of(page.name) + version_of(contents.model)},
                       {"@WIDE@", is_wide ? *poster : *turned},
                       {"@NARROW@", is_wide ? *turned : *poster},
                       {"@IMAGE@", base.empty() ? *poster : command_line::markup(base) + poster->substr(2)},
                       {"@STYLES@", *style},
                       {"@BACKGROUND@", background},
                       {"@VIEW@", view_attributes(page)}}));
    sizes.page = text.size() + styles.size();
    return sizes.is_kept ? Status() : write_file(folder / command_line::kPage, as_bytes(text));
}

} // namespace

double distance_factor(double view_angle, glm::ivec2 from, glm::ivec2 to) {
    return std::sin(half_angle(view_angle, from)) / std::sin(half_angle(view_angle, to));
}

Result<WebPageSizes> write_web_page(const WebPage &page) {
    const Result<std::string> viewer = command_line::find_web_viewer(page.folder);
    if (!viewer)
        return viewer.error();
    const fs::path folder = page.folder;
    std::error_code error;
    fs::create_directories(folder / kViewer, error);
    if (error)
        return Error{ErrorCode::io, 0, folder.string() + ": cannot make this folder: " + error.message()};
    WebPageSizes sizes;
    if (Status copied = copy_viewer(*viewer, folder / kViewer, sizes); !copied)
        return copied.error();
    if (Status copied = put_file(page.model, folder / page.name); !copied)
        return copied.error();
    const Result<MappedFile> model = MappedFile::open((folder / page.name).string());
    if (!model)
        return of_file(folder / page.name, model.error());
    sizes.model = model->bytes().size();
    const Result<Bytes> poster = encode_jpeg(page.poster, kPosterQuality);
    const Result<Bytes> turned = encode_jpeg(page.turned, kPosterQuality);
    if (!poster || !turned)
        return poster ? turned.error() : poster.error();
    sizes.poster = std::max(poster->size(), turned->size());
    sizes.is_kept = command_line::is_edited_page(page.folder);
    const Status written = write_texts(*viewer, page, {*poster, *turned, model->bytes()}, sizes);
    return written ? Result<WebPageSizes>(sizes) : written.error();
}

} // namespace pbm
