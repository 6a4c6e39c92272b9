// pbm-info: lists the contents of a .pbvg from its header, tables and directories; decodes no tile, and chunks only
// where points may be round.
#include "command_line/common_options.h"
#include "command_line/json_report.h"
#include "pbm_format/hashes/hash.h"
#include "pbm_format/rasters/image_section.h"
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/field_reader.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/reading/point_stream_reader.h"
#include "pbm_format/reading/reader.h"
#include "system/files/mapped_file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>
#include <string_view>

namespace pbm {
NLOHMANN_JSON_SERIALIZE_ENUM(PointShape, {{PointShape::disc, "disc"}, {PointShape::round, "round"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Material, ka, kd, ks, power, colour, environment, shape, tint)
} // namespace pbm

// Not in an anonymous namespace, where clang would call the readers that the macro adds unused.
namespace pbm::info_program {

// Size of a stream, summed over chunks.
struct StreamSize {
    std::string type;
    std::uint64_t stored_bytes = 0, raw_bytes = 0;
    NLOHMANN_DEFINE_TYPE_INTRUSIVE(StreamSize, type, stored_bytes, raw_bytes)
};

struct LevelSize {
    int level = 0;
    std::uint64_t points = 0, directory_bytes = 0, bytes = 0; // bytes: of directory, bricks and chunks
    std::uint64_t bricks = 0;
    std::size_t chunks = 0;
    std::vector<StreamSize> streams;
    NLOHMANN_DEFINE_TYPE_INTRUSIVE(LevelSize, level, points, directory_bytes, bytes, bricks, chunks, streams)
};

struct RasterSize {
    std::string type;
    std::uint32_t width = 0, height = 0, channels = 0;
    int mip_levels = 0;
    std::size_t tiles = 0;
    std::uint64_t stored_bytes = 0, raw_bytes = 0; // directory and all mip levels
    NLOHMANN_DEFINE_TYPE_INTRUSIVE(RasterSize, type, width, height, channels, mip_levels, tiles, stored_bytes,
                                   raw_bytes)
};

struct FileSizes {
    std::vector<LevelSize> levels;
    std::vector<StreamSize> streams; // over all levels
    std::vector<RasterSize> rasters;
    std::uint64_t counted_bytes = 0;                     // of the file without its panorama; base of bits per point
    std::uint64_t round_points = 0;                      // of the finest level
    std::uint64_t points_with_sides = 0, side_bytes = 0; // of all levels
    std::uint64_t points_with_offsets = 0, offset_bytes = 0;
};

} // namespace pbm::info_program

namespace {

using namespace pbm;
using namespace pbm::info_program;
using nlohmann::json;

Status measure_rasters(const Reader &reader, ByteView file, FileSizes &sizes) {
    sizes.counted_bytes = reader.header().file_size;
    for (const SectionEntry *entry : rasters(reader)) {
        const Result<ImageDirectory> directory = read_image_directory(file, *entry, reader.header().storage());
        if (!directory)
            return directory.error();
        const TileGrid &grid = directory->grid;
        std::string type(to_string(entry->type));
        if (entry->type == SectionType::ground_lit)
            (type += " ") += std::to_string(entry->instance);
        if (entry->type == SectionType::panorama)
            sizes.counted_bytes -= entry->stored_bytes;
        sizes.rasters.push_back({.type = std::move(type),
                                 .width = grid.width(0),
                                 .height = grid.height(0),
                                 .channels = grid.channels(),
                                 .mip_levels = grid.levels(),
                                 .tiles = grid.tiles(),
                                 .stored_bytes = entry->stored_bytes,
                                 .raw_bytes = image_directory_bytes(grid) + grid.texel_bytes()});
    }
    return {};
}

// Adds the streams of the fields, of all levels and of each.
Result<FileSizes> measure_fields(Reader &reader, FileSizes &sizes) {
    const std::vector<Field> &fields = reader.parameters().fields;
    if (fields.empty())
        return std::move(sizes);
    Result<FieldReader> values = FieldReader::open(reader);
    if (!values)
        return values.error();
    const std::size_t first = sizes.streams.size();
    for (const Field &field : fields)
        sizes.streams.push_back({.type = "field " + field.name});
    for (LevelSize &size : sizes.levels) {
        const LevelDirectory &level = *reader.directory(size.level).value();
        const Result<FieldDirectory> directory = values->directory(level);
        if (!directory)
            return directory.error();
        for (std::size_t f = 0; f < fields.size(); ++f) {
            StreamSize &stream = size.streams.emplace_back(StreamSize{.type = sizes.streams[first + f].type});
            stream.raw_bytes = level.points * fields[f].bytes;
            for (std::size_t chunk = 0; chunk < level.chunks.size(); ++chunk)
                stream.stored_bytes += directory->at(chunk, f).stream.stored_bytes;
            sizes.streams[first + f].stored_bytes += stream.stored_bytes;
            sizes.streams[first + f].raw_bytes += stream.raw_bytes;
            size.bytes += stream.stored_bytes;
        }
    }
    return std::move(sizes);
}

Result<FileSizes> measure(Reader &reader, ByteView file) {
    const AttributeSet &set = reader.parameters().attributes;
    const StreamList infos = streams_of(set);
    FileSizes sizes;
    if (Status status = measure_rasters(reader, file, sizes); !status)
        return std::move(status).error();
    for (const StreamInfo &info : infos)
        sizes.streams.push_back({.type = name_of(info)});
    for (int level = 1; level <= reader.depth(); ++level) {
        const Result<const LevelDirectory *> directory = reader.directory(level);
        if (!directory)
            return directory.error();
        const auto stored_bytes = [&](SectionType type) -> std::uint64_t {
            const SectionEntry *const section = reader.section(type, static_cast<std::uint32_t>(level));
            return section == nullptr ? 0 : section->stored_bytes;
        };
        const std::uint64_t directory_bytes = stored_bytes(SectionType::level_directory);
        LevelSize size{.level = level,
                       .points = (*directory)->points,
                       .directory_bytes = directory_bytes,
                       .bytes = directory_bytes + stored_bytes(SectionType::level_chunks) +
                                stored_bytes(SectionType::level_bricks),
                       .chunks = (*directory)->chunks.size(),
                       .streams = {}};
        for (const StreamSize &stream : sizes.streams)
            size.streams.push_back({.type = stream.type});
        for (const ChunkEntry &chunk : (*directory)->chunks) {
            size.bricks += chunk.shape.bricks;
            for (std::size_t s = 0; s < infos.size(); ++s)
                for (StreamSize *const sum : {&size.streams[s], &sizes.streams[s]}) {
                    sum->stored_bytes += chunk.streams[s].stored_bytes;
                    sum->raw_bytes += raw_stream_bytes(infos[s], set, level, chunk.shape.nodes, chunk.shape.points);
                }
        }
        sizes.levels.push_back(std::move(size));
    }
    return measure_fields(reader, sizes);
}

std::string_view colour_name(ColourFormat format) {
    return std::array{"none", "565", "888"}[static_cast<std::size_t>(format)];
}
std::string_view kind_name(LightKind kind) {
    return std::array{"directional", "point", "spot"}[static_cast<std::size_t>(kind)];
}
std::string_view kind_name(TextureKind kind) { return kind == TextureKind::marble ? "marble" : "wood"; }

// Bits of lit fraction of a light at levels 0..depth.
std::vector<int> shadow_bits(const Reader &reader, std::size_t light) {
    const auto &bits = reader.parameters().attributes.shadow_bits[light];
    return {bits.begin(), bits.begin() + reader.depth() + 1};
}

json to_json(const SolidTexture &texture) {
    return {{"kind", kind_name(texture.kind)},
            {"seed", texture.seed},
            {"scale", texture.scale},
            {"turbulence", texture.turbulence}};
}

json lights_to_json(const Reader &reader) {
    const ModelParameters &parameters = reader.parameters();
    json list = json::array();
    for (std::size_t i = 0; i < parameters.lights.size(); ++i) {
        const Light &light = parameters.lights[i];
        const bool shadow = static_cast<int>(i) < parameters.attributes.lights;
        list.push_back({{"kind", kind_name(light.kind)},
                        {"intensity", light.intensity},
                        {"position", light.position},
                        {"direction", light.direction},
                        {"exponent", light.exponent},
                        {"shadow_bits", shadow ? json(shadow_bits(reader, i)) : json()}});
    }
    return list;
}

json fields_to_json(const Reader &reader) {
    json list = json::array();
    for (const Field &field : reader.parameters().fields)
        list.push_back({{"name", field.name},
                        {"unit", field.unit},
                        {"offset", field.offset},
                        {"scale", field.scale},
                        {"bits", 8 * field.bytes},
                        {"average", to_string(field.average)}});
    return list;
}

json ground_to_json(const std::optional<GroundPlane> &ground) {
    if (!ground)
        return {};
    return {{"centre", ground->centre},
            {"half_edge", ground->half_edge},
            {"material", ground->material},
            {"texture", ground->texture ? to_json(*ground->texture) : json()}};
}

json to_json(const std::string &path, const Reader &reader, const FileSizes &sizes) {
    const FileHeader &header = reader.header();
    const ModelParameters &parameters = reader.parameters();
    return {
        {"file", path},
        {"version", std::to_string(header.major) + "." + std::to_string(header.minor)},
        {"file_bytes", header.file_size},
        {"points", header.point_count},
        {"bits_per_point", 8.0 * static_cast<double>(sizes.counted_bytes) / static_cast<double>(header.point_count)},
        {"depth", header.depth},
        {"voxel_size", parameters.grid.voxel_size},
        {"origin", parameters.grid.origin},
        {"unit", to_string(parameters.grid.unit)},
        {"up", to_string(parameters.grid.up)},
        {"store", to_string(header.storage())},
        {"colour", colour_name(parameters.attributes.colour)},
        {"closed", parameters.closed},
        {"round_points", sizes.round_points},
        {"points_with_sides", sizes.points_with_sides},
        {"points_with_offsets", sizes.points_with_offsets},
        {"content_id", hexadecimal(header.content_id)},
        {"materials", parameters.materials},
        {"lights", lights_to_json(reader)},
        {"texture", parameters.texture.empty() ? json() : to_json(parameters.texture.front())},
        {"ground", ground_to_json(parameters.ground)},
        {"fields", fields_to_json(reader)},
        {"rasters", sizes.rasters},
        {"metadata", json::parse(reader.metadata(), nullptr, false)},
        {"streams", sizes.streams},
        {"levels", sizes.levels}};
}

std::string texture_text(const SolidTexture &texture) {
    std::ostringstream out;
    out << kind_name(texture.kind) << ", seed " << texture.seed << ", scale " << texture.scale << ", turbulence "
        << texture.turbulence;
    return out.str();
}

// Prints materials, lights, textures and ground, one line each.
void print_shading(const ModelParameters &parameters) {
    std::cout << std::defaultfloat << std::setprecision(4);
    for (std::size_t i = 0; i < parameters.materials.size(); ++i) {
        const Material &m = parameters.materials[i];
        std::cout << "material " << i << "  ka " << m.ka << ", kd " << m.kd << ", ks " << m.ks << ", power " << m.power
                  << ", colour " << +m.colour[0] << ' ' << +m.colour[1] << ' ' << +m.colour[2] << ", environment "
                  << m.environment << (m.tint > 0 ? ", tint " + std::to_string(m.tint) : "")
                  << (is_round(m) ? ", round\n" : "\n");
    }
    const auto print_vector = [](const char *name, const std::array<float, 3> &v) {
        std::cout << name << v[0] << ' ' << v[1] << ' ' << v[2];
    };
    for (std::size_t i = 0; i < parameters.lights.size(); ++i) {
        const Light &light = parameters.lights[i];
        std::cout << "light " << i << "     " << kind_name(light.kind);
        print_vector(", intensity ", light.intensity);
        if (light.kind != LightKind::directional)
            print_vector(", at ", light.position);
        if (light.kind != LightKind::point)
            print_vector(", along ", light.direction);
        if (light.kind == LightKind::spot)
            std::cout << ", exponent " << light.exponent;
        std::cout << (static_cast<int>(i) < parameters.attributes.lights ? ", with shadow\n" : "\n");
    }
    if (!parameters.texture.empty())
        std::cout << "texture     " << texture_text(parameters.texture.front()) << '\n';
    if (const auto &ground = parameters.ground) {
        print_vector("ground      centre ", ground->centre);
        std::cout << ", half edge " << ground->half_edge << ", material " << +ground->material
                  << (ground->texture ? ", " + texture_text(*ground->texture) : std::string()) << '\n';
    }
}

// Prints the fields, one line each: which values they can have, and how coarser levels get theirs.
void print_fields(const Reader &reader) {
    std::cout << std::defaultfloat << std::setprecision(9);
    for (const Field &field : reader.parameters().fields)
        std::cout << "field       " << command_line::printable(field.name) << ", room for " << field.value(1) << " to "
                  << field.value(field.max_stored()) << (field.unit.empty() ? "" : " ")
                  << command_line::printable(field.unit) << " in steps of " << field.scale << ", " << 8 * field.bytes
                  << " bits, " << to_string(field.average) << '\n';
}

// Prints the names of the cameras that the scan had.
void print_views(std::string_view metadata) {
    const json all = json::parse(metadata, nullptr, false);
    const json views = all.is_object() ? all.value("views", json()) : json();
    std::string names;
    for (const json &view : views.is_array() ? views : json::array())
        if (view.is_object() && view.contains("name") && view["name"].is_string())
            names += (names.empty() ? "" : ", ") + command_line::printable(view["name"].get<std::string>());
    if (!names.empty())
        std::cout << "views       " << names << '\n';
}

// Prints bits of lit fraction and stored bytes per level.
void print_shadows(const Reader &reader, const FileSizes &sizes) {
    const auto lights = static_cast<std::size_t>(reader.parameters().attributes.lights);
    if (lights == 0)
        return;
    std::cout << "\nlevel";
    for (std::size_t light = 0; light < lights; ++light)
        std::cout << "  shadow " << light << " bits          bytes";
    std::cout << '\n';
    for (const LevelSize &level : sizes.levels) {
        std::cout << std::setw(5) << level.level;
        // Shadows are the last streams before the fields.
        const std::size_t first = level.streams.size() - reader.parameters().fields.size() - lights;
        for (std::size_t light = 0; light < lights; ++light)
            std::cout << std::setw(15) << shadow_bits(reader, light)[static_cast<std::size_t>(level.level)]
                      << std::setw(15) << level.streams[first + light].stored_bytes;
        std::cout << '\n';
    }
}

void print_rasters(const std::vector<RasterSize> &rasters) {
    if (rasters.empty())
        return;
    std::cout << "\nraster               texels   tiles   stored bytes      raw bytes  bits/texel\n";
    for (const RasterSize &raster : rasters) {
        const std::string shape = std::to_string(raster.width) + "x" + std::to_string(raster.height);
        const double texels = static_cast<double>(raster.width) * raster.height;
        std::cout << std::left << std::setw(15) << raster.type << std::right << std::setw(12) << shape << std::setw(8)
                  << raster.tiles << std::setw(15) << raster.stored_bytes << std::setw(15) << raster.raw_bytes
                  << std::setw(12) << 8.0 * static_cast<double>(raster.stored_bytes) / texels << '\n';
    }
}

void print_text(const std::string &path, const Reader &reader, const FileSizes &sizes) {
    const FileHeader &header = reader.header();
    const ModelParameters &parameters = reader.parameters();
    const auto points = static_cast<double>(header.point_count);
    const auto bits = [&](std::uint64_t bytes) { return 8.0 * static_cast<double>(bytes) / points; };
    const Grid &grid = parameters.grid;
    std::cout << command_line::printable(path) << ": binary voxel grid " << header.major << '.' << header.minor << '\n'
              << "points      " << header.point_count << " at depth " << +header.depth << '\n'
              << "file        " << header.file_size << " bytes, " << std::fixed << std::setprecision(2)
              << bits(sizes.counted_bytes)
              << (sizes.counted_bytes == header.file_size ? " bits per point, "
                                                          : " bits per point without the panorama, ")
              << to_string(header.storage()) << '\n'
              << std::defaultfloat << std::setprecision(9) << "voxel size  " << grid.voxel_size
              << (grid.unit == Unit::unknown ? "" : " ")
              << (grid.unit == Unit::unknown ? std::string_view() : to_string(grid.unit)) << '\n'
              << "grid        from " << grid.origin[0] << ' ' << grid.origin[1] << ' ' << grid.origin[2] << ", edge "
              << grid.edge() << ", up " << to_string(grid.up) << '\n'
              << "colour      " << colour_name(parameters.attributes.colour) << '\n'
              << (parameters.closed ? "surface     closed\n" : "")
              << (sizes.round_points > 0 ? "round       " + std::to_string(sizes.round_points) + " points\n" : "")
              << (sizes.points_with_sides > 0
                      ? "two sides   " + std::to_string(sizes.points_with_sides) + " points of all levels, " +
                            std::to_string(sizes.side_bytes) + " bytes\n"
                      : "")
              << (sizes.points_with_offsets > 0 ? "offsets     " + std::to_string(sizes.points_with_offsets) +
                                                      " points, " + std::to_string(sizes.offset_bytes) + " bytes\n"
                                                : "")
              << "materials   " << parameters.materials.size() << ", lights " << parameters.lights.size() << '\n';
    print_shading(parameters);
    print_fields(reader);
    print_views(reader.metadata());
    std::cout << "content id  " << hexadecimal(header.content_id) << '\n'
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
    print_shadows(reader, sizes);
    print_rasters(sizes.rasters);
}

// Decodes all levels of a file some of whose materials have round points.
Result<std::uint64_t> count_round_points(Reader &reader) {
    const std::vector<Material> &materials = reader.parameters().materials;
    if (std::none_of(materials.begin(), materials.end(), is_round))
        return 0;
    const Result<Model> model = load_points(reader);
    if (!model)
        return model.error();
    const Bytes &ids = model->levels.back().points.materials;
    return ids.empty() ? model->point_count()
                       : static_cast<std::uint64_t>(std::count_if(
                             ids.begin(), ids.end(), [&](std::uint8_t id) { return is_round(materials[id]); }));
}

Status measure_point_streams(Reader &reader, FileSizes &sizes) {
    const auto bytes_of = [&](PointStream kind, int level) {
        const SectionEntry *const values = reader.section(SectionType::stream_values, instance_of(kind, level));
        return values == nullptr ? 0 : values->stored_bytes;
    };
    for (const LevelSize &level : sizes.levels) {
        const Result<std::uint64_t> with_sides = count_sides(reader, level.level);
        const Result<std::uint64_t> with_offsets = count_offsets(reader, level.level);
        if (!with_sides || !with_offsets)
            return with_sides ? with_offsets.error() : with_sides.error();
        sizes.points_with_sides += *with_sides;
        sizes.side_bytes += bytes_of(PointStream::sides, level.level);
        sizes.points_with_offsets += *with_offsets;
        sizes.offset_bytes += bytes_of(PointStream::offsets, level.level);
    }
    return {};
}

int fail(const std::string &path, const Error &error) { return command_line::fail("pbm-info", path, error); }

int run(int argc, char **argv) {
    command_line::CommandLine line{"pbm-info",
                                   "Says what is in a binary voxel grid (.pbvg): points, levels, streams, sizes."};
    std::string path, json_path;
    line.add("FILE", "Model to look into", &path, {.required = true});
    command_line::add_json(line, json_path, "All of it");
    auto verbosity = command_line::Verbosity::normal;
    command_line::add_quiet(line, verbosity);
    line.add_version(PBM_VERSION);
    if (const auto done = command_line::parse(
            line, argc, argv, {},
            {.examples = {{"pbm-info --json scan.pbvg", "Everything about a model, for other programs."}}}))
        return *done;
    if (const auto refused = command_line::refuse_outputs("pbm-info", {{path}}, {{{"--json", json_path}}}))
        return *refused;
    const Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        return fail(path, file.error());
    Result<Reader> reader = Reader::open(file->bytes());
    if (!reader)
        return fail(path, reader.error());
    Result<FileSizes> sizes = measure(*reader, file->bytes());
    if (!sizes)
        return fail(path, sizes.error());
    const Result<std::uint64_t> round = count_round_points(*reader);
    if (!round)
        return fail(path, round.error());
    sizes->round_points = *round;
    if (const Status measured = measure_point_streams(*reader, *sizes); !measured)
        return fail(path, measured.error());
    if (json_path.empty()) {
        if (verbosity != command_line::Verbosity::quiet)
            print_text(path, *reader, *sizes);
        return 0;
    }
    const std::string text = to_json(path, *reader, *sizes).dump(2, ' ', false, json::error_handler_t::replace) + "\n";
    return command_line::write_json("pbm-info", json_path, text);
}

} // namespace

int main(int argc, char **argv) {
    return command_line::run_program("pbm-info", [&] { return run(argc, argv); });
}
