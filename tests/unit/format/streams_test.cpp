// Streams are read to their end; files are replaced atomically.
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"
#include "system/processes/this_process.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace {

using namespace pbm;
namespace fs = std::filesystem;

class Streams : public testing::Test {
  protected:
    Streams() { fs::create_directory(folder_); }
    ~Streams() override { fs::remove_all(folder_); }

    std::string path(const std::string &name) const { return (folder_ / name).string(); }
    std::string text_of(const std::string &name) const {
        std::ifstream file(folder_ / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    std::size_t files() const { return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), {})); }

  private:
    fs::path folder_ = fs::temp_directory_path() / ("pbm_streams_test_" + std::to_string(::getpid()));
};

ByteView view_of(const std::string &text) { return {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()}; }

// Writes `text` into a pipe and returns what read_stream reads.
Result<std::string> through_a_pipe(const std::string &pipe, const std::string &text, std::uint64_t max_bytes) {
    EXPECT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    std::jthread writer([&] {
        std::ofstream out(pipe, std::ios::binary);
        out << text;
    });
    const Result<MappedFile> file = MappedFile::read_stream(pipe, max_bytes);
    if (!file)
        return file.error();
    return std::string(file->bytes().begin(), file->bytes().end());
}

TEST_F(Streams, APipeIsReadToItsEnd) {
    make_write_errors_returns();
    std::string text;
    for (std::size_t i = 0; i < 3'333'333; ++i)
        text += static_cast<char>(i * i >> 3);
    int pipes = 0;
    for (const std::size_t length : {std::size_t{0}, std::size_t{1}, std::size_t{1} << 20, text.size()}) {
        const auto got = through_a_pipe(path("pipe" + std::to_string(pipes++)), text.substr(0, length), 4'000'000);
        ASSERT_TRUE(got.ok()) << got.error().message;
        EXPECT_TRUE(*got == text.substr(0, length)) << length;
    }
}

TEST_F(Streams, AStreamOverTheLimitIsRefused) {
    make_write_errors_returns();
    const auto got = through_a_pipe(path("pipe"), std::string((std::size_t{3} << 20) + 1, 'x'), std::uint64_t{3} << 20);
    ASSERT_FALSE(got.ok());
    EXPECT_EQ(got.error().code, ErrorCode::memory);
    EXPECT_EQ(got.error().message, "more than 3 MiB from a stream; write it to a file first");
    const Result<MappedFile> endless = MappedFile::read_stream("/dev/urandom", std::uint64_t{5} << 20);
    ASSERT_FALSE(endless.ok());
    EXPECT_EQ(endless.error().code, ErrorCode::memory);
}

TEST_F(Streams, PipesAndDevicesAreStreamsFilesAreNot) {
    EXPECT_TRUE(is_stream("-"));
    EXPECT_TRUE(is_stream("/dev/null"));
    EXPECT_FALSE(is_stream(path("none")));
    EXPECT_FALSE(is_stream(path(".")));
    std::ofstream(path("file")) << "text";
    EXPECT_FALSE(is_stream(path("file")));
    ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
    EXPECT_TRUE(is_stream(path("pipe")));
    EXPECT_EQ(MappedFile::read_stream(path("none"), 1).error().code, ErrorCode::io);
}

TEST_F(Streams, ADeviceThatSendsZerosForEverIsRefusedAtOnce) {
    EXPECT_EQ(MappedFile::read_stream("/dev/zero", std::uint64_t{1} << 40).error().code, ErrorCode::bad_input);
}

TEST_F(Streams, AFileInPiecesAppearsAtItsEnd) {
    std::ofstream(path("file")) << "old";
    {
        Result<FileReplacement> file = FileReplacement::begin(path("file"));
        ASSERT_TRUE(file.ok());
        ASSERT_TRUE(file->write(view_of("new ")).ok());
        ASSERT_TRUE(file->write(view_of("text")).ok());
        EXPECT_EQ(text_of("file"), "old");
        ASSERT_TRUE(file->finish().ok());
    }
    EXPECT_EQ(text_of("file"), "new text");
    EXPECT_EQ(files(), 1U) << "no temporary file is left";
}

TEST_F(Streams, AFileThatIsNotFinishedLeavesEverythingAsItWas) {
    std::ofstream(path("file")) << "old";
    {
        Result<FileReplacement> file = FileReplacement::begin(path("file"));
        ASSERT_TRUE(file.ok());
        ASSERT_TRUE(file->write(view_of("new")).ok());
        EXPECT_EQ(files(), 2U);
        const FileReplacement moved = std::move(*file); // the moved-from object owns no file
    }
    EXPECT_EQ(text_of("file"), "old");
    EXPECT_EQ(files(), 1U);
    EXPECT_EQ(FileReplacement::begin(path("none/file")).error().code, ErrorCode::io);
    ASSERT_TRUE(FileReplacement::begin("/dev/full").ok());
    EXPECT_EQ(FileReplacement::begin("/dev/full")->write(view_of("x")).error().code, ErrorCode::io);
}

TEST_F(Streams, WhatAKilledWriterLeftIsTakenByTheNext) {
    std::ofstream(path("file.pbm-1")) << "the half of a larger file";
    std::ofstream(path("file.pbm-2")) << "and of another";
    std::ofstream(path("file.pbm-none")) << "somebody's";
    ASSERT_TRUE(replace_file(path("file"), view_of("new")).ok());
    EXPECT_EQ(text_of("file"), "new");
    EXPECT_EQ(text_of("file.pbm-none"), "somebody's");
    EXPECT_EQ(files(), 2U);

    // Only regular files are removed. A symbolic link, a folder and a hard link of the same names stay.
    std::ofstream(path("kept")) << "kept";
    fs::create_symlink("kept", path("file.pbm-1"));
    fs::create_directory(path("file.pbm-2"));
    fs::create_hard_link(path("kept"), path("file.pbm-3"));
    ASSERT_TRUE(replace_file(path("file"), view_of("newer")).ok());
    EXPECT_EQ(text_of("file"), "newer");
    EXPECT_EQ(text_of("kept"), "kept");
    EXPECT_EQ(files(), 6U);
}

TEST_F(Streams, WritersOfOneFileDoNotDisturbEachOther) {
    Result<FileReplacement> first = FileReplacement::begin(path("file")), second = FileReplacement::begin(path("file"));
    ASSERT_TRUE(first.ok() && second.ok());
    ASSERT_NE(first->name_until_finished(), second->name_until_finished());
    ASSERT_TRUE(first->write(view_of("first")).ok());
    ASSERT_TRUE(second->write(view_of("second")).ok());
    ASSERT_TRUE(first->finish().ok());
    EXPECT_EQ(text_of("file"), "first");
    ASSERT_TRUE(second->finish().ok());
    EXPECT_EQ(text_of("file"), "second");
    EXPECT_EQ(files(), 1U);
}

TEST_F(Streams, AFolderThatGoesAwayIsAnErrorAndLeavesNothing) {
    fs::create_directory(path("folder"));
    {
        Result<FileReplacement> file = FileReplacement::begin(path("folder/file"));
        ASSERT_TRUE(file.ok());
        fs::rename(path("folder"), path("moved"));
        ASSERT_TRUE(file->write(view_of("new")).ok());
        EXPECT_EQ(file->finish().error().code, ErrorCode::io);
    }
    EXPECT_TRUE(fs::is_empty(path("moved")));
    EXPECT_FALSE(fs::exists(path("folder")));
}

TEST_F(Streams, PermissionsAndLinksStay) {
    std::ofstream(path("file")) << "old";
    fs::permissions(path("file"), fs::perms(0640));
    fs::create_symlink("file", path("link"));
    ASSERT_TRUE(replace_file(path("link"), view_of("new")).ok());
    EXPECT_TRUE(fs::is_symlink(path("link")));
    EXPECT_EQ(text_of("file"), "new");
    EXPECT_EQ(fs::status(path("file")).permissions(), fs::perms(0640));
}

TEST_F(Streams, AFileIsMadeWhereALinkLeads) {
    fs::create_symlink("middle", path("link"));
    fs::create_symlink(path("end"), path("middle"));
    ASSERT_TRUE(replace_file(path("link"), view_of("new")).ok());
    EXPECT_TRUE(fs::is_symlink(path("link")) && fs::is_symlink(path("middle")));
    EXPECT_EQ(text_of("end"), "new");

    fs::create_symlink("loop", path("loop"));
    EXPECT_EQ(replace_file(path("loop"), view_of("new")).error().code, ErrorCode::io);
    fs::create_symlink("none/file", path("nowhere"));
    EXPECT_EQ(check_replaceable(path("nowhere")).error().code, ErrorCode::io);
    EXPECT_TRUE(fs::is_symlink(path("loop")) && fs::is_symlink(path("nowhere")));
}

TEST_F(Streams, OpenFilesOfThisProcessAreContinued) {
    const int file = ::open(path("file").c_str(), O_WRONLY | O_CREAT, 0600);
    ASSERT_GE(file, 0);
    ASSERT_EQ(::write(file, "head ", 5), 5);
    for (const std::string folder : {"/dev/fd/", "/proc/self/fd/"})
        ASSERT_TRUE(replace_file(folder + std::to_string(file), view_of("body ")).ok());
    ASSERT_EQ(::write(file, "tail", 4), 4);
    ::close(file);
    EXPECT_EQ(text_of("file"), "head body body tail");
    EXPECT_EQ(replace_file("/dev/fd/" + std::to_string(file), view_of("x")).error().code, ErrorCode::io);
}

} // namespace
