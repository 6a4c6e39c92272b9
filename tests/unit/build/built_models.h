// Builds surfaces into models and files, or expects an error.
#pragma once

#include "pbm_build/pipeline.h"
#include "pbm_format/writing/writer.h"

#include <gtest/gtest.h>

namespace pbm::build {

inline Result<Model> build_model(Surface surface, const BuildOptions &options, BuildStatistics &statistics) {
    return build_model(std::vector<Surface>{std::move(surface)}, options, statistics);
}

} // namespace pbm::build

namespace pbm::test {

inline build::BuildOptions at_depth(int depth) {
    build::BuildOptions options;
    options.grid.depth = depth;
    options.threads = 2;
    return options;
}

// `input`: one surface, or several to merge. The default argument makes braces work.
template <class Input = std::vector<build::Surface>>
Model built(Input input, const build::BuildOptions &options, build::BuildStatistics *said = nullptr) {
    build::BuildStatistics statistics;
    Result<Model> model = build::build_model(std::move(input), options, said != nullptr ? *said : statistics);
    EXPECT_TRUE(model.ok()) << (model.ok() ? "" : model.error().message);
    return model.ok() ? std::move(*model) : Model{};
}

template <class Input = std::vector<build::Surface>>
Error refused(Input input, const build::BuildOptions &options = {}) {
    build::BuildStatistics statistics;
    const Result<Model> model = build::build_model(std::move(input), options, statistics);
    EXPECT_FALSE(model.ok());
    return model.ok() ? Error{} : model.error();
}

inline Bytes file_of(const Model &model, const WriteOptions &options = {}) {
    Result<Bytes> file = encode_model(model, options);
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message);
    return file.ok() ? std::move(*file) : Bytes{};
}

} // namespace pbm::test
