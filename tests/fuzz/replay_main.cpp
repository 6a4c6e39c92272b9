// Feeds files to a fuzz target once, without libFuzzer: NAME_fuzz [-OPTION]... FILE|FOLDER...
// An empty or missing folder is an error: a corpus that replays nothing tests nothing.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size);

namespace {

namespace fs = std::filesystem;

std::vector<fs::path> files_below(const fs::path &path) {
    std::vector<fs::path> files;
    if (fs::is_regular_file(path)) {
        files.push_back(path);
    } else if (fs::is_directory(path)) {
        for (const fs::directory_entry &entry : fs::recursive_directory_iterator(path))
            if (entry.is_regular_file())
                files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    return files;
}

} // namespace

int main(int argc, char **argv) {
    std::size_t replayed = 0;
    for (int i = 1; i < argc; ++i) {
        if (argv[i][0] == '-')
            continue; // a libFuzzer option, ignored
        const std::vector<fs::path> files = files_below(argv[i]);
        for (const fs::path &file : files) {
            std::ifstream in(file, std::ios::binary);
            const std::vector<char> text(std::istreambuf_iterator<char>(in), {});
            // A copy of exactly this size: a sanitizer sees any access beyond.
            const std::vector<std::uint8_t> bytes(text.begin(), text.end());
            std::fprintf(stderr, "%s\n", file.c_str()); // after a crash the last printed name is the culprit
            LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
            ++replayed;
        }
    }
    std::printf("%zu inputs replayed\n", replayed);
    return replayed == 0 ? 1 : 0;
}
