#include "pbm_batch/scan_list.h"

#include "command_line/scan_extensions.h"
#include "system/files/descriptor.h"
#include "system/files/file_names.h"
#include "system/files/mapped_file.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>
#include <system_error>
#include <unordered_map>

namespace pbm::batch {
namespace {

namespace fs = std::filesystem;

Error usage(const std::string &message) { return {ErrorCode::usage, 0, message}; }

bool is_named_like_scan(const fs::path &file) {
    const std::string extension = lower_extension(uncompressed_name(file.string()));
    const auto &known = command_line::kScanExtensions;
    return std::find(known.begin(), known.end(), extension) != known.end();
}

// By name, so that the order does not depend on the file system.
Result<std::vector<fs::path>> scans_below(const fs::path &folder) {
    std::vector<fs::path> files;
    std::error_code error;
    fs::recursive_directory_iterator each(folder, error), end;
    for (; !error && each != end; each.increment(error)) {
        const bool is_hidden = each->path().filename().string().starts_with('.');
        if (is_hidden && each->is_directory(error))
            each.disable_recursion_pending();
        else if (!is_hidden && each->is_regular_file(error) && is_named_like_scan(each->path()))
            files.push_back(each->path());
    }
    if (error)
        return io_error("cannot read the folder", error.value());
    std::sort(files.begin(), files.end());
    return files;
}

Result<std::vector<fs::path>> scans_of_list(const std::string &list, const fs::path &folder) {
    constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;
    const Result<MappedFile> file = is_stream(list) ? MappedFile::read_stream(list, kMaxBytes) : MappedFile::open(list);
    if (!file)
        return file.error();
    constexpr std::string_view kMark = "\xEF\xBB\xBF"; // of UTF-8, as some editors write it
    std::string text(file->bytes().begin(), file->bytes().end());
    text.erase(0, text.starts_with(kMark) ? kMark.size() : 0);
    if (text.find('\0') != std::string::npos)
        return usage("a NUL byte: it is no list of scans but perhaps a scan itself; write a path a line");
    std::vector<fs::path> files;
    std::unordered_map<std::string, std::size_t> line_of;
    std::istringstream lines(text);
    std::size_t number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        if (line.ends_with('\r'))
            line.pop_back();
        if (line.find_first_not_of(" \t") == std::string::npos || line.starts_with('#'))
            continue;
        fs::path path = folder / line; // not normalised: a link before ".." leads elsewhere
        const auto [first, is_new] = line_of.emplace(path.lexically_normal().string(), number);
        if (!is_new)
            return usage("line " + std::to_string(number) + " names the scan of line " + std::to_string(first->second) +
                         " again");
        files.push_back(std::move(path));
    }
    return files;
}

// Where a scan lies below `root`; its name only if it lies elsewhere.
fs::path place_of(const fs::path &file, const fs::path &root) {
    const fs::path place = file.lexically_normal().lexically_relative(root);
    return place.empty() || *place.begin() == ".." ? file.filename() : place;
}

// The folder below which both lie.
fs::path common_folder(const fs::path &a, const fs::path &b) {
    std::error_code ignored;
    const fs::path first = fs::absolute(a, ignored).lexically_normal(),
                   second = fs::absolute(b, ignored).lexically_normal();
    fs::path folder;
    auto of_first = first.begin();
    for (auto of_second = second.begin();
         of_first != first.end() && of_second != second.end() && *of_first == *of_second; ++of_first, ++of_second)
        folder /= *of_first;
    return folder;
}

// What to do about two scans that become one model: those from elsewhere than below `root` got their names only.
std::string advice(const std::string &a, const std::string &b, const fs::path &root, bool is_stream) {
    const auto is_elsewhere = [&](const fs::path &file) {
        const fs::path place = file.lexically_normal().lexically_relative(root);
        return place.empty() || *place.begin() == "..";
    };
    if (!is_elsewhere(a) && !is_elsewhere(b))
        return "rename one of them, or build it by a list of its own";
    return (is_stream ? "run this in " : "move the list to ") + common_folder(a, b).string() +
           ", below which both lie: their models then lie as they do";
}

} // namespace

Result<std::vector<Scan>> read_scan_list(const std::string &list_or_folder, const std::string &output_folder) {
    std::error_code ignored;
    const bool is_folder = fs::is_directory(list_or_folder, ignored);
    const fs::path root = is_folder                   ? fs::path(list_or_folder).lexically_normal()
                          : is_stream(list_or_folder) ? fs::path()
                                                      : fs::path(list_or_folder).parent_path().lexically_normal();
    const auto files = is_folder ? scans_below(root) : scans_of_list(list_or_folder, root);
    if (!files)
        return files.error();
    if (files->empty())
        return usage(is_folder ? "no file in this folder is named like a scan; --batch takes a list of files, too"
                               : "the list names no scan");
    std::vector<Scan> scans;
    std::map<fs::path, int> uses;
    for (const fs::path &file : *files) {
        const fs::path place = place_of(file, root);
        ++uses[fs::path(uncompressed_name(place.string())).replace_extension()];
        std::error_code missing;
        const std::uintmax_t bytes = fs::file_size(file, missing);
        scans.push_back({.name = place.string(), .input = file.string(), .output = {}, .bytes = missing ? 0 : bytes});
    }
    std::map<std::string, std::string> input_of;
    for (Scan &scan : scans) {
        const fs::path stem = fs::path(uncompressed_name(scan.name)).replace_extension();
        scan.output = (fs::path(output_folder) / (uses[stem] == 1 ? stem.string() : scan.name)).string() + ".pbvg";
        const auto [other, is_new] = input_of.emplace(scan.output, scan.input);
        if (!is_new)
            return usage(scan.input + " and " + other->second + " would both become " + scan.output + "; " +
                         advice(scan.input, other->second, root, is_stream(list_or_folder)));
    }
    return scans;
}

} // namespace pbm::batch
