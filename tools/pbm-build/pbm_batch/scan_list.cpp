#include "pbm_batch/scan_list.h"

#include "command_line/scan_extensions.h"
#include "pbm_scan/foreign_formats.h"
#include "system/files/descriptor.h"
#include "system/files/file_names.h"
#include "system/files/mapped_file.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <system_error>
#include <unordered_map>

namespace pbm::batch {
namespace {

namespace fs = std::filesystem;

bool is_named_like_scan(const fs::path &file) {
    const std::string extension = lower_extension(uncompressed_name(file.string()));
    const auto &known = command_line::kScanExtensions;
    return std::find(known.begin(), known.end(), extension) != known.end();
}

// "FBX" of a file that is named like a scan of a kind that is not read; empty: of another file.
std::string foreign_kind(const fs::path &file) {
    std::string extension = lower_extension(uncompressed_name(file.string()));
    if (extension == ".pbvg" || extension == ".bvg" || extension == ".pbm" || !build::foreign_by_name(extension))
        return {};
    for (char &c : extension)
        c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    return extension.substr(1);
}

// The kind of an entry of a folder that is neither a folder nor a scan; empty: one that needs no word.
std::string kind_left_out(const fs::path &file, fs::file_type type) {
    if (type == fs::file_type::regular)
        return foreign_kind(file);
    if (!is_named_like_scan(file))
        return {};
    return type == fs::file_type::fifo ? "pipe" : type == fs::file_type::socket ? "socket" : "device";
}

// Finds the scans of a folder and below.
class FolderWalk {
  public:
    explicit FolderWalk(bool keep_going) : keep_going_(keep_going) {}

    // By name, so that the order does not depend on the file system.
    Result<std::vector<fs::path>> scans_below(const fs::path &root) {
        folders_.push_back(root);
        while (!folders_.empty()) {
            const fs::path folder = std::move(folders_.back());
            folders_.pop_back();
            std::error_code error;
            for (fs::directory_iterator each(folder, error), end; !error && each != end; each.increment(error))
                if (!each->path().filename().string().starts_with('.'))
                    take(*each);
            if (error && (!keep_going_ || folder == root))
                return io_error((folder == root ? "" : folder.string() + ": ") + "cannot read the folder",
                                error.value());
            if (error)
                left_out_.push_back({folder.string(), "folder that cannot be read", true});
        }
        std::sort(scans_.begin(), scans_.end());
        std::sort(left_out_.begin(), left_out_.end(),
                  [](const LeftOut &a, const LeftOut &b) { return a.path < b.path; });
        return std::move(scans_);
    }

    std::vector<LeftOut> left_out() && { return std::move(left_out_); }

  private:
    void take(const fs::directory_entry &entry) {
        std::error_code missing;
        const bool is_link = entry.is_symlink(missing);
        const fs::file_type type = entry.status(missing).type();
        if (type == fs::file_type::directory) {
            if (is_link)
                left_out_.push_back({entry.path().string(), "linked folder"});
            else
                folders_.push_back(entry.path());
            return;
        }
        // A link to nowhere fails when it is built, and so does what may not be examined.
        const bool is_there =
            type != fs::file_type::not_found && type != fs::file_type::none && type != fs::file_type::unknown;
        if (is_named_like_scan(entry.path()) && (type == fs::file_type::regular || !is_there))
            scans_.push_back(entry.path());
        else if (std::string kind = is_there ? kind_left_out(entry.path(), type) : "broken link"; !kind.empty())
            left_out_.push_back({entry.path().string(), std::move(kind)});
    }

    bool keep_going_;
    std::vector<fs::path> folders_; // that are still to be read
    std::vector<fs::path> scans_;
    std::vector<LeftOut> left_out_;
};

Result<std::vector<fs::path>> scans_of_list(const std::string &list, const fs::path &folder) {
    constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;
    const Result<MappedFile> file = is_stream(list) ? MappedFile::read_stream(list, kMaxBytes) : MappedFile::open(list);
    if (!file)
        return file.error();
    constexpr std::string_view kMark = "\xEF\xBB\xBF"; // of UTF-8, as some editors write it
    std::string text(file->bytes().begin(), file->bytes().end());
    text.erase(0, text.starts_with(kMark) ? kMark.size() : 0);
    if (text.find('\0') != std::string::npos)
        return usage_error("a NUL byte: it is no list of scans but perhaps a scan itself; write a path a line");
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
            return usage_error("line " + std::to_string(number) + " names the scan of line " +
                               std::to_string(first->second) + " again");
        files.push_back(std::move(path));
    }
    return files;
}

// Where a scan lies below `root`; empty if it lies elsewhere.
fs::path place_below(const fs::path &root, const fs::path &file) {
    fs::path place = file.lexically_normal().lexically_relative(root);
    return !place.empty() && *place.begin() == ".." ? fs::path() : place;
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
std::string advice(const Scan &a, const Scan &b, const fs::path &root) {
    if (a.name != b.name)
        return "--keep-extension names models after the whole names of scans";
    if (!place_below(root, a.input).empty() && !place_below(root, b.input).empty())
        return "rename one of them, or build it by a list of its own";
    return "with --batch-root=" + common_folder(a.input, b.input).string() +
           ", below which both lie, models lie as they do";
}

} // namespace

std::string kinds_of(std::span<const LeftOut> left_out) {
    std::map<std::string, std::size_t> counts;
    for (const LeftOut &each : left_out)
        ++counts[each.kind];
    std::string text;
    for (const auto &[kind, count] : counts)
        text += (text.empty() ? "" : ", ") + kind + " (" + std::to_string(count) + ")";
    return text;
}

std::string root_of(const ScanRequest &request) {
    std::error_code ignored;
    const fs::path given(request.list_or_folder);
    const fs::path root = !request.root.empty()               ? fs::path(request.root)
                          : fs::is_directory(given, ignored)  ? given
                          : is_stream(request.list_or_folder) ? fs::path()
                                                              : given.parent_path();
    return root.lexically_normal().string();
}

Result<ScanList> read_scan_list(const ScanRequest &request) {
    std::error_code ignored;
    const bool is_folder = fs::is_directory(request.list_or_folder, ignored);
    const fs::path given = fs::path(request.list_or_folder).lexically_normal(), root(root_of(request));
    FolderWalk walk(request.keep_going);
    const auto files = is_folder ? walk.scans_below(given)
                                 : scans_of_list(request.list_or_folder,
                                                 is_stream(request.list_or_folder) ? fs::path() : given.parent_path());
    if (!files)
        return files.error();
    ScanList list{.scans = {}, .left_out = std::move(walk).left_out()};
    if (files->empty())
        return usage_error(!is_folder ? "the list names no scan"
                           : !list.left_out.empty()
                               ? "no scan in this folder; left out: " + kinds_of(list.left_out)
                               : "no file in this folder is named like a scan; --batch takes a list "
                                 "of files, too");
    std::unordered_map<std::string, std::size_t> known; // numbers of scans by outputs
    for (const fs::path &file : *files) {
        const fs::path below = place_below(root, file), place = below.empty() ? file.filename() : below;
        const std::string stem =
            (request.keep_extension ? place : fs::path(uncompressed_name(place.string())).replace_extension()).string();
        std::error_code missing;
        const std::uintmax_t bytes = fs::file_size(file, missing);
        Scan scan{.name = place.string(),
                  .input = file.string(),
                  .output = (fs::path(request.output_folder) / stem).string() + ".pbvg",
                  .bytes = missing ? 0 : bytes};
        const auto [other, is_new] = known.emplace(scan.output, list.scans.size());
        if (!is_new) {
            const Scan &first = list.scans[other->second];
            return usage_error(scan.input + " and " + first.input + " would both become " + scan.output + "; " +
                               advice(scan, first, root));
        }
        list.scans.push_back(std::move(scan));
    }
    return list;
}

std::vector<std::string> other_models(const std::string &output_folder, std::span<const Scan> scans) {
    std::set<std::string> made;
    for (const Scan &scan : scans)
        made.insert(scan.output);
    std::vector<std::string> others;
    std::error_code error; // what cannot be read is not known
    for (fs::recursive_directory_iterator each(output_folder, error), end; !error && each != end; each.increment(error))
        if (lower_extension(each->path().string()) == ".pbvg" && !made.contains(each->path().string()))
            others.push_back(each->path().string());
    std::sort(others.begin(), others.end());
    return others;
}

} // namespace pbm::batch
