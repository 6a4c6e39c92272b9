// Where the viewer for web pages lies, and whether a page may be written: what pbm-build and pbm-render ask before they
// start to work for --page.
#pragma once

#include "system/error.h"

#include <string>

namespace pbm::command_line {

inline constexpr const char *kPageForm = "page.html", *kPageFiles = "page_files.txt", *kPage = "index.html";

// Adds to a page the line by which is_edited_page() knows whether somebody has changed the page since.
std::string sealed_page(const std::string &page);

// Whether `folder` holds a page that these programs wrote and somebody has changed, or that an earlier version wrote.
bool is_edited_page(const std::string &folder);

// The folder of the viewer's files for a page in `folder`: $PBM_WEB, share/pbm/web of the installation, or that of the
// build tree.
//
// errors  io  the viewer is not installed, or `folder` holds a page that these programs did not write: the message
//             names the file and what to do
Result<std::string> find_web_viewer(const std::string &folder);

} // namespace pbm::command_line
