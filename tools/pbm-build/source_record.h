// What an output was built from, kept in its metadata, so that a later run can tell whether it would build the same.
#pragma once

#include "pbm_format/container/content_id.h"
#include "pbm_format/model/model.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// Each XXH3-128 as 32 hexadecimal digits, as `xxh128sum` prints it.
struct SourceRecord {
    std::string source_hash;  // of the one file's bytes; of several files: of their sorted hashes
    std::string request_hash; // of everything on the command line that can change the result
    bool operator==(const SourceRecord &) const = default;
};

// `given`, and the further files that reading them opens; each once.
std::vector<std::string> files_read(std::span<const std::string> given);

// Reads all of `files`, builds nothing.
//
// errors  io  the system's own text; the message names the file
Result<SourceRecord> make_record(std::span<const std::string> files, const std::string &request);

// Metadata with the record as "source_hash" and "request_hash".
//
// errors  usage  longer than 4 KB
Result<std::string> with_record(const std::string &metadata, const SourceRecord &record);

// An output of an earlier run.
struct EarlierOutput {
    SourceRecord record;
    std::string metadata; // without the record
    ContentId content_id{};
    std::uint64_t file_bytes = 0, points = 0;
    int depth = 0;
    double voxel_size = 0;
};

// Nothing if the file is not there, has one changed byte, has no record, or comes from another version of this program.
std::optional<EarlierOutput> find_earlier_output(const std::string &path);

// Whether writing `model`, whose metadata has a record, would change nothing but the record.
bool is_same(const EarlierOutput &earlier, const Model &model);

} // namespace pbm::build
