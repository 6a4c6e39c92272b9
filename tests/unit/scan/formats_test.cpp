// The table of formats.
#include "pbm_scan/formats.h"

#include "command_line/scan_extensions.h"
#include "pbm_scan/surface_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

namespace {

TEST(ScanFormats, AreFoundByName) {
    for (const pbm::build::ScanFormat &format : pbm::build::scan_formats())
        EXPECT_EQ(pbm::build::find_format(format.name), &format);
    EXPECT_EQ(pbm::build::find_format("bvg"), nullptr);
}

TEST(ScanFormats, FileDialogsAndFoldersShowWhatCanBeRead) {
    std::vector<std::string> read;
    for (const pbm::build::ScanFormat &format : pbm::build::scan_formats()) {
        std::istringstream words{std::string(format.extensions)};
        for (std::string extension; words >> extension;)
            read.push_back(extension);
    }
    std::vector<std::string> shown(pbm::command_line::kScanExtensions.begin(),
                                   pbm::command_line::kScanExtensions.end());
    std::sort(read.begin(), read.end());
    std::sort(shown.begin(), shown.end());
    for (const char *unlisted : {".csv", ".txt"})
        std::erase(read, unlisted);
    EXPECT_EQ(read, shown);
}

} // namespace
