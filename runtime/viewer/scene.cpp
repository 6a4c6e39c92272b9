#include "viewer/scene.h"

#include "pbm_format/platform.h"

namespace pbm {

Status check_scene(const std::string &path) {
    const auto file = MappedFile::open(path);
    if (!file)
        return file.error();
    if (const auto reader = Reader::open(file->bytes()); !reader)
        return reader.error();
    return {};
}

Result<std::shared_ptr<const Scene>> load_scene(const std::string &path, const LoadOptions &options) {
    const auto file = MappedFile::open(path);
    if (!file)
        return file.error();
    auto reader = Reader::open(file->bytes());
    if (!reader)
        return reader.error();
    auto model = load_model(*reader, options);
    if (!model)
        return model.error();
    return std::make_shared<const Scene>(std::move(*model));
}

Error with_advice(std::string_view program, Error error) {
    switch (error.code) {
    case ErrorCode::memory: error.message += "; allow more with --max-memory or draw a coarser --level"; break;
    case ErrorCode::unsupported_version:
    case ErrorCode::unsupported_feature: error.message += "; a newer " + std::string(program) + " is needed"; break;
    case ErrorCode::usage:
    case ErrorCode::io:
    case ErrorCode::not_bvg: break; // the message says it
    default: error.message += "; pbm-validate names all damage, build the file anew";
    }
    return error;
}

} // namespace pbm
