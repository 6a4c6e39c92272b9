// Law: the C API opens, describes, reads, validates and draws arbitrary bytes without a crash, from memory and through
// a callback alike; a valid file opens, has all its points, and gives the same picture both ways.
// Input: the bytes of a file.
#include <pbm/pbm.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

namespace {

constexpr int kWidth = 24, kHeight = 16;
constexpr std::uint64_t kMaxPoints = std::uint64_t{1} << 18;

void require(bool law) {
    if (!law)
        std::abort();
}

struct File {
    const std::uint8_t *data;
    std::uint64_t size;

    static int read(void *context, std::uint64_t offset, std::uint64_t size, void *to) {
        const auto &file = *static_cast<const File *>(context);
        require(offset <= file.size && size <= file.size - offset);
        std::memcpy(to, file.data + offset, static_cast<std::size_t>(size));
        return 0;
    }
};

struct Pixels {
    std::array<std::uint8_t, std::size_t{4} * kWidth * kHeight> colours{};
    std::array<float, std::size_t{kWidth} * kHeight> depths{};
};

// Reads the points of a level into arrays of exactly their size. Returns whether all is well.
bool read_level(pbm_model *model, int level) {
    std::uint64_t count = 0;
    if (pbm_count_points(model, level, &count, nullptr) != PBM_OK || count > kMaxPoints)
        return false;
    const auto n = static_cast<std::size_t>(count);
    pbm_info info = PBM_NEW(pbm_info);
    std::vector<double> positions(3 * n);
    std::vector<float> normals(3 * n), radii(n);
    std::vector<std::uint8_t> colours(3 * n), materials(n);
    std::vector<std::vector<float>> values;
    std::vector<float *> fields;
    if (pbm_get_info(model, &info, nullptr) == PBM_OK)
        values.resize(static_cast<std::size_t>(info.fields), std::vector<float>(n));
    fields.reserve(values.size());
    for (std::vector<float> &field : values)
        fields.push_back(field.data());
    pbm_points to = PBM_NEW(pbm_points);
    to.capacity = count;
    to.positions = positions.data();
    to.normals = normals.data();
    to.radii = radii.data();
    to.colours = colours.data();
    to.materials = materials.data();
    to.fields = fields.data();
    to.field_count = static_cast<std::int32_t>(fields.size());
    to.threads = 1;
    return pbm_read_points(model, level, &to, nullptr, nullptr) == PBM_OK;
}

// The same of the sides of a level.
bool read_sides(pbm_model *model, int level) {
    std::uint64_t count = 0;
    if (pbm_count_sides(model, level, &count, nullptr) != PBM_OK || count > kMaxPoints)
        return false;
    const auto n = static_cast<std::size_t>(count);
    std::vector<std::uint64_t> points(n);
    std::vector<float> normals(6 * n);
    std::vector<std::uint8_t> colours(6 * n), materials(2 * n);
    pbm_sides to = PBM_NEW(pbm_sides);
    to.capacity = count;
    to.points = points.data();
    to.normals = normals.data();
    to.colours = colours.data();
    to.materials = materials.data();
    return pbm_read_sides(model, level, &to, nullptr, nullptr) == PBM_OK;
}

bool draw(pbm_model *model, Pixels &to) {
    pbm_camera camera = PBM_NEW(pbm_camera);
    pbm_render_options options = PBM_NEW(pbm_render_options);
    options.threads = 1;
    pbm_picture picture = PBM_NEW(pbm_picture);
    picture.width = kWidth;
    picture.height = kHeight;
    picture.pixels = to.colours.data();
    picture.pixel_bytes = to.colours.size();
    picture.depths = to.depths.data();
    picture.depth_count = to.depths.size();
    return pbm_default_camera(model, kWidth, kHeight, &camera, nullptr) == PBM_OK &&
           pbm_render(model, &camera, &options, &picture, nullptr) == PBM_OK;
}

// Uses the model. Returns whether every call succeeded.
bool use(pbm_model *model, Pixels &to) {
    pbm_info info = PBM_NEW(pbm_info);
    pbm_field field = PBM_NEW(pbm_field);
    bool good = pbm_get_info(model, &info, nullptr) == PBM_OK;
    for (std::int32_t f = 0; good && f < info.fields; ++f)
        good = pbm_get_field(model, f, &field, nullptr) == PBM_OK;
    good = draw(model, to) && good;
    for (const int level : {0, 2, good ? info.depth : 1})
        good = read_level(model, level) && read_sides(model, level) && good;
    return good;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
    File file{data, size};
    pbm_error error;
    pbm_validation validation = PBM_NEW(pbm_validation);
    validation.threads = 1;
    validation.level = PBM_VALIDATE_DEEP;
    const std::uint8_t nothing = 0;
    const std::uint8_t *const bytes = size == 0 ? &nothing : data;
    require(pbm_validate_memory(bytes, size, &validation, &error) == PBM_OK);
    pbm_model *whole = nullptr, *ranged = nullptr;
    const pbm_code opened = pbm_open_memory(bytes, size, &whole, &error);
    require(opened == PBM_OK || (whole == nullptr && error.code == opened && error.message[0] != 0));
    require(pbm_open_ranges(File::read, &file, size, &ranged, nullptr) == opened);
    Pixels first, second;
    const bool good = opened == PBM_OK && use(whole, first);
    const bool as_good = opened == PBM_OK && use(ranged, second);
    if (validation.verdict == PBM_OK && validation.points <= kMaxPoints) {
        require(good && as_good);
        require(first.colours == second.colours && first.depths == second.depths);
    }
    require(pbm_close(whole) == PBM_OK && pbm_close(ranged) == PBM_OK);
    return 0;
}
