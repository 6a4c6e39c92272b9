// A record of sources and options in the metadata of an output: a later run compares it to detect an unchanged result.
#pragma once

#include "pbm_format/container/content_id.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/model/model.h"
#include "sources/source_files.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// Each XXH3-128 as 32 hexadecimal digits, as `xxh128sum` prints it.
struct SourceRecord {
    std::string source_hash;  // of the one file's bytes; of several files: of what each is to the scan, and its hash
    std::string request_hash; // of all options that affect the result
    std::uint64_t files = 1;  // that decide the model, there or not
    bool operator==(const SourceRecord &) const = default;
};

// Hashes all files: each name by which a scan looks for a file, with the content of the file or that there is none, in
// the order of reading. With `in_order` another order of inputs gives another record.
//
// errors  io  the system's own text; the message names the file
Result<SourceRecord> make_record(const SourceFiles &sources, const std::string &request, bool in_order);

// Metadata with the record as "source_hash", "request_hash" and, if there are several, the number "source_files".
//
// errors  usage  longer than 4 KB
Result<std::string> with_record(const std::string &metadata, const SourceRecord &record);

// What a report says of a model that was not built now.
struct ModelFigures {
    std::uint64_t file_bytes = 0, points = 0;
    int depth = 0;
    double voxel_size = 0;
};

// The output of an earlier run.
struct EarlierOutput {
    SourceRecord record;
    std::string metadata; // without the record
    ContentId content_id{};
    std::optional<Hash128> fields_id{}; // of a model with fields
    ModelFigures figures;
};

// Nothing if the file is absent, damaged, without a record, or written by another version of this program.
std::optional<EarlierOutput> find_earlier_output(const std::string &path);

// The key of a build in a cache (system/files/cache_folder.h, --action-key): hexadecimal digits, a hash of everything
// that decides the bytes of the output: the record, and the versions of this program, of the format and of zstd.
// `in_file`: whether the output holds the record.
std::string cache_key(const SourceRecord &record, bool in_file);

// Copies the model `file` of a cache to `output`. Nothing if it is absent or damaged.
//
// errors  io  `output` cannot be written
Result<std::optional<ModelFigures>> copy_cached(const std::string &file, const std::string &output);

// Whether `model`, whose metadata has a record, differs from the earlier output in its record at most.
bool is_same(const EarlierOutput &earlier, const Model &model);

} // namespace pbm::build
