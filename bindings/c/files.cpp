// What opens files of the operating system.
#include "files.h"

#include "model.h"
#include "validation.h"

#include "system/files/mapped_file.h"

#include <memory>
#include <optional>
#include <utility>

namespace pbm::c_api {

Status add_file(const char *path, pbm_model **model) {
    Result<MappedFile> opened = MappedFile::open(path);
    if (!opened)
        return of_file(path, opened.error());
    const auto file = std::make_shared<const MappedFile>(std::move(*opened));
    const Status added = add_model(FileBytes::held({file->bytes(), file}, MappedFile::will_need), model);
    return added ? Status() : Status(of_file(path, added.error()));
}

} // namespace pbm::c_api

using namespace pbm;
using namespace pbm::c_api;

pbm_code pbm_open_file(const char *path, pbm_model **model, pbm_error *error) {
    return guarded(error, [&]() -> Status {
        if (model == nullptr || path == nullptr)
            return usage(model == nullptr ? "model is null" : "path is null");
        *model = nullptr;
        return add_file(path, model);
    });
}

pbm_code pbm_validate_file(const char *path, pbm_validation *validation, pbm_error *error) {
    return guarded(error, [&]() -> Status {
        if (path == nullptr)
            return usage("path is null");
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
