// pbm-info: what is in a .bvg, from its header, tables and directories; no chunk is decoded.
#include "command_line/common_options.h"
#include "pbm_format/platform.h"
#include "pbm_format/reader.h"

#include <nlohmann/json.hpp>

#include <iomanip>
#include <iostream>
#include <sstream>

namespace {

using nlohmann::json;

// A stream summed over chunks.
struct StreamSize {
    std::string type;
    std::uint64_t stored_bytes = 0, raw_bytes = 0;
};

struct LevelSize {
    int level = 0;
    std::uint64_t points = 0, directory_bytes = 0, bytes = 0; // of the directory; of directory, bricks and chunks
    std::uint64_t bricks = 0;
    std::size_t chunks = 0;
    std::vector<StreamSize> streams;
};

struct FileSizes {
    std::vector<LevelSize> levels;
    std::vector<StreamSize> streams; // over all levels
};

pbm::Result<FileSizes> measure(pbm::Reader &reader) {
    const pbm::AttributeSet &set = reader.parameters().attributes;
    const std::vector<pbm::StreamInfo> infos = pbm::streams_of(set);
    FileSizes sizes;
    for (const pbm::StreamInfo &info : infos) {
        std::string type(pbm::to_string(info.kind));
        if (info.kind == pbm::StreamKind::shadow)
            type += " " + std::to_string(info.light);
        sizes.streams.push_back({.type = std::move(type)});
    }
    for (int level = 1; level <= reader.depth(); ++level) {
        const pbm::Result<const pbm::LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        const auto instance = static_cast<std::uint32_t>(level);
        LevelSize size{.level = level,
                       .points = (*directory)->points,
                       .directory_bytes = reader.section(pbm::SectionType::level_directory, instance)->stored_bytes,
                       .bytes = reader.section(pbm::SectionType::level_directory, instance)->stored_bytes +
                                reader.section(pbm::SectionType::level_chunks, instance)->stored_bytes,
                       .chunks = (*directory)->chunks.size(),
                       .streams = {}};
        if (const pbm::SectionEntry *bricks = reader.section(pbm::SectionType::level_bricks, instance))
            size.bytes += bricks->stored_bytes;
        for (const StreamSize &stream : sizes.streams)
            size.streams.push_back({.type = stream.type});
        for (const pbm::ChunkEntry &chunk : (*directory)->chunks) {
            size.bricks += chunk.shape.bricks;
            for (std::size_t s = 0; s < infos.size(); ++s) {
                size.streams[s].stored_bytes += chunk.streams[s].stored_bytes;
                size.streams[s].raw_bytes +=
                    pbm::raw_stream_bytes(infos[s], set, level, chunk.shape.nodes, chunk.shape.points);
            }
        }
        for (std::size_t s = 0; s < infos.size(); ++s) {
            sizes.streams[s].stored_bytes += size.streams[s].stored_bytes;
            sizes.streams[s].raw_bytes += size.streams[s].raw_bytes;
        }
        sizes.levels.push_back(std::move(size));
    }
    return sizes;
}

std::string_view colour_name(pbm::ColourFormat format) {
    constexpr std::array<std::string_view, 3> kNames{"none", "565", "888"};
    return kNames[static_cast<std::size_t>(format)];
}

std::string hex(const pbm::ContentId &id) {
    std::ostringstream out;
    out << std::hex << std::setfill('0') << std::setw(16) << id[1] << std::setw(16) << id[0];
    return out.str();
}

json to_json(const std::vector<StreamSize> &streams) {
    json list = json::array();
    for (const StreamSize &stream : streams)
        list.push_back({{"type", stream.type}, {"stored_bytes", stream.stored_bytes}, {"raw_bytes", stream.raw_bytes}});
    return list;
}

json to_json(const std::string &path, const pbm::Reader &reader, const FileSizes &sizes) {
    const pbm::FileHeader &header = reader.header();
    const pbm::ModelParameters &parameters = reader.parameters();
    json levels = json::array();
    for (const LevelSize &level : sizes.levels)
        levels.push_back({{"level", level.level},
                          {"points", level.points},
                          {"bytes", level.bytes},
                          {"directory_bytes", level.directory_bytes},
                          {"chunks", level.chunks},
                          {"bricks", level.bricks},
                          {"streams", to_json(level.streams)}});
    json materials = json::array();
    for (const pbm::Material &material : parameters.materials)
        materials.push_back({{"ka", material.ka},
                             {"kd", material.kd},
                             {"ks", material.ks},
                             {"power", material.power},
                             {"colour", material.colour},
                             {"environment", material.environment}});
    return {{"file", path},
            {"version", std::to_string(header.major) + "." + std::to_string(header.minor)},
            {"file_bytes", header.file_size},
            {"points", header.point_count},
            {"bits_per_point", 8.0 * static_cast<double>(header.file_size) / static_cast<double>(header.point_count)},
            {"depth", header.depth},
            {"voxel_size", parameters.grid.voxel_size},
            {"origin", parameters.grid.origin},
            {"unit", pbm::to_string(parameters.grid.unit)},
            {"up", pbm::to_string(parameters.grid.up)},
            {"store", pbm::to_string(header.storage())},
            {"colour", colour_name(parameters.attributes.colour)},
            {"content_id", hex(header.content_id)},
            {"materials", std::move(materials)},
            {"lights", parameters.lights.size()},
            {"metadata", json::parse(reader.metadata(), nullptr, false)},
            {"streams", to_json(sizes.streams)},
            {"levels", std::move(levels)}};
}

void print_text(const std::string &path, const pbm::Reader &reader, const FileSizes &sizes) {
    const pbm::FileHeader &header = reader.header();
    const pbm::ModelParameters &parameters = reader.parameters();
    const auto points = static_cast<double>(header.point_count);
    const auto bits = [&](std::uint64_t bytes) { return 8.0 * static_cast<double>(bytes) / points; };
    const pbm::Grid &grid = parameters.grid;
    std::cout << pbm::command_line::printable(path) << ": binary voxel grid " << header.major << '.' << header.minor
              << '\n'
              << "points      " << header.point_count << " at depth " << +header.depth << '\n'
              << "file        " << header.file_size << " bytes, " << std::fixed << std::setprecision(2)
              << bits(header.file_size) << " bits per point, " << pbm::to_string(header.storage()) << '\n'
              << std::defaultfloat << std::setprecision(9) << "voxel size  " << grid.voxel_size
              << (grid.unit == pbm::Unit::unknown ? "" : " ")
              << (grid.unit == pbm::Unit::unknown ? std::string_view() : pbm::to_string(grid.unit)) << '\n'
              << "grid        from " << grid.origin[0] << ' ' << grid.origin[1] << ' ' << grid.origin[2] << ", edge "
              << grid.edge() << ", up " << pbm::to_string(grid.up) << '\n'
              << "colour      " << colour_name(parameters.attributes.colour) << '\n'
              << "materials   " << parameters.materials.size() << ", lights " << parameters.lights.size() << '\n'
              << "content id  " << hex(header.content_id) << '\n'
              << "metadata    " << reader.metadata() << "\n\n"
              << "stream            stored bytes      raw bytes  bits/point\n"
              << std::fixed << std::setprecision(2);
    for (const StreamSize &stream : sizes.streams)
        std::cout << std::left << std::setw(12) << stream.type << std::right << std::setw(18) << stream.stored_bytes
                  << std::setw(15) << stream.raw_bytes << std::setw(12) << bits(stream.stored_bytes) << '\n';
    std::cout << "\nlevel        points   chunks   bricks          bytes  bits/point\n";
    for (const LevelSize &level : sizes.levels)
        std::cout << std::setw(5) << level.level << std::setw(14) << level.points << std::setw(9) << level.chunks
                  << std::setw(9) << level.bricks << std::setw(15) << level.bytes << std::setw(12) << bits(level.bytes)
                  << '\n';
}

int fail(const std::string &path, const pbm::Error &error) { return pbm::command_line::fail("pbm-info", path, error); }

int run(int argc, char **argv) {
    CLI::App app{"Says what is in a binary voxel grid (.bvg): points, levels, streams, sizes.", "pbm-info"};
    std::string path, json_path;
    app.add_option("FILE", path, "Model to look into")->required();
    pbm::command_line::add_json(app, json_path, "All of it");
    auto verbosity = pbm::command_line::Verbosity::normal;
    pbm::command_line::add_quiet(app, verbosity);
    app.set_version_flag("-V,--version", "pbm-info " PBM_VERSION);
    if (const auto done = pbm::command_line::parse(
            app, "pbm-info", argc, argv, {},
            {.examples = {{"pbm-info --json scan.bvg", "Everything about a model, for other programs."}}}))
        return *done;
    if (const auto refused = pbm::command_line::refuse_outputs("pbm-info", {{path}}, {{json_path}}))
        return *refused;
    const pbm::Result<pbm::MappedFile> file = pbm::MappedFile::open(path);
    if (!file)
        return fail(path, file.error());
    pbm::Result<pbm::Reader> reader = pbm::Reader::open(file->bytes());
    if (!reader)
        return fail(path, reader.error());
    const pbm::Result<FileSizes> sizes = measure(*reader);
    if (!sizes)
        return fail(path, sizes.error());
    if (json_path.empty()) {
        if (verbosity != pbm::command_line::Verbosity::quiet)
            print_text(path, *reader, *sizes);
        return 0;
    }
    const std::string text = to_json(path, *reader, *sizes).dump(2, ' ', false, json::error_handler_t::replace) + "\n";
    if (const pbm::Status status = pbm::command_line::write_text(json_path, text); !status)
        return fail(json_path, status.error());
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    return pbm::command_line::run_program("pbm-info", [&] { return run(argc, argv); });
}
