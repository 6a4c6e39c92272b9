// The JSON of --json: a program's own document, or the document of its failure. One per process.
//
// failure.schema.json describes the latter. Every program with --json writes one of the two; a run that ends by a
// signal, or because a mapped file became shorter, writes neither.
#pragma once

#include "system/error.h"

#include <string>
#include <string_view>

namespace pbm::command_line {

// Where --json puts its document: a file, "-" for standard output, "" for nowhere. Called by parse().
void set_json_path(std::string path);
// The path has turned out to be an input or another output: writes nothing there.
void forget_json();
// The path is no input and no other output. Until then an existing file is replaced only if it holds JSON.
void json_may_be_written();

// Writes the program's own document. Prints an error if that fails. Returns the exit code.
int write_json(std::string_view program, const std::string &path, std::string_view document);

// Remembers the first error of a run. `message` is what standard error says of it.
void note_failure(std::string_view file, const Error &error, const std::string &message);
// Writes the document of a run that ends with `code`, if --json was given and write_json was not called.
void write_failure(std::string_view program, int code);

} // namespace pbm::command_line
