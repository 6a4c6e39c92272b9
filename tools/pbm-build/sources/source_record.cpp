#include "sources/source_record.h"

#include "pbm_format/checking/validate.h"
#include "pbm_format/container/layout.h"
#include "pbm_format/levels/chunk_split.h"
#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/frame_encoder.h"
#include "pbm_scan/surface/refusal.h"
#include "system/files/cache_folder.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <system_error>

namespace pbm::build {
namespace {

constexpr const char *kSourceHash = "source_hash", *kRequestHash = "request_hash", *kSourceFiles = "source_files";

using Digest = std::array<std::uint8_t, 16>;

// The most significant byte first.
Digest canonical(const Hash128 &hash) {
    Digest bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = static_cast<std::uint8_t>(hash[i < 8 ? 1 : 0] >> (56 - 8 * (i % 8)));
    return bytes;
}

std::string hex(const Digest &bytes) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : bytes)
        (text += kDigits[byte >> 4]) += kDigits[byte & 15];
    return text;
}

Digest hash_of(ByteView bytes) {
    StreamingHash hash;
    hash.add(bytes);
    return canonical(hash.finish());
}

Digest hash_of(std::span<const Digest> digests) {
    StreamingHash hash;
    for (const Digest &digest : digests)
        hash.add(digest);
    return canonical(hash.finish());
}

// Hashes of contents, each file read once.
class FileHashes {
  public:
    // Of a file and all that it names.
    Result<Digest> of(const GivenFile &given) {
        auto own = content_of(given.file);
        if (!own || given.named.empty())
            return own;
        std::vector<Digest> parts{*own};
        for (const NamedFile &named : given.named) {
            parts.push_back(hash_of(as_bytes(named.name)));
            if (named.file.empty()) { // no hash of a content is likely to be this
                parts.push_back({});
                continue;
            }
            const auto content = content_of(named.file);
            if (!content)
                return content.error();
            parts.push_back(*content);
        }
        return hash_of(parts);
    }

  private:
    Result<Digest> content_of(const std::string &path) {
        const auto found = known_.find(path);
        if (found != known_.end())
            return found->second;
        const Result<MappedFile> file = MappedFile::open(path);
        if (!file)
            return Error{file.error().code, 0, path + ": " + file.error().message};
        return known_[path] = hash_of(file->bytes());
    }

    std::map<std::string, Digest> known_;
};

std::string text_of(const nlohmann::ordered_json &metadata, const char *key) {
    const auto found = metadata.find(key);
    return found != metadata.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::string without_record(nlohmann::ordered_json metadata) {
    metadata.erase(kSourceHash);
    metadata.erase(kRequestHash);
    metadata.erase(kSourceFiles);
    return metadata.dump();
}

// Of a model with fields.
std::optional<Hash128> fields_id_of(const Model &model) {
    if (model.parameters.fields.empty())
        return std::nullopt;
    return field_table(model).id;
}

ModelFigures figures_of(const Reader &reader) {
    return {.file_bytes = reader.header().file_size,
            .points = reader.header().point_count,
            .depth = reader.depth(),
            .voxel_size = reader.parameters().grid.voxel_size};
}

} // namespace

Result<SourceRecord> make_record(const SourceFiles &sources, const std::string &request, bool in_order) {
    FileHashes hashes;
    std::vector<Digest> all, inputs; // those whose order is free
    std::uint64_t files = 0;
    for (const GivenFile &given : sources.given) {
        auto hash = hashes.of(given);
        if (!hash)
            return hash.error();
        (given.is_input && !in_order ? inputs : all).push_back(*hash);
        files += 1 + given.named.size();
    }
    std::sort(inputs.begin(), inputs.end());
    std::move(inputs.begin(), inputs.end(), std::back_inserter(all));
    return SourceRecord{.source_hash = hex(all.size() == 1 ? all.front() : hash_of(all)),
                        .request_hash = hex(hash_of(as_bytes(request))),
                        .files = files};
}

Result<std::string> with_record(const std::string &metadata, const SourceRecord &record) {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(metadata);
    json[kSourceHash] = record.source_hash;
    json[kRequestHash] = record.request_hash;
    if (record.files > 1)
        json[kSourceFiles] = record.files;
    std::string text = json.dump();
    if (text.size() > kMaxMetadataBytes)
        return usage_error("--name, --licence and --credit are too long: metadata is at most 4,096 bytes");
    return text;
}

std::optional<EarlierOutput> find_earlier_output(const std::string &path) {
    const Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        return std::nullopt;
    const Result<Reader> reader = Reader::open(file->bytes());
    if (!reader || !verify(file->bytes(), {.level = ValidationLevel::hashes}))
        return std::nullopt;
    auto metadata = nlohmann::ordered_json::parse(reader->metadata(), nullptr, false);
    if (!metadata.is_object() || text_of(metadata, "generator") != "pbm-build " PBM_VERSION)
        return std::nullopt;
    const auto files = metadata.find(kSourceFiles);
    EarlierOutput earlier{.record = {.source_hash = text_of(metadata, kSourceHash),
                                     .request_hash = text_of(metadata, kRequestHash),
                                     .files = files != metadata.end() && files->is_number_unsigned()
                                                  ? files->get<std::uint64_t>()
                                                  : std::uint64_t{1}},
                          .metadata = {},
                          .content_id = reader->header().content_id,
                          .fields_id = {},
                          .figures = figures_of(*reader)};
    if (earlier.record.source_hash.empty() || earlier.record.request_hash.empty())
        return std::nullopt;
    earlier.metadata = without_record(std::move(metadata));
    if (!reader->parameters().fields.empty()) {
        const Result<FieldReader> fields = FieldReader::open(*reader);
        if (!fields)
            return std::nullopt;
        earlier.fields_id = fields->id();
    }
    return earlier;
}

std::string cache_key(const SourceRecord &record, bool in_file) {
    const std::string versions = "pbm-build " PBM_VERSION ", format " + std::to_string(kMajorVersion) + "." +
                                 std::to_string(kMinorVersion) + ", zstd " + zstd_version() + "\n";
    return hex(hash_of(as_bytes(versions + record.source_hash + "\n" + record.request_hash + "\n" +
                                (in_file ? "with" : "without") + " record")));
}

Result<std::optional<ModelFigures>> copy_cached(const std::string &file, const std::string &output) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored))
        return std::optional<ModelFigures>();
    const Result<MappedFile> cached = MappedFile::open(file);
    if (!cached)
        return std::optional<ModelFigures>();
    const Result<Reader> reader = Reader::open(cached->bytes());
    if (!reader || !verify(cached->bytes(), {.level = ValidationLevel::hashes}))
        return std::optional<ModelFigures>();
    if (const Status written = replace_file(output, cached->bytes()); !written)
        return written.error();
    CacheFolder::mark_used(file);
    return std::optional(figures_of(*reader));
}

bool is_same(const EarlierOutput &earlier, const Model &model) {
    if (without_record(nlohmann::ordered_json::parse(model.metadata)) != earlier.metadata ||
        fields_id_of(model) != earlier.fields_id)
        return false;
    LevelMasks masks;
    for (const Level &level : model.levels)
        masks.push_back(level.masks);
    return content_id(model, split_into_chunks(masks, kDefaultChunkPoints), kDefaultChunkPoints) == earlier.content_id;
}

} // namespace pbm::build
