#include "pbm_format/writing/writer.h"
#include "system/files/file_watch.h"
#include "system/files/mapped_file.h"
#include "system/processes/child_program.h"
#include "system/processes/this_process.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"
#include "viewer/opening/explanation.h"
#include "viewer/opening/file_dialog.h"
#include "viewer/opening/file_list.h"
#include "viewer/opening/model_cache.h"
#include "viewer/opening/prepared_model.h"
#include "viewer/opening/recent_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <stop_token>
#include <thread>

#include <fcntl.h>
#include <sys/stat.h>

namespace pbm {
namespace {

namespace fs = std::filesystem;

// Works in a folder of its own.
class Opening : public ::testing::Test {
  public:
    Opening() { fs::create_directories(folder_); }
    ~Opening() override { fs::remove_all(folder_); }
    Opening(const Opening &) = delete;
    Opening &operator=(const Opening &) = delete;

  protected:
    std::string file(const std::string &name) const { return (folder_ / name).string(); }
    std::string write(const std::string &name, const std::string &text = "x") const {
        fs::create_directories((folder_ / name).parent_path());
        std::ofstream(folder_ / name) << text;
        return file(name);
    }
    std::string write_model(const std::string &name, const std::string &metadata = "{}") const {
        Model sphere = test::sphere_model(5, {});
        sphere.metadata = metadata;
        const Bytes model = value_of(encode_model(sphere, {.chunk_points = 512, .threads = 1}));
        return write(name, std::string(model.begin(), model.end()));
    }
    std::string program(const std::string &name, const std::string &script) const {
        std::string path = write(name, "#!/bin/sh\n" + script);
        fs::permissions(path, fs::perms::owner_all);
        return path;
    }
    std::vector<std::string> names(const std::vector<std::string> &files) const {
        std::vector<std::string> result;
        result.reserve(files.size());
        for (const std::string &each : files)
            result.push_back(fs::path(each).lexically_relative(folder_).string());
        return result;
    }

  private:
    const fs::path folder_ =
        fs::temp_directory_path() /
        ("pbm_opening_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
};

using Names = std::vector<std::string>;

TEST_F(Opening, ACacheNamesAFileForEachStateOfAScanAndOfTheProgram) {
    const std::string scan = write("a.ply", "first"), builder = write("pbm-build");
    const auto cache = ModelCache::open(file("new/cache"));
    ASSERT_TRUE(cache);
    const auto now = std::chrono::system_clock::now();
    const auto names_for = [&](const std::string &path, const std::string &program) {
        return cache->names_for(std::array{path, program}, "", now);
    };
    const auto file_for = [&](const std::string &path, const std::string &program) {
        return names_for(path, program)->settled;
    };
    const std::string first = file_for(scan, builder);
    EXPECT_EQ(file_for(scan, builder), first);
    EXPECT_EQ(fs::path(first).parent_path(), file("new/cache"));
    EXPECT_NE(file_for(write("b.ply"), builder), first);
    fs::last_write_time(scan, fs::last_write_time(scan) + std::chrono::seconds(1));
    const std::string later = file_for(scan, builder);
    EXPECT_NE(later, first);
    write("a.ply", "longer");
    EXPECT_NE(file_for(scan, builder), later);
    const std::string other_program = file_for(scan, write("other/pbm-build"));
    EXPECT_NE(other_program, file_for(scan, builder));
    fs::create_symlink(scan, file("link.ply"));
    EXPECT_EQ(file_for(file("link.ply"), builder), file_for(scan, builder));
    const auto none = names_for(file("none.ply"), builder);
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::io);
    EXPECT_FALSE(ModelCache::open(scan + "/cache"));
}

// As `tar`, `rsync -t`, `cp -p` and SOURCE_DATE_EPOCH leave them.
TEST_F(Opening, ACacheTellsFilesOfTheSameSizeAndTimeApart) {
    const std::string builder = write("pbm-build", "1"), scan = write("a.ply", "first");
    const auto cache = ModelCache::open(file("cache"));
    const auto time = fs::last_write_time(scan);
    const auto file_for = [&] {
        return cache->names_for(std::array{scan, builder}, "", std::chrono::system_clock::now())->settled;
    };
    const std::string first = file_for();
    const std::string other = write("other", "other");
    fs::last_write_time(other, time);
    fs::rename(other, scan);
    const std::string second = file_for();
    EXPECT_NE(second, first) << "another file of the name";
    std::this_thread::sleep_for(std::chrono::milliseconds(20)); // longer than a step of the clock
    write("a.ply", "third");
    fs::last_write_time(scan, time);
    const std::string third = file_for();
    EXPECT_NE(third, second) << "another content of the file";
    const auto program_time = fs::last_write_time(builder);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    write("pbm-build", "2");
    fs::last_write_time(builder, program_time);
    EXPECT_NE(file_for(), third) << "another version of the program";
}

TEST_F(Opening, AScanThatHasJustChangedIsNotSettled) {
    const std::string scan = write("a.ply");
    const auto cache = ModelCache::open(file("cache"));
    const auto names_at = [&](std::chrono::seconds later) {
        return *cache->names_for(std::array{scan}, "", std::chrono::system_clock::now() + later);
    };
    const auto at_once = names_at(std::chrono::seconds(0)), later = names_at(std::chrono::minutes(2));
    EXPECT_FALSE(at_once.is_settled);
    EXPECT_FALSE(names_at(-std::chrono::hours(48)).is_settled) << "a clock that went back";
    EXPECT_TRUE(later.is_settled);
    EXPECT_EQ(later.settled, at_once.settled);
    EXPECT_EQ(later.young, at_once.young);
    EXPECT_NE(later.young, later.settled);
}

TEST_F(Opening, ACacheEvictsTheLeastRecentlyUsedAndNothingElse) {
    const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
    const auto write_used = [&](const std::string &name, int hours_ago) {
        std::string path = write("cache/" + name, std::string(1000, 'x'));
        const timespec then{.tv_sec = now - std::time_t{3600} * hours_ago, .tv_nsec = 0};
        const std::array<timespec, 2> times{then, then}; // of access, of modification
        EXPECT_EQ(::utimensat(AT_FDCWD, path.c_str(), times.data(), 0), 0);
        return path;
    };
    const std::string oldest = write_used("scan-0000000000000001.pbvg", 9);
    const std::string used_again = file("cache/scan-0000000000000002.pbvg");
    write_model("cache/scan-0000000000000002.pbvg");
    const std::string newest = write_used("scan-0000000000000003.pbvg", 7);
    const std::string part = write_used("scan-0000000000000004.pbvg.pbm-1", 0);
    const std::string old_part = write_used("scan-0000000000000005.pbvg.pbm-1", 2);
    const std::string others[] = {write_used("scan.pbvg", 99), write_used("scan-000000000000000g.pbvg", 99),
                                  write_used("notes.txt", 99)};
    const auto written = fs::last_write_time(used_again);
    EXPECT_TRUE(ModelCache::use(used_again));
    EXPECT_EQ(fs::last_write_time(used_again), written); // a window that shows it would take it for overwritten
    EXPECT_FALSE(ModelCache::use(file("cache/none.pbvg")));
    EXPECT_FALSE(ModelCache::use(newest)); // no model
    const auto cache = ModelCache::open(file("cache"), fs::file_size(used_again) + 2500);
    cache->evict_others(newest);
    EXPECT_FALSE(fs::exists(oldest));
    EXPECT_TRUE(fs::exists(used_again));
    EXPECT_TRUE(fs::exists(part));
    EXPECT_FALSE(fs::exists(old_part));
    ModelCache::open(file("cache"), 1)->evict_others(newest);
    EXPECT_FALSE(fs::exists(used_again));
    EXPECT_TRUE(fs::exists(newest)); // whatever its size
    for (const std::string &other : others)
        EXPECT_TRUE(fs::exists(other)) << other;
}

TEST_F(Opening, AScanIsWhatIsNeitherAModelNorNamedLikeOne) {
    EXPECT_TRUE(is_scan(write("a.ply")));
    EXPECT_TRUE(is_scan(write("notes.txt")));
    EXPECT_TRUE(is_scan(write("empty", "")));
    EXPECT_FALSE(is_scan(write("damaged.PBVG")));
    EXPECT_FALSE(is_scan(write("old.bvg")));
    EXPECT_FALSE(is_scan(write("model", "\x89"
                                        "BVG\r\n\x1a\n and more")));
    EXPECT_FALSE(is_scan(file("none.ply")));
    EXPECT_FALSE(is_scan(file("")));
}

TEST_F(Opening, AFolderIsListedAsPeopleSortIt) {
    for (const char *const name : {"scan-10.ply", "scan-2.PLY", "Scan-1.obj", "b.pbvg", "b.ply", "notes.txt", "c.stl",
                                   "sub/d.pbvg", "scan-02.off"})
        write(name);
    EXPECT_EQ(names(models_of_folder(file(""))),
              (Names{"b.pbvg", "c.stl", "Scan-1.obj", "scan-02.off", "scan-2.PLY", "scan-10.ply"}));
    EXPECT_TRUE(models_of_folder(file("none")).empty());
}

TEST_F(Opening, AListGoesRound) {
    for (const char *const name : {"a.pbvg", "b.pbvg", "c.pbvg", "c.ply", "empty/x.txt"})
        write(name);
    auto named = FileList::of({file("c.pbvg"), file("a.pbvg")});
    ASSERT_TRUE(named);
    EXPECT_EQ(named->position(), " (1 of 2)");
    EXPECT_TRUE(named->step(1));
    EXPECT_EQ(named->current(), file("a.pbvg"));
    EXPECT_TRUE(named->step(1));
    EXPECT_EQ(named->current(), file("c.pbvg"));
    // One file starts among its neighbours, which are looked for at the first step.
    auto single = FileList::of({file("a.pbvg")});
    EXPECT_EQ(single->position(), "");
    write("aa.pbvg");
    EXPECT_TRUE(single->step(-1));
    EXPECT_EQ(single->current(), file("c.pbvg"));
    EXPECT_EQ(single->position(), " (4 of 4)");
    auto beside = FileList::of({file("c.ply")});
    EXPECT_TRUE(beside->step(-1));
    EXPECT_EQ(beside->current(), file("c.pbvg"));
    auto folder = FileList::of({file("")});
    EXPECT_EQ(folder->position(), " (1 of 4)");
    auto alone = FileList::of({write("alone/a.pbvg")});
    EXPECT_FALSE(alone->step(1));
    EXPECT_EQ(alone->current(), file("alone/a.pbvg"));
    const auto empty = FileList::of({file("a.pbvg"), file("empty")});
    ASSERT_FALSE(empty);
    EXPECT_EQ(empty.error().code, ErrorCode::io);
    FileList nothing;
    EXPECT_FALSE(nothing.step(1));
}

TEST_F(Opening, RecentFilesAreKeptNewestFirst) {
    const RecentFiles recent(file("state/pbm/recent"));
    EXPECT_TRUE(recent.list().empty());
    std::vector<std::string> files;
    for (std::size_t i = 0; i < RecentFiles::kMax + 2; ++i)
        recent.add(files.emplace_back(write(std::to_string(i) + ".pbvg")));
    EXPECT_EQ(recent.list().size(), RecentFiles::kMax);
    EXPECT_EQ(recent.list().front(), files.back());
    recent.add(files[5]);
    EXPECT_EQ(recent.list().front(), files[5]);
    EXPECT_EQ(recent.list().size(), RecentFiles::kMax);
    fs::remove(files[5]);
    EXPECT_EQ(recent.list().size(), RecentFiles::kMax - 1);
    EXPECT_EQ(recent.list().front(), files.back());
    write("state/pbm/recent", "relative\n\n" + files[1]);
    EXPECT_EQ(recent.list(), Names{files[1]});
    RecentFiles("").add(files[1]); // without a home
    EXPECT_TRUE(RecentFiles("").list().empty());
}

TEST_F(Opening, AnExplanationKeepsRulesBehindTheDetails) {
    const Explanation cut = explain({.code = ErrorCode::truncated,
                                     .offset = 16,
                                     .message = "2.7 the header says 99 bytes, the file has 10",
                                     .name = "header.size",
                                     .rule = "2.7"});
    EXPECT_NE(cut.what.find("cut off"), std::string::npos);
    EXPECT_NE(cut.advice.find("pbm-build"), std::string::npos);
    EXPECT_EQ(cut.details, (Names{"2.7 the header says 99 bytes, the file has 10", "Byte 16 of the file",
                                  "Rule 2.7 of BVG.md, code header.size"}));
    for (int code = 0; code <= static_cast<int>(ErrorCode::unsupported_feature); ++code) {
        const Explanation any =
            explain({.code = static_cast<ErrorCode>(code), .message = "9.9 too bad", .rule = "9.9"});
        EXPECT_FALSE(any.what.empty()) << code;
        EXPECT_EQ(any.what.find("9.9"), std::string::npos) << code;
        EXPECT_EQ(any.details.back(), "Rule 9.9 of BVG.md") << code;
    }
    const Explanation missing = explain({.code = ErrorCode::io, .message = "cannot open: No such file or directory"});
    EXPECT_EQ(missing.what, "Cannot open: No such file or directory.");
    EXPECT_TRUE(missing.details.empty());
    const Explanation scan = explain({.code = ErrorCode::bad_input, .message = "line 4: too short; copy it again"});
    EXPECT_EQ(scan.what, "Line 4: too short.");
    EXPECT_EQ(scan.advice, "Copy it again.");
}

TEST_F(Opening, AProgramSpeaksLineByLine) {
    Names lines;
    const auto ended = run_program({"sh", "-c", "echo one; echo; printf two; echo no >&2; echo 'last one' >&2; exit 3"},
                                   [&](std::string_view line) { lines.emplace_back(line); });
    ASSERT_TRUE(ended);
    EXPECT_EQ(lines, (Names{"one", "", "two"}));
    EXPECT_EQ(ended->exit_code, 3);
    EXPECT_EQ(ended->message, "last one");
    const auto killed = run_program({"sh", "-c", "kill -9 $$"}, {});
    EXPECT_EQ(killed->exit_code, -1);
    EXPECT_EQ(run_program({"pbm-no-such-program"}, {}).error().message, "pbm-no-such-program is not installed");
    EXPECT_EQ(run_program({"cat"}, {})->exit_code, 0); // has no input
    const auto silent = run_program({"sh", "-c", "head -c 300000 /dev/zero | tr '\\0' x; echo; echo end"},
                                    [&](std::string_view line) { lines.emplace_back(line); });
    EXPECT_EQ(silent->exit_code, 0);
    EXPECT_EQ(lines[3].size(), 65536);
    EXPECT_EQ(lines.back(), "end");
}

TEST_F(Opening, AStopRequestKillsTheProgram) {
    std::stop_source stop;
    auto ended = std::async(std::launch::async, [&] {
        return run_program(
            {"sh", "-c", "echo ready; exec sleep 1000"}, [&](std::string_view) { stop.request_stop(); },
            stop.get_token());
    });
    EXPECT_EQ(ended.get()->exit_code, -1);
    EXPECT_EQ(run_program({"sleep", "1000"}, {}, stop.get_token())->exit_code, -1); // requested before the start
}

// Changes an environment variable for the time of a test.
class Environment {
  public:
    Environment(const char *name, const std::string &value) : name_(name) {
        const char *const old = std::getenv(name);
        old_ = old == nullptr ? "" : old;
        ::setenv(name, value.c_str(), 1);
    }
    Environment(const Environment &) = delete;
    Environment &operator=(const Environment &) = delete;
    ~Environment() { old_.empty() ? ::unsetenv(name_) : ::setenv(name_, old_.c_str(), 1); }

  private:
    const char *name_;
    std::string old_;
};

TEST_F(Opening, AScanIsBuiltOnceAndOnlyTheProgramsWordsAreAnError) {
    const std::string scan = write("a.ply", "ply");
    const std::string arguments =
        "for last; do :; done; for a; do case $a in --output=*) out=${a#--output=};; esac; done\n";
    const std::string builder =
        program("bin/pbm-build", arguments + "echo '7 sample points'; echo built >> '" + file("count") + "'; cp '" +
                                     write_model("model", R"({"source_hash":"0"})") + "' \"$out\"");
    const Environment cache("PBM_CACHE", file("cache"));
    std::string step;
    double done = 0;
    const Preparation young{.progress =
                                [&](std::string_view name, double share) {
                                    step = name;
                                    done = share;
                                },
                            .builder = builder};
    Preparation preparation = young;
    preparation.now += std::chrono::minutes(2);
    const auto first = prepare_model(scan, preparation), second = prepare_model(scan, preparation);
    ASSERT_TRUE(first && second);
    EXPECT_EQ(step, "sample points");
    EXPECT_EQ(done, 0.07);
    EXPECT_EQ(first->file, second->file);
    EXPECT_EQ(fs::file_size(file("count")), 6);
    // A scan that has just changed may do so again without a trace: the program looks. Its model is not built again.
    const std::string new_scan = write("new.ply", "ply");
    const auto at_once = prepare_model(new_scan, young), again = prepare_model(new_scan, young);
    ASSERT_TRUE(at_once && again);
    EXPECT_EQ(at_once->file, again->file);
    EXPECT_EQ(fs::file_size(file("count")), 18);
    EXPECT_EQ(prepare_model(new_scan, preparation)->file, at_once->file); // looks for the last time
    const auto settled = prepare_model(new_scan, preparation);
    EXPECT_TRUE(fs::equivalent(settled->file, at_once->file));
    EXPECT_EQ(fs::file_size(file("count")), 24);
    // Files that the scan names may have changed alone: the program looks.
    write_model("model", R"({"source_hash":"0","source_files":2})");
    const std::string naming = write("b.ply", "ply");
    ASSERT_TRUE(prepare_model(naming, preparation) && prepare_model(naming, preparation));
    EXPECT_EQ(fs::file_size(file("count")), 36);
    EXPECT_EQ(prepare_model(file("model.pbvg"), preparation)->file, file("model.pbvg"));
    Preparation by_recipe = preparation;
    by_recipe.scans.recipe = write("recipe.toml");
    EXPECT_NE(prepare_model(scan, by_recipe)->file, first->file);
    by_recipe.scans.recipe = file("none.toml");
    EXPECT_EQ(prepare_model(scan, by_recipe).error().code, ErrorCode::io);
    std::string temporary;
    {
        const auto alone = prepare_model(scan, {.scans = {.cache = "none"}, .builder = builder});
        ASSERT_TRUE(alone);
        temporary = alone->file;
        EXPECT_TRUE(fs::exists(temporary));
    }
    EXPECT_FALSE(fs::exists(temporary));
    EXPECT_FALSE(fs::exists(fs::path(temporary).parent_path()));

    program("bin/pbm-build", arguments + "echo \"pbm-build: $last: line 3 is bad\" >&2; exit 3");
    const auto bad = prepare_model(scan, preparation);
    ASSERT_FALSE(bad);
    EXPECT_EQ(bad.error().code, ErrorCode::bad_input);
    EXPECT_EQ(bad.error().message, "line 3 is bad");
    for (const int code : {1, 2, 3, 4, 5}) {
        program("bin/pbm-build", std::string(static_cast<std::size_t>(code), '\n') + "exit " + std::to_string(code));
        const auto failed = prepare_model(scan, preparation);
        ASSERT_FALSE(failed);
        EXPECT_EQ(exit_code(failed.error().code), code);
        EXPECT_EQ(failed.error().message, "pbm-build ended with exit code " + std::to_string(code));
    }
    program("bin/pbm-build", "kill -9 $$");
    EXPECT_EQ(exit_code(prepare_model(scan, preparation).error().code), 4);
}

TEST_F(Opening, ACacheThatFailsCostsNoPicture) {
    const std::string scan = write("a.ply", "ply");
    const std::string arguments = "for a; do case $a in --output=*) out=${a#--output=};; esac; done\n";
    const std::string copies = "cp '" + write_model("model", R"({"source_hash":"0"})") + "' \"$out\"";
    const std::string fails =
        "case $out in */cache/*) echo \"pbm-build: $out: cannot write: it is full\" >&2; exit 2;; esac\n";
    const std::string builder = program("bin/pbm-build", arguments + fails + copies);
    const auto prepared_in = [&](const std::string &cache) {
        return prepare_model(scan, {.scans = {.cache = cache}, .builder = builder});
    };
    const auto nowhere = prepared_in(scan + "/cache");
    ASSERT_TRUE(nowhere);
    EXPECT_TRUE(fs::exists(nowhere->file));
    EXPECT_EQ(nowhere->warning,
              "the cache is not used: " + scan +
                  "/cache: cannot create the folder: Not a directory; name another folder with --cache");
    const auto full = prepared_in(file("cache"));
    ASSERT_TRUE(full);
    EXPECT_TRUE(fs::exists(full->file));
    EXPECT_TRUE(full->warning.starts_with("the cache is not used: " + file("cache/scan-"))) << full->warning;
    EXPECT_EQ(prepared_in("none")->warning, "");
    EXPECT_EQ(prepared_in(file("other"))->warning, "");
    // What is wrong with the scan is no fault of the cache.
    program("bin/pbm-build", "echo 'pbm-build: a.ply: cannot read' >&2; exit 2");
    EXPECT_EQ(prepared_in(file("cache")).error().message, "a.ply: cannot read");
}

TEST_F(Opening, AWatchSeesAFileReplacedOrRewritten) {
    const std::string watched = write("a.pbvg");
    fs::create_directories(file("links"));
    fs::create_symlink(watched, file("links/a.pbvg"));
    using enum FileChange;
    FileWatch watch(watched), link(file("links/a.pbvg")), other(file("b.pbvg")), nowhere(file("none/a.pbvg"));
    write("new");
    fs::rename(file("new"), watched);
    EXPECT_EQ(watch.wait(), whole);
    EXPECT_EQ(link.wait(), whole);
    write("a.pbvg", "rewritten");
    EXPECT_EQ(watch.wait(), whole);
    {
        std::ofstream slow(watched, std::ios::binary);
        EXPECT_EQ(watch.wait(), writing); // it was cut short
        slow << "a" << std::flush;
        EXPECT_EQ(watch.wait(), writing);
    }
    EXPECT_EQ(watch.wait(), whole);
    auto waiting = std::async(std::launch::async, [&] { return other.wait() != none || nowhere.wait() != none; });
    EXPECT_NE(waiting.wait_for(std::chrono::milliseconds(50)), std::future_status::ready);
    other.stop();
    nowhere.stop();
    EXPECT_FALSE(waiting.get());
    EXPECT_EQ(other.wait(), none); // later too
}

TEST_F(Opening, AStampTellsAFileWrittenInPlaceFromOneThatWasReplaced) {
    const std::string watched = write("a.pbvg");
    const Descriptor opened = open_to_read(watched);
    const FileStamp first = stamp_of(opened);
    write("new", "another text");
    fs::rename(file("new"), watched);
    EXPECT_EQ(stamp_of(opened), first);
    fs::remove(watched);
    EXPECT_EQ(stamp_of(opened), first);
    write("b.pbvg");
    const Descriptor other = open_to_read(file("b.pbvg"));
    const FileStamp second = stamp_of(other);
    fs::resize_file(file("b.pbvg"), 0);
    EXPECT_NE(stamp_of(other), second);
    EXPECT_EQ(stamp_of(Descriptor()), FileStamp());
}

TEST_F(Opening, AMappedFileThatShrinksIsReadAsZerosOnRequest) {
    write("a.pbvg", std::string(20000, 'x'));
    const auto mapped = MappedFile::open(file("a.pbvg"));
    ASSERT_TRUE(mapped);
    end_when_mapped_file_shrinks("test");
    read_zeros_when_mapped_file_shrinks();
    fs::resize_file(file("a.pbvg"), 1);
    const ByteView bytes = mapped->bytes();
    EXPECT_EQ(bytes[0], 'x');
    EXPECT_TRUE(std::all_of(bytes.begin() + 1, bytes.end(), [](std::uint8_t byte) { return byte == 0; }));
    std::signal(SIGBUS, SIG_DFL);
}

TEST_F(Opening, TheDialogIsTheDesktops) {
    const Environment desktop("XDG_CURRENT_DESKTOP", "GNOME");
    const Environment path("PATH", file("bin"));
    const auto none = ask_for_files("/", {});
    ASSERT_FALSE(none);
    EXPECT_EQ(exit_code(none.error().code), 4);
    program("bin/zenity", "echo /a.ply; echo '/b c.pbvg'");
    program("bin/kdialog", "echo /kde.ply");
    EXPECT_EQ(*ask_for_files("/", {}), (Names{"/a.ply", "/b c.pbvg"}));
    {
        const Environment kde("XDG_CURRENT_DESKTOP", "KDE");
        EXPECT_EQ(*ask_for_files("/", {}), Names{"/kde.ply"});
    }
    program("bin/zenity", "exit 1");
    EXPECT_TRUE(ask_for_files("/", {})->empty());
    program("bin/zenity", "echo 'no display' >&2; exit 255");
    EXPECT_EQ(ask_for_files("/", {}).error().message, "zenity failed: no display");
}

} // namespace
} // namespace pbm
