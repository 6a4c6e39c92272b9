#include "source_record.h"

#include "pbm_build/preparing/poses.h"
#include "pbm_format/checking/validate.h"
#include "pbm_format/container/layout.h"
#include "pbm_format/levels/chunk_split.h"
#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/frame_encoder.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/surface_reader.h"
#include "system/files/cache_folder.h"
#include "system/files/file_replacement.h"
#include "system/files/mapped_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace pbm::build {
namespace {

constexpr const char *kSourceHash = "source_hash", *kRequestHash = "request_hash";

// The most significant byte first.
std::array<std::uint8_t, 16> canonical(const Hash128 &hash) {
    std::array<std::uint8_t, 16> bytes{};
    for (std::size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = static_cast<std::uint8_t>(hash[i < 8 ? 1 : 0] >> (56 - 8 * (i % 8)));
    return bytes;
}

std::string hex(const std::array<std::uint8_t, 16> &bytes) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : bytes)
        (text += kDigits[byte >> 4]) += kDigits[byte & 15];
    return text;
}

std::array<std::uint8_t, 16> hash_of(ByteView bytes) {
    StreamingHash hash;
    hash.add(bytes);
    return canonical(hash.finish());
}

std::string text_of(const nlohmann::ordered_json &metadata, const char *key) {
    const auto found = metadata.find(key);
    return found != metadata.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::string without_record(nlohmann::ordered_json metadata) {
    metadata.erase(kSourceHash);
    metadata.erase(kRequestHash);
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

std::vector<std::string> files_read(std::span<const std::string> given) {
    std::vector<std::string> files;
    const auto add = [&](const std::string &file) {
        if (std::find(files.begin(), files.end(), file) == files.end())
            files.push_back(file);
    };
    for (const std::string &file : given) {
        add(file);
        std::vector<std::string> scans = scans_of_alignment(file);
        if (scans.empty())
            scans.push_back(file);
        for (const std::string &scan : scans) {
            add(scan);
            for (const std::string &further : further_files(scan))
                add(further);
        }
    }
    return files;
}

Result<SourceRecord> make_record(std::span<const std::string> files, const std::string &request, bool in_order) {
    std::vector<std::array<std::uint8_t, 16>> hashes;
    for (const std::string &path : files) {
        const Result<MappedFile> file = MappedFile::open(path);
        if (!file)
            return Error{file.error().code, 0, path + ": " + file.error().message};
        hashes.push_back(hash_of(file->bytes()));
    }
    if (!in_order)
        std::sort(hashes.begin(), hashes.end());
    StreamingHash all;
    for (const auto &hash : hashes)
        all.add(hash);
    return SourceRecord{.source_hash = hex(hashes.size() == 1 ? hashes.front() : canonical(all.finish())),
                        .request_hash = hex(hash_of(as_bytes(request)))};
}

Result<std::string> with_record(const std::string &metadata, const SourceRecord &record) {
    nlohmann::ordered_json json = nlohmann::ordered_json::parse(metadata);
    json[kSourceHash] = record.source_hash;
    json[kRequestHash] = record.request_hash;
    std::string text = json.dump();
    if (text.size() > kMaxMetadataBytes)
        return usage("--name, --licence and --credit are too long: metadata is at most 4,096 bytes");
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
    EarlierOutput earlier{.record = {text_of(metadata, kSourceHash), text_of(metadata, kRequestHash)},
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
