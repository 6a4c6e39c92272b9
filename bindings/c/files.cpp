// What opens files of the operating system.
#include "files.h"

#include "model.h"
#include "validation.h"

#include "system/files/mapped_file.h"

#include <memory>
#include <optional>
#include <utility>

namespace pbm::c_api {

namespace {

// The file in memory of our own.
Result<MappedFile> read_privately(const char *path) {
    if (is_stream(path))
        return MappedFile::open(path); // which says why not
    constexpr std::uint64_t kAll = ~std::uint64_t{0};
    return MappedFile::read_stream(path, kAll, [](ByteView) { return kAll; });
}

Status add_file(const char *path, Result<MappedFile> opened, void (*start_reading)(ByteView), pbm_model **model) {
    if (!opened)
        return of_file(path, opened.error());
    const auto file = std::make_shared<const MappedFile>(std::move(*opened));
    const Status added = add_model(FileBytes::held({file->bytes(), file}, start_reading), model);
    return added ? Status() : Status(of_file(path, added.error()));
}

Status check_arguments(const char *path, pbm_model **model) {
    if (model == nullptr || path == nullptr)
        return usage_error(model == nullptr ? "model is null" : "path is null");
    *model = nullptr;
    return {};
}

} // namespace

Status add_file(const char *path, pbm_model **model) {
    return add_file(path, MappedFile::open(path), MappedFile::will_need, model);
}

} // namespace pbm::c_api

using namespace pbm;
using namespace pbm::c_api;

pbm_code pbm_open_file(const char *path, pbm_model **model, pbm_error *error) {
    return guarded(error, [&]() -> Status {
        const Status checked = check_arguments(path, model);
        return checked ? add_file(path, model) : checked;
    });
}

pbm_code pbm_open_private(const char *path, pbm_model **model, pbm_error *error) {
    return guarded(error, [&]() -> Status {
        const Status checked = check_arguments(path, model);
        return checked ? add_file(path, read_privately(path), nullptr, model) : checked;
    });
}

pbm_code pbm_validate_file(const char *path, pbm_validation *validation, pbm_error *error) {
    return guarded(error, [&]() -> Status {
        if (path == nullptr)
            return usage_error("path is null");
        std::optional<MappedFile> file;
        return validate_bytes(validation, [&]() -> Result<ByteView> {
            Result<MappedFile> opened = MappedFile::open(path);
            if (!opened)
                return of_file(path, opened.error());
            file = std::move(*opened);
            return file->bytes();
        });
    });
}
