// The desktop's dialog for opening files, as a program of its own: zenity or kdialog.
#pragma once

#include "system/error.h"

#include <stop_token>
#include <string>
#include <vector>

namespace pbm {

// Asks the user for files, starting in `folder`, and waits for the answer; empty if the dialog was closed. A stop
// request closes the dialog. kdialog comes first on KDE.
//
// errors  memory (exit code 4)  none of these programs is installed, or it failed
Result<std::vector<std::string>> ask_for_files(const std::string &folder, const std::stop_token &stop);

} // namespace pbm
