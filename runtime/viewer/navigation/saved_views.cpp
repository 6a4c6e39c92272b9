#include "viewer/navigation/saved_views.h"

#include "system/files/file_names.h"
#include "system/files/file_replacement.h"
#include "viewer/options/option_values.h"
#include "viewer/options/view_options.h"

#include <charconv>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <vector>

namespace pbm {
namespace {

namespace fs = std::filesystem;

std::string full_path(const std::string &path) {
    std::error_code error;
    const fs::path full = fs::absolute(path, error);
    return error ? path : full.lexically_normal().string();
}

// A line without its options.
struct Key {
    std::string number, path;
    bool operator==(const Key &) const = default;
};
Key key_of(const std::string &line) { return {line.substr(0, line.find(' ')), line.substr(line.find('\t') + 1)}; }

std::vector<std::string> read_lines(const std::string &file) {
    std::vector<std::string> lines;
    std::ifstream in(file);
    for (std::string line; lines.size() < SavedViews::kMax && std::getline(in, line);)
        if (line.find(' ') < line.find('\t') && line.find('\t') != std::string::npos)
            lines.push_back(line);
    return lines;
}

template <class Value> std::optional<Value> parsed(const Result<Value> &value) {
    return value ? std::optional(*value) : std::nullopt;
}

// Reads what camera_as_options writes.
std::optional<SavedView> parse_view(const std::string &line) {
    ViewOptions options;
    std::istringstream words(line.substr(0, line.find('\t')));
    std::string word;
    for (words >> word; words >> word;) { // the number comes first
        const std::size_t equals = word.find('=');
        if (equals == std::string::npos)
            return std::nullopt;
        const std::string name = word.substr(0, equals), value = word.substr(equals + 1);
        const auto vector = parse_vector(value);
        if (name == "--camera-position" && vector)
            options.position = *vector;
        else if (name == "--camera-focal-point" && vector)
            options.focal_point = *vector;
        else if (name == "--camera-view-up" && vector)
            options.view_up = *vector;
        else if (name == "--camera-view-angle")
            std::from_chars(value.data(), value.data() + value.size(), options.view_angle);
        else if (name == "--clip-plane")
            options.clip.plane = parsed(parse_clip_plane(value));
        else if (name == "--clip-box")
            options.clip.box = parsed(parse_clip_box(value));
        else if (name == "--backs")
            options.backs = value == "show" ? Backs::show : Backs::hide;
        else if (name == "--projection")
            options.orthographic = value == "orthographic";
    }
    if (!options.position || !options.focal_point || !options.view_up)
        return std::nullopt;
    // The file gives the whole camera, so the model does not matter.
    const Extent any{.sphere = {.centre = {}, .radius = 1}, .corners = {glm::dvec3(-1), glm::dvec3(1)}};
    const auto camera = choose_camera(options, any, Grid{}, {1, 1});
    return camera ? std::optional(SavedView{*camera, options.view_angle}) : std::nullopt;
}

} // namespace

std::string SavedViews::default_file() {
    const std::string folder = xdg_folder("XDG_STATE_HOME", ".local/state", "pbm");
    return folder.empty() ? "" : (fs::path(folder) / "views").string();
}

std::optional<SavedView> SavedViews::find(const std::string &path, int number) const {
    const Key key{std::to_string(number), full_path(path)};
    for (const std::string &line : read_lines(file_))
        if (key_of(line) == key)
            return parse_view(line);
    return std::nullopt;
}

Status SavedViews::save(const std::string &path, int number, const SavedView &view) const {
    const Key key{std::to_string(number), full_path(path)};
    if (file_.empty() || key.path.find('\n') != std::string::npos)
        return usage_error("views of this model cannot be kept");
    // The newest first.
    std::string text = key.number + camera_as_options(view.camera, view.view_angle) + '\t' + key.path + '\n';
    std::size_t count = 1;
    for (const std::string &line : read_lines(file_))
        if (key_of(line) != key && count++ < kMax)
            text += line + '\n';
    std::error_code error;
    fs::create_directories(fs::path(file_).parent_path(), error);
    return replace_file(file_, as_bytes(text), Durability::cached);
}

} // namespace pbm
