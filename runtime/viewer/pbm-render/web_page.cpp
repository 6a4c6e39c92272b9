#include "web_page.h"

#include "command_line/command_line.h"
#include "command_line/web_viewer.h"
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
#include <limits>
#include <sstream>
#include <utility>
#include <vector>

namespace pbm {
namespace {

namespace fs = std::filesystem;

constexpr const char *kViewer = "pbm-viewer", *kPoster = "poster.jpg"; // folder, and a file in it
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

std::string title_of(const WebPage &page) {
    const nlohmann::json metadata = nlohmann::json::parse(page.metadata, nullptr, false);
    if (metadata.is_object() && metadata.contains("name") && metadata["name"].is_string())
        return metadata["name"];
    return fs::path(page.name).stem().string();
}

// The distance that the element calls 100 % (orbitFrom in bindings/web/viewer/orbit.js): the sphere around the model's
// box touches the nearer borders of the picture.
double whole_radius(const WebPage &page) {
    glm::dvec3 lowest(std::numeric_limits<double>::infinity()), highest = -lowest;
    for (const glm::dvec3 &corner : page.extent.corners) {
        lowest = glm::min(lowest, corner);
        highest = glm::max(highest, corner);
    }
    const double vertical = page.camera.view_angle / 2;
    const double horizontal = std::atan(std::tan(vertical) * page.poster.width / page.poster.height);
    return glm::length(highest - lowest) / 2 / std::sin(std::min(vertical, horizontal));
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

} // namespace

Result<WebPageSizes> write_web_page(const WebPage &page) {
    const Result<std::string> viewer = command_line::find_web_viewer(page.folder);
    if (!viewer)
        return viewer.error();
    const Result<std::string> form = read_text(fs::path(*viewer) / command_line::kPageForm);
    if (!form)
        return form.error();
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
    sizes.model = fs::file_size(folder / page.name, error);
    const Result<Bytes> poster = encode_jpeg(page.poster, kPosterQuality);
    if (!poster)
        return poster.error();
    sizes.poster = poster->size();
    if (Status written = write_file(folder / kViewer / kPoster, *poster); !written)
        return written.error();
    const std::string text = filled(*form, {{"@TITLE@", command_line::markup(title_of(page))},
                                            {"@MODEL@", "./" + uri_of(page.name)},
                                            {"@POSTER@", std::string("./") + kViewer + "/" + kPoster},
                                            {"@BACKGROUND@", background_of(page.view)},
                                            {"@VIEW@", view_attributes(page)}});
    sizes.page = text.size();
    if (Status written = write_file(folder / command_line::kPage, as_bytes(text)); !written)
        return written.error();
    return sizes;
}

} // namespace pbm
