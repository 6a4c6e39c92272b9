// A file changes while it is mapped. Each case is a process of its own, which must exit by itself: with its work done
// (0), with damage found (3), or with a message because the file became shorter (2).
#include "campaign.h"
#include "goldens.h"
#include "judge.h"

#include "pbm_format/reading/load_model.h"
#include "system/files/mapped_file.h"
#include "system/processes/this_process.h"
#include "unit/support/test_models.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace pbm::faults {
namespace {

using test::Random;

enum class Change : std::uint8_t { shrunk, emptied, grown, rewritten, unlinked };
constexpr std::array<const char *, 5> kChanges{"shrunk", "emptied", "grown", "rewritten", "unlinked"};
enum class Work : std::uint8_t { verify, validate, load, draw };
constexpr std::array<const char *, 4> kWorks{"verify", "validate", "load_model", "render"};

// Changes the file by system calls, never through its mapping.
void change(const std::string &path, Change how, std::uint64_t size, Random &random) {
    const int file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    const auto begin = static_cast<off_t>(random.below(size));
    const Bytes other(4096, static_cast<std::uint8_t>(random.next()));
    bool done = file >= 0;
    switch (how) {
    case Change::shrunk: done = ::ftruncate(file, begin) == 0; break;
    case Change::emptied: done = ::ftruncate(file, 0) == 0; break;
    case Change::grown: done = ::ftruncate(file, static_cast<off_t>(size + 100000)) == 0; break;
    case Change::rewritten: done = ::pwrite(file, other.data(), std::min<std::size_t>(4096, size), begin) > 0; break;
    case Change::unlinked: done = ::unlink(path.c_str()) == 0; break;
    }
    ::close(file);
    if (!done)
        std::perror("change");
}

int exit_of(const Status &status) { return status ? 0 : exit_code(status.error().code); }

int work(ByteView file, Work what, int threads) {
    switch (what) {
    case Work::verify: return exit_of(verify(file, {.threads = threads}));
    case Work::validate: {
        const ValidationReport report = validate(file, {.threads = threads});
        return report.valid() ? 0 : 3;
    }
    case Work::load: {
        Result<Reader> reader = Reader::open(file);
        const Result<Model> model = reader ? load_model(*reader, {.threads = threads, .fields = true}) : reader.error();
        return model ? 0 : exit_code(model.error().code);
    }
    case Work::draw: break;
    }
    return exit_of(open_and_draw(file, threads));
}

// In the child: maps the file and works on it repeatedly until the change, and once more after it.
[[noreturn]] void run_case(const std::string &path, Change how, Work what, Random random, int message) {
    ::dup2(message, STDERR_FILENO);
    end_when_mapped_file_shrinks("faults");
    const Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        ::_exit(100);
    const std::uint64_t size = file->bytes().size();
    int code = 0;
    {
        std::atomic<bool> changed{false};
        const std::jthread other([&] {
            std::this_thread::sleep_for(std::chrono::microseconds(random.below(600)));
            change(path, how, size, random);
            changed = true;
        });
        for (bool once_more = true; once_more;) {
            once_more = !changed;
            code = work(file->bytes(), what, 1 + static_cast<int>(size % 2));
        }
    }
    ::_exit(code);
}

std::string text_of(int pipe) {
    std::string text;
    std::array<char, 512> buffer{};
    for (ssize_t got = 0; (got = ::read(pipe, buffer.data(), buffer.size())) > 0 || (got < 0 && errno == EINTR);)
        text.append(buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    return text;
}

void judge(Change how, int state, const std::string &said, const std::string &story, Tally &tally) {
    tally.add_case();
    if (!tally.require(WIFEXITED(state), story + ": died of signal " + std::to_string(WTERMSIG(state)) + ", " + said))
        return;
    const int code = WEXITSTATUS(state);
    const bool whole = how == Change::grown || how == Change::unlinked;
    tally.require(whole ? code == 0 : code == 0 || code == 2 || code == 3,
                  story + ": exit code " + std::to_string(code) + ", " + said);
    tally.require(how != Change::emptied || code == 2, story + ": not noticed");
    const bool line = said.find("became shorter") != std::string::npos && said.find('\n') == said.size() - 1;
    tally.require(code == 2 ? line : said.empty(), story + ": said " + said);
    if (code != 0)
        tally.add_detected();
    tally.count(code == 0 ? "whole" : code == 2 ? "gone (exit code 2)" : "damaged (exit code 3)");
}

} // namespace

void change_mapped_files(const Options &options, Tally &tally) {
    const std::vector<Golden> files = goldens(64 << 10);
    const std::string path =
        (std::filesystem::temp_directory_path() / ("pbm_faults_" + std::to_string(::getpid()) + ".pbvg")).string();
    const std::uint64_t rounds = options.complete ? 5'000 : 300;
    for (std::uint64_t round = 0; round < rounds; ++round) {
        Random random(options.seed << 40 | round);
        const Golden &golden = files[random.below(files.size())];
        const std::size_t how = round % kChanges.size(), what = round / kChanges.size() % kWorks.size();
        std::ofstream(path, std::ios::binary)
            .write(reinterpret_cast<const char *>(golden.bytes.data()),
                   static_cast<std::streamsize>(golden.bytes.size()));
        std::array<int, 2> pipe{};
        if (::pipe(pipe.data()) != 0)
            return;
        const pid_t child = ::fork();
        if (child == 0)
            run_case(path, static_cast<Change>(how), static_cast<Work>(what), random, pipe[1]);
        ::close(pipe[1]);
        const std::string said = text_of(pipe[0]);
        ::close(pipe[0]);
        int state = 0;
        while (::waitpid(child, &state, 0) < 0 && errno == EINTR) {
        }
        judge(static_cast<Change>(how), state, said,
              golden.name + ", " + kChanges[how] + ", " + kWorks[what] + ", round " + std::to_string(round), tally);
        std::filesystem::remove(path);
    }
}

} // namespace pbm::faults
