// Building models of files and arrays, with the options of pbm-build.
#include "files.h"
#include "model.h"
#include "pbm_scan/surface/refusal.h"

#include "pbm-build/options/options.h"
#include "pbm_build/pipeline.h"
#include "pbm_format/writing/writer.h"
#include "system/files/mapped_file.h"
#include "system/threads/cancellation.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace pbm::c_api {
namespace {

using build::BuildOptions;
using build::BuildStatistics;
using build::FieldRequest;
using build::FieldValue;
using build::Surface;

struct GivenField {
    std::string name, unit;
    std::vector<FieldValue> values;
};

// A scan of arrays.
struct ArrayScan {
    Surface surface;
    std::vector<GivenField> fields;
};

struct Builder {
    std::vector<build::OptionValue> options;
    std::vector<std::string> files;
    std::vector<ArrayScan> scans;
    pbm_report_progress report = nullptr;
    void *context = nullptr;
    const void *handle = nullptr;        // the caller's
    std::string json;                    // of the last build
    std::atomic<bool> cancelled = false; // the build that runs, or the next one
};

Handles<pbm_builder, Builder> &builders() {
    static auto &all = *new Handles<pbm_builder, Builder>; // never destroyed, as the models
    return all;
}

// Calls the caller's function, one call at a time. Cancels by an exception, except at the end of a step: this is where
// destructors report.
class ProgressRelay {
  public:
    explicit ProgressRelay(const Builder &builder) : builder_(builder) {}

    void show(std::string_view step, double done) {
        const std::lock_guard lock(mutex_);
        const bool is_end = done >= 1;
        cancelled_ = cancelled_ || builder_.cancelled;
        if (!cancelled_ && builder_.report != nullptr) {
            std::array<char, kLongestName + 1> name{}; // a destructor may not run out of memory
            std::copy_n(step.data(), std::min(step.size(), kLongestName), name.data());
            const CallbackScope scope(builder_.handle);
            cancelled_ = builder_.report(builder_.context, name.data(), done) != 0;
        }
        if (cancelled_ && !is_end)
            throw Cancelled();
    }

  private:
    static constexpr std::size_t kLongestName = 63; // of a step

    const Builder &builder_;
    std::mutex mutex_; // guards all that follows
    bool cancelled_ = false;
};

template <class To, class From> std::vector<To> vectors_of(const From *values, std::uint64_t count) {
    std::vector<To> result(static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < result.size(); ++i)
        result[i] = To(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
    return result;
}

template <class T> std::vector<T> copy_of(const T *values, std::uint64_t count) {
    return values == nullptr ? std::vector<T>() : std::vector<T>(values, values + count);
}

void keep(Surface &surface, const char *name, bool is_there) {
    if (is_there)
        surface.report.push_back({name, build::Fate::kept, ""});
}

// Faces that name a vertex twice are dropped.
Status take_faces(const pbm_arrays &arrays, Surface &surface) {
    for (std::uint64_t f = 0; f < arrays.face_count; ++f) {
        const std::uint32_t *const face = arrays.faces + 3 * f;
        for (int corner = 0; corner < 3; ++corner)
            if (face[corner] >= arrays.vertex_count)
                return usage_error("face " + std::to_string(f) + " names vertex " + std::to_string(face[corner]) +
                                   "; there are " + std::to_string(arrays.vertex_count));
        if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0])
            ++surface.dropped_triangles;
        else
            surface.triangles.emplace_back(face[0], face[1], face[2]);
    }
    if (arrays.face_count > 0 && surface.triangles.empty())
        return usage_error("no face has three different vertices");
    keep(surface, "faces", arrays.face_count > 0);
    return {};
}

Status take_materials(const pbm_arrays &arrays, Surface &surface) {
    if (arrays.materials == nullptr)
        return {};
    surface.material_ids = copy_of(arrays.materials, arrays.vertex_count);
    const std::uint8_t highest = *std::max_element(surface.material_ids.begin(), surface.material_ids.end());
    if (highest >= kMaxMaterials)
        return usage_error("a point has material " + std::to_string(highest) + "; a model has " +
                           std::to_string(kMaxMaterials) + " at most, 0 .. 7");
    surface.materials.resize(std::size_t{1} + highest);
    keep(surface, "materials", true);
    return {};
}

Status take_fields(const pbm_arrays &arrays, ArrayScan &scan) {
    if (arrays.field_count < 0 || static_cast<std::size_t>(arrays.field_count) > kMaxFields)
        return usage_error("arrays.field_count is " + std::to_string(arrays.field_count) + ", not 0 .. 8");
    if (arrays.field_count > 0 && (arrays.field_names == nullptr || arrays.field_values == nullptr))
        return usage_error("arrays.field_names or arrays.field_values is null");
    for (std::int32_t f = 0; f < arrays.field_count; ++f) {
        const char *const name = arrays.field_names[f], *const unit = arrays.field_units == nullptr
                                                                          ? nullptr
                                                                          : arrays.field_units[f];
        const double *const values = arrays.field_values[f];
        if (name == nullptr || values == nullptr)
            return usage_error("name or values of field " + std::to_string(f) + " are null");
        const Result<FieldRequest> request = build::parse_field(name);
        if (!request)
            return request.error();
        if (request->name != name)
            return usage_error("'" + std::string(name) + "' is no name of a field: leave commas and = out");
        GivenField field{.name = name, .unit = unit == nullptr ? "" : unit, .values = {}};
        for (const GivenField &other : scan.fields)
            if (other.name == field.name)
                return usage_error("two fields have the name " + field.name);
        field.values.resize(static_cast<std::size_t>(arrays.vertex_count));
        for (std::size_t i = 0; i < field.values.size(); ++i)
            if (std::isfinite(values[i]))
                field.values[i].number = values[i];
        scan.fields.push_back(std::move(field));
    }
    return {};
}

Result<ArrayScan> scan_of(const pbm_arrays &arrays) {
    if ((arrays.positions == nullptr) == (arrays.positions_f32 == nullptr))
        return usage_error("give positions or positions_f32, one of the two");
    if (arrays.vertex_count == 0 || arrays.vertex_count > build::kMaxVertices)
        return usage_error("arrays.vertex_count is " + std::to_string(arrays.vertex_count) + ", not 1 .. 2147483647");
    if (arrays.face_count > 0 && arrays.faces == nullptr)
        return usage_error("arrays.faces is null");
    const std::uint64_t count = arrays.vertex_count;
    ArrayScan scan;
    Surface &surface = scan.surface;
    surface.positions = arrays.positions != nullptr ? vectors_of<glm::dvec3>(arrays.positions, count)
                                                    : vectors_of<glm::dvec3>(arrays.positions_f32, count);
    keep(surface, "positions", true);
    if (Status taken = take_faces(arrays, surface); !taken)
        return taken.error();
    if (arrays.normals != nullptr)
        surface.normals = vectors_of<glm::vec3>(arrays.normals, count);
    for (glm::vec3 &normal : surface.normals)
        if (!build::is_finite(normal))
            normal = glm::vec3(0);
    keep(surface, "normals", arrays.normals != nullptr);
    if (arrays.colours != nullptr) {
        surface.colours.resize(static_cast<std::size_t>(count));
        std::memcpy(surface.colours.data(), arrays.colours, sizeof(Rgb8) * surface.colours.size());
    }
    keep(surface, "colours", arrays.colours != nullptr);
    surface.radii = copy_of(arrays.radii, count);
    for (float &radius : surface.radii)
        if (!(radius > 0 && std::isfinite(radius)))
            radius = 0;
    keep(surface, "radii", arrays.radii != nullptr);
    if (Status taken = take_materials(arrays, surface); !taken)
        return taken.error();
    if (Status taken = take_fields(arrays, scan); !taken)
        return taken.error();
    surface.input_bytes = surface.positions.size() * sizeof(glm::dvec3) +
                          surface.triangles.size() * sizeof(glm::uvec3) + surface.normals.size() * sizeof(glm::vec3) +
                          surface.colours.size() * sizeof(Rgb8);
    return scan;
}

// Requests of the options, then one for each further field of the arrays.
Status request_fields(std::span<const ArrayScan> scans, BuildOptions &options) {
    for (const ArrayScan &scan : scans)
        for (const GivenField &field : scan.fields)
            if (std::none_of(options.fields.begin(), options.fields.end(),
                             [&](const FieldRequest &known) { return known.name == field.name; }))
                options.fields.push_back({.name = field.name, .range = {}, .average = {}, .bits = {}});
    if (options.fields.size() > kMaxFields)
        return usage_error("the scans have " + std::to_string(options.fields.size()) +
                           " different fields, a model keeps at most 8");
    return {};
}

// Moves the fields of a scan where the pipeline looks for them.
void place_fields(ArrayScan &scan, const BuildOptions &options) {
    Surface &surface = scan.surface;
    for (GivenField &field : scan.fields) {
        surface.offered_fields.push_back(field.name);
        if (options.dropped_classes.any() && (field.name == "classification" || field.name == "class"))
            surface.field_values[kMaxFields] = field.values;
        const auto request = std::find_if(options.fields.begin(), options.fields.end(),
                                          [&](const FieldRequest &known) { return known.name == field.name; });
        const auto slot = static_cast<std::size_t>(request - options.fields.begin());
        surface.field_values[slot] = std::move(field.values);
        surface.field_units[slot] = field.unit;
    }
}

Status refuse_options_of_files(const BuildOptions &options) {
    for (const auto &[given, name] :
         {std::pair(!options.poses.empty(), "pose"), std::pair(!options.columns.empty(), "columns"),
          std::pair(options.input_format != nullptr, "input-format")})
        if (given)
            return usage_error(std::string("the option ") + name + " is of files, not of arrays");
    return {};
}

Result<Model> build_of_arrays(std::vector<ArrayScan> scans, BuildOptions &options, BuildStatistics &statistics,
                              const build::Progress &progress) {
    if (Status refused = refuse_options_of_files(options); !refused)
        return refused.error();
    if (Status requested = request_fields(scans, options); !requested)
        return requested.error();
    std::vector<Surface> surfaces;
    for (ArrayScan &scan : scans) {
        place_fields(scan, options);
        build::ReadOptions reading;
        reading.is_one_of_several = scans.size() > 1;
        reading.strict = options.strict;
        reading.keep_placeholders = options.keep_placeholders;
        reading.min_opacity = options.min_opacity;
        reading.dropped_classes = options.dropped_classes;
        Result<Surface> surface = build::finished(std::move(scan.surface), reading);
        if (!surface)
            return surface.error();
        if (scans.size() > 1)
            surface->name = "scan " + std::to_string(surfaces.size() + 1);
        build::place(*surface, options.placement);
        surfaces.push_back(std::move(*surface));
    }
    return build::build_model(std::move(surfaces), options, statistics, progress);
}

Status check_counts(const Builder &builder, const BuildOptions &options, const char *output, const void *model) {
    if (output == nullptr && model == nullptr)
        return usage_error("output and model are null: the model would be lost");
    if (output != nullptr && (*output == 0 || std::string_view(output) == "-"))
        return usage_error("output is no name of a file");
    if (builder.files.empty() == builder.scans.empty())
        return usage_error(builder.files.empty() ? "the builder has no scan: add a file or arrays"
                                                 : "the builder has files and arrays: add one of the two kinds");
    const std::size_t scans = std::max(builder.files.size(), builder.scans.size());
    if (options.viewpoints.size() > 1 && options.viewpoints.size() != scans)
        return usage_error("viewpoint is given " + std::to_string(options.viewpoints.size()) + " times for " +
                           std::to_string(scans) + " scans: give one for all, or one for each");
    return {};
}

// Writes the file, or encodes it in memory, and opens it if that is asked for.
Status hand_over(const Model &built, const BuildOptions &options, const char *output, pbm_model **model,
                 BuildStatistics &statistics, const build::Progress &progress) {
    if (output != nullptr) {
        if (const Status written = build::write(output, built, options, statistics, progress); !written)
            return of_file(output, written.error());
        if (model == nullptr)
            return {};
        return add_file(output, model);
    }
    Result<Bytes> bytes = encode_model(
        built,
        {.storage = options.storage, .compression_level = options.compression_level, .threads = options.threads});
    if (!bytes)
        return bytes.error();
    statistics.file_bytes = bytes->size();
    const auto held = std::make_shared<const Bytes>(std::move(*bytes));
    return add_model(FileBytes::held({*held, held}), model);
}

Status run_build(Builder &builder, const char *output, pbm_model **model) {
    const auto start = std::chrono::steady_clock::now();
    if (model != nullptr)
        *model = nullptr;
    Result<BuildOptions> options = build::read_options(builder.options);
    if (!options)
        return options.error();
    if (Status counted = check_counts(builder, *options, output, model); !counted)
        return counted;
    const std::vector<std::string> files = std::exchange(builder.files, {});
    std::vector<ArrayScan> scans = std::exchange(builder.scans, {});
    ProgressRelay relay(builder);
    const build::Progress progress = [&](std::string_view step, double done) { relay.show(step, done); };
    const CancellationScope scope(&builder.cancelled);
    BuildStatistics statistics;
    Result<Image> panorama = Image{};
    if (options->scene.panorama) // before the scan, so that a bad image is refused early
        panorama = build::make_panorama(*options->scene.panorama, options->threads, statistics);
    if (!panorama)
        return panorama.error();
    Result<Model> built = files.empty() ? build_of_arrays(std::move(scans), *options, statistics, progress)
                                        : build::read_and_build(files, *options, statistics, progress);
    if (!built)
        return built.error();
    built->images.panorama = std::move(*panorama);
    if (Status handed = hand_over(*built, *options, output, model, statistics, progress); !handed)
        return handed;
    statistics.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    builder.json = build::to_json(statistics, files, output == nullptr ? "" : output);
    return {};
}

// Calls `work` with the builder, for functions of the API.
template <class Work> pbm_code with_builder(pbm_builder *builder, pbm_error *error, const Work &work) {
    return guarded(error, [&] { return builders().use(builder, "builder", work); });
}

} // namespace
} // namespace pbm::c_api

using namespace pbm;
using namespace pbm::c_api;

pbm_code pbm_new_builder(pbm_builder **builder, pbm_error *error) {
    return guarded(error, [&]() -> Status {
        if (builder == nullptr)
            return usage_error("builder is null");
        *builder = nullptr;
        auto made = std::make_unique<Builder>();
        Builder &opened = *made;
        *builder = builders().add(std::move(made));
        opened.handle = *builder;
        return {};
    });
}

pbm_code pbm_free_builder(pbm_builder *builder) {
    return guarded(nullptr, [&] { return builders().remove(builder, "builder"); });
}

pbm_code pbm_set_option(pbm_builder *builder, const char *key, const char *value, pbm_error *error) {
    return with_builder(builder, error, [&](Builder &open) -> Status {
        if (key == nullptr)
            return usage_error("key is null");
        open.options.push_back({key, value == nullptr ? std::nullopt : std::optional<std::string>(value)});
        return {};
    });
}

pbm_code pbm_set_progress(pbm_builder *builder, pbm_report_progress report, void *context, pbm_error *error) {
    return with_builder(builder, error, [&](Builder &open) -> Status {
        open.report = report;
        open.context = context;
        return {};
    });
}

pbm_code pbm_add_file(pbm_builder *builder, const char *path, pbm_error *error) {
    return with_builder(builder, error, [&](Builder &open) -> Status {
        if (path == nullptr)
            return usage_error("path is null");
        if (*path == 0 || is_stream(path))
            return usage_error("path is no name of a file");
        open.files.emplace_back(path);
        return {};
    });
}

pbm_code pbm_add_arrays(pbm_builder *builder, const pbm_arrays *arrays, pbm_error *error) {
    return with_builder(builder, error, [&](Builder &open) -> Status {
        const Result<pbm_arrays> given = read_structure(arrays, "arrays");
        if (!given)
            return given.error();
        Result<ArrayScan> scan = scan_of(*given);
        if (!scan)
            return scan.error();
        open.scans.push_back(std::move(*scan));
        return {};
    });
}

pbm_code pbm_build(pbm_builder *builder, const char *output, pbm_model **model, pbm_error *error) {
    return with_builder(builder, error, [&](Builder &open) {
        struct Reset {
            std::atomic<bool> &flag;
            ~Reset() { flag = false; }
        } const reset{open.cancelled};
        return run_build(open, output, model);
    });
}

pbm_code pbm_cancel_build(pbm_builder *builder) {
    return guarded(nullptr, [&] {
        return builders().notify(builder, "builder", [](Builder &running) { running.cancelled = true; });
    });
}

pbm_code pbm_get_report(pbm_builder *builder, const char **json, pbm_error *error) {
    return with_builder(builder, error, [&](Builder &open) -> Status {
        if (json == nullptr)
            return usage_error("json is null");
        if (open.json.empty())
            return usage_error("the builder has built nothing yet");
        *json = open.json.c_str();
        return {};
    });
}
