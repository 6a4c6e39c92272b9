#include "viewer/opening/file_list.h"

#include "command_line/scan_extensions.h"
#include "system/files/file_names.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>

namespace pbm {
namespace {

namespace fs = std::filesystem;

constexpr const char *kModelExtension = ".pbvg";

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The name with every number behind its count of digits, so that text order is the order of numbers.
std::string sort_key(const fs::path &path) {
    const std::string name = path.filename().string();
    std::string key;
    for (std::size_t i = 0; i < name.size();) {
        if (!is_digit(name[i])) {
            key += lower_case(name[i++]);
            continue;
        }
        const std::size_t first = std::min(name.find_first_not_of('0', i), name.size());
        const std::size_t end = static_cast<std::size_t>(
            std::find_if_not(name.begin() + static_cast<std::ptrdiff_t>(first), name.end(), is_digit) - name.begin());
        key += '0';
        key += static_cast<char>(std::min<std::size_t>(end - first, 100));
        key += name.substr(first, end - first);
        i = end;
    }
    return key + '\0' + name;
}

bool is_shown(const fs::path &path) {
    const std::string name(uncompressed_name(path.native())), extension = lower_extension(name);
    if (extension == kModelExtension || extension == ".bvg")
        return true;
    const auto &scans = command_line::kScanExtensions;
    std::error_code ignored;
    return std::find(scans.begin(), scans.end(), extension) != scans.end() &&
           !fs::exists(fs::path(name).replace_extension(kModelExtension), ignored);
}

} // namespace

std::vector<std::string> models_of_folder(const std::string &folder) {
    std::vector<std::pair<std::string, std::string>> found;
    std::error_code error;
    for (fs::directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
        std::error_code ignored;
        if (each->is_regular_file(ignored) && is_shown(each->path()))
            found.emplace_back(sort_key(each->path()), each->path().string());
    }
    std::sort(found.begin(), found.end());
    std::vector<std::string> files;
    files.reserve(found.size());
    for (auto &[key, file] : found)
        files.push_back(std::move(file));
    return files;
}

Result<FileList> FileList::of(const std::vector<std::string> &paths) {
    FileList list;
    std::error_code ignored;
    for (const std::string &path : paths) {
        if (!fs::is_directory(path, ignored)) {
            list.files_.push_back(path);
            continue;
        }
        std::vector<std::string> inside = models_of_folder(path);
        if (inside.empty())
            return Error{ErrorCode::io, 0, path + ": this folder has no model (.pbvg) and no scan in it"};
        list.files_.insert(list.files_.end(), std::make_move_iterator(inside.begin()),
                           std::make_move_iterator(inside.end()));
    }
    list.is_single_ = paths.size() == 1 && !fs::is_directory(paths.front(), ignored);
    return list;
}

bool FileList::step(int steps) {
    if (files_.empty())
        return false;
    std::error_code ignored;
    const fs::path here = current();
    if (is_single_) {
        const fs::path folder = here.has_parent_path() ? here.parent_path() : ".";
        std::vector<std::string> neighbours = models_of_folder(folder.string());
        const auto same = [&](const std::string &file) { return fs::path(file).filename() == here.filename(); };
        auto at = std::find_if(neighbours.begin(), neighbours.end(), same);
        if (at == neighbours.end()) // a scan beside its model, or of another extension
            at = neighbours.insert(std::find_if(neighbours.begin(), neighbours.end(),
                                                [&](const auto &file) { return sort_key(file) > sort_key(here); }),
                                   here.string());
        at_ = static_cast<std::size_t>(at - neighbours.begin());
        files_ = std::move(neighbours);
        is_single_ = false;
    }
    const auto count = static_cast<std::ptrdiff_t>(files_.size());
    at_ = static_cast<std::size_t>(((static_cast<std::ptrdiff_t>(at_) + steps) % count + count) % count);
    return files_.size() > 1;
}

std::string FileList::position() const {
    return files_.size() < 2 ? "" : " (" + std::to_string(at_ + 1) + " of " + std::to_string(files_.size()) + ")";
}

} // namespace pbm
