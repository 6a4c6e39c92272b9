#include "sources/source_files.h"

#include "pbm_build/preparing/poses.h"
#include "pbm_scan/surface_reader.h"
#include "system/files/file_state.h"
#include "system/files/mapped_file.h"

#include <filesystem>
#include <system_error>
#include <unordered_set>

namespace pbm::build {
namespace {

bool is_regular_file(const std::string &path) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(path, ignored);
}

Error changed(const std::string &file) {
    return {ErrorCode::io, 0, file + ": changed while it was read; build again when it is complete"};
}

} // namespace

SourceFiles find_sources(std::span<const std::string> given, std::span<const std::string> inputs,
                         const std::string &recipe) {
    SourceFiles sources;
    const std::unordered_set<std::string> scans_given(inputs.begin(), inputs.end());
    std::unordered_set<std::string> known;
    const auto read = [&](const std::string &file) {
        if (known.insert(file).second) {
            sources.there.push_back(file);
            sources.states.push_back(is_stream(file) ? "" : file_state(file));
        }
    };
    const auto look_for = [&](const NamedFile &named) {
        if (!named.file.empty())
            read(named.file);
        if (named.file != named.place && !named.name.empty() && known.insert(named.place).second)
            sources.missing.push_back(named.place);
    };
    for (const std::string &file : given) // before what they name, which follows from their content
        read(file);
    for (const std::string &file : given) {
        GivenFile &found = sources.given.emplace_back(GivenFile{file, scans_given.contains(file)});
        std::vector<NamedFile> scans = scans_of_alignment(file);
        if (scans.empty())
            scans.push_back({.name = {}, .file = file, .place = file});
        for (const NamedFile &scan : scans) {
            if (!scan.name.empty())
                found.named.push_back(scan);
            look_for(scan);
            if (scan.file.empty())
                continue;
            for (NamedFile &named : further_files(scan.file)) {
                look_for(named);
                found.named.push_back(std::move(named));
            }
        }
    }
    if (!recipe.empty())
        read(recipe);
    return sources;
}

Status verify_unchanged(const SourceFiles &sources) {
    for (std::size_t i = 0; i < sources.there.size(); ++i)
        if (!sources.states[i].empty() && file_state(sources.there[i]) != sources.states[i])
            return changed(sources.there[i]);
    for (const std::string &place : sources.missing)
        if (is_regular_file(place))
            return changed(place);
    return {};
}

} // namespace pbm::build
