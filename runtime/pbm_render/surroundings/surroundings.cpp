#include "pbm_render/surroundings/surroundings.h"

#include "pbm_render/appearance/appearance.h"
#include "pbm_render/appearance/shade_table.h"
#include "pbm_render/surroundings/surroundings_view.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pbm_render/surroundings/surroundings.cpp"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "pbm_render/picture/lane_vectors.h"

HWY_BEFORE_NAMESPACE();
namespace pbm::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Finds the blocks with a pixel that neither object nor ground hides, the border of the ground included: its depths may
// be those of the ground, but only there is coverage between 0 and 1.
void find_free(const float *depths, const float *coverage, std::size_t blocks, std::uint8_t *wanted) {
    const Floats d;
    const Vector infinity = hn::Set(d, std::numeric_limits<float>::infinity()), one = hn::Set(d, 1.0F);
    for (std::size_t block = 0; block < blocks; ++block) {
        bool any = false;
        for (std::size_t x = block * kRayBlock; x < (block + 1) * kRayBlock; x += hn::Lanes(d)) {
            const Vector ground = hn::LoadU(d, coverage + x);
            const Mask shows = hn::Or(hn::Eq(hn::LoadU(d, depths + x), infinity), hn::Gt(ground, hn::Zero(d)));
            any |= !hn::AllFalse(d, hn::And(shows, hn::Lt(ground, one)));
        }
        wanted[block] = static_cast<std::uint8_t>(any);
    }
}

// The same for all pixels of a row that is packed.
struct RowLook {
    const SurroundingsRow &row;
    bool all_free; // pixels without object and ground are written too
};

// Packs a whole vector of a row's pixels from `x` on.
HWY_INLINE void pack_vector(const RowLook &look, std::size_t x, float scale, std::int32_t *colours, float *depths) {
    const auto &[row, all_free] = look;
    const Floats d;
    const Ints di;
    const Vector old_depth = hn::LoadU(d, depths), coverage = hn::LoadU(d, row.coverage.data() + x);
    const auto grounded = hn::Gt(coverage, hn::Zero(d));
    const auto free = hn::Eq(old_depth, hn::Set(d, std::numeric_limits<float>::infinity()));
    const auto write = all_free ? hn::Or(grounded, free) : grounded;
    if (hn::AllFalse(d, write))
        return;
    const IntVector red = srgb_bytes(hn::LoadU(d, row.red.data() + x));
    const IntVector green = srgb_bytes(hn::LoadU(d, row.green.data() + x));
    const IntVector blue = srgb_bytes(hn::LoadU(d, row.blue.data() + x));
    const Vector opacity = hn::Mul(hn::LoadU(d, row.alpha.data() + x), hn::Set(d, 255.0F));
    const IntVector alpha = hn::ConvertTo(di, hn::Add(opacity, hn::Set(d, 0.5F)));
    const IntVector packed =
        hn::Or(hn::Or(red, hn::ShiftLeft<8>(green)), hn::Or(hn::ShiftLeft<16>(blue), hn::ShiftLeft<24>(alpha)));
    hn::StoreU(hn::IfThenElse(hn::RebindMask(di, write), packed, hn::LoadU(di, colours)), di, colours);
    const auto near = hn::Ge(coverage, hn::Set(d, 0.5F));
    const Vector depth = hn::Mul(hn::LoadU(d, row.depth.data() + x), hn::Set(d, scale));
    hn::StoreU(hn::IfThenElse(near, depth, old_depth), d, depths);
}

void pack_row(const SurroundingsRow &row, bool all_free, const PixelRow &to) {
    const RowLook look{row, all_free};
    const auto [colours, depths, width, scale] = to;
    auto *const words = reinterpret_cast<std::int32_t *>(colours);
    const std::size_t lanes = hn::Lanes(Floats());
    std::size_t x = 0;
    for (; x + lanes <= width; x += lanes)
        pack_vector(look, x, scale, words + x, depths + x);
    if (x == width)
        return;
    std::array<std::int32_t, kLaneNumbers.size()> last_words{};
    std::array<float, kLaneNumbers.size()> last_depths{};
    std::memcpy(last_words.data(), words + x, (width - x) * sizeof *words);
    std::memcpy(last_depths.data(), depths + x, (width - x) * sizeof *depths);
    pack_vector(look, x, scale, last_words.data(), last_depths.data());
    std::memcpy(words + x, last_words.data(), (width - x) * sizeof *words);
    std::memcpy(depths + x, last_depths.data(), (width - x) * sizeof *depths);
}

} // namespace pbm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace pbm {
namespace {

HWY_EXPORT(find_free);
HWY_EXPORT(pack_row);

const ColourTable &colour_table() {
    static const ColourTable kTable;
    return kTable;
}

} // namespace

Surroundings::Surroundings(const ModelParameters &parameters, TiledImages images)
    : parameters_(parameters), images_(std::move(images)) {
    if (images_.panorama)
        panorama_ = std::make_unique<PanoramaSampler>(images_.panorama, parameters_.grid.up);
    if (parameters_.ground)
        ground_ = std::make_unique<GroundSampler>(parameters_, images_);
}

Surroundings::~Surroundings() = default;

std::unique_ptr<const FrameSurroundings>
Surroundings::in_frame(const Appearance &appearance, const Projection &projection, const RenderOptions &options) const {
    return std::make_unique<SurroundingsView>(this, appearance, projection, options);
}

std::vector<Error> Surroundings::take_errors() const {
    std::vector<Error> errors;
    images_.for_each([&](const TiledImage &image) {
        for (Error &error : image.take_errors())
            errors.push_back(std::move(error));
    });
    return errors;
}

std::vector<FileRange> Surroundings::take_wanted() const {
    std::vector<FileRange> wanted;
    images_.for_each([&](const TiledImage &image) {
        for (const FileRange &range : image.take_wanted())
            wanted.push_back(range);
    });
    if (panorama_)
        panorama_->retry();
    if (ground_)
        ground_->retry();
    return wanted;
}

void SurroundingsRow::resize(std::size_t pixels) {
    const std::size_t blocks = (pixels + kRayBlock - 1) / kRayBlock;
    for (std::vector<float> *const floats :
         {&red, &green, &blue, &alpha, &depth, &coverage, &mirrored_red, &mirrored_green, &mirrored_blue})
        floats->resize((blocks + 1) * kRayBlock);
    wanted.resize(blocks);
    wanted_ground.resize(blocks);
}

SurroundingsView::SurroundingsView(const Surroundings *surroundings, const Appearance &appearance,
                                   const Projection &projection, const RenderOptions &options)
    : projection_(projection), options_(options) {
    if (surroundings == nullptr)
        return;
    if (surroundings->panorama_ && options.panorama)
        panorama_ = surroundings->panorama_.get();
    if (surroundings->panorama_ && options.reflections)
        mirrored_ = surroundings->panorama_.get();
    if (surroundings->ground_ && options.ground) {
        ground_frame_ = surroundings->ground_->frame(appearance, projection, options.shadows, options.texture);
        if (ground_frame_.is_seen)
            ground_ = surroundings->ground_.get();
        ground_frame_.mirror = mirrored_ != nullptr ? ground_frame_.material.environment : 0;
    }
}

RayRow SurroundingsView::rays(glm::dvec2 first, std::size_t count) const {
    const glm::dvec3 ray = projection_.ray(first);
    return {.first = ray,
            .step = projection_.ray(first + glm::dvec2(1, 0)) - ray,
            .pixel_angle = static_cast<float>(1 / projection_.focal),
            .count = count};
}

// Looks at panorama or background where neither object nor ground hides them. `y`: of the row.
void SurroundingsView::sample_background(const RayRow &rays, double y, SurroundingsRow &row) const {
    if (panorama_ != nullptr) {
        std::fill(row.alpha.begin(), row.alpha.end(), 1.0F);
        panorama_->sample_row(rays, row.wanted.data(), {row.red.data(), row.green.data(), row.blue.data()});
        return;
    }
    const Rgba8 background = background_at(options_, std::clamp(y / (2 * projection_.middle.y), 0.0, 1.0));
    const Float4 linear = colour_table().linear(pack_rgba(background));
    std::fill(row.red.begin(), row.red.end(), linear[0]);
    std::fill(row.green.begin(), row.green.end(), linear[1]);
    std::fill(row.blue.begin(), row.blue.end(), linear[2]);
    std::fill(row.alpha.begin(), row.alpha.end(), static_cast<float>(background[3]) / 255.0F);
}

GroundRow SurroundingsView::ground_row(glm::dvec2 first, std::size_t count) const {
    return ground_ == nullptr ? GroundRow{} : GroundSampler::row(ground_frame_, projection_, first, count);
}

void SurroundingsView::look(glm::dvec2 first, std::size_t count, const float *object_depths,
                            SurroundingsRow &row) const {
    look(first, count, object_depths, ground_row(first, count), row);
}

void SurroundingsView::look(glm::dvec2 first, std::size_t count, const float *object_depths, const GroundRow &ground,
                            SurroundingsRow &row) const {
    row.resize(count);
    const std::size_t blocks = row.wanted.size();
    std::copy_n(object_depths, count, row.depth.begin());
    std::fill(row.depth.begin() + static_cast<std::ptrdiff_t>(count), row.depth.end(), 0.0F); // no ray passes there
    std::fill(row.coverage.begin(), row.coverage.end(), 0.0F);
    const GroundPixels pixels{.object_depths = row.depth.data(),
                              .coverage = row.coverage.data(),
                              .depths = row.depth.data(),
                              .red = row.red.data(),
                              .green = row.green.data(),
                              .blue = row.blue.data(),
                              .alpha = row.alpha.data(),
                              .mirrored_red = row.mirrored_red.data(),
                              .mirrored_green = row.mirrored_green.data(),
                              .mirrored_blue = row.mirrored_blue.data()};
    if (ground_ != nullptr) {
        std::fill(row.wanted_ground.begin(), row.wanted_ground.end(), std::uint8_t{0});
        GroundSampler::find_covered(ground_frame_, ground, pixels, row.wanted_ground.data());
    }
    const RayRow seen = rays(first, count);
    if (panorama_ != nullptr)
        HWY_DYNAMIC_DISPATCH(find_free)(row.depth.data(), row.coverage.data(), blocks, row.wanted.data());
    sample_background(seen, first.y, row);
    if (ground.begin == ground.end)
        return;
    if (ground_frame_.mirror > 0) {
        RayRow mirrored = seen;
        const auto up = glm::vec3(up_direction(ground_->up()));
        mirrored.first -= 2 * glm::dot(mirrored.first, up) * up;
        mirrored.step -= 2 * glm::dot(mirrored.step, up) * up;
        mirrored_->sample_row(mirrored, row.wanted_ground.data(),
                              {row.mirrored_red.data(), row.mirrored_green.data(), row.mirrored_blue.data()});
    }
    ground_->shade(ground_frame_, ground, row.wanted_ground.data(), pixels);
}

void SurroundingsView::draw_row(int y, const PixelRow &row, SurroundingsRow &scratch) const {
    const glm::dvec2 first(0.5, y + 0.5);
    const GroundRow ground = ground_row(first, row.width);
    if (panorama_ == nullptr && ground.begin == ground.end)
        return;
    std::vector<float> &object_depths = scratch.object_depths;
    object_depths.resize(row.width);
    const float scale = 1 / row.depth_scale;
    for (std::size_t x = 0; x < row.width; ++x)
        object_depths[x] = row.depths[x] * scale;
    look(first, row.width, object_depths.data(), ground, scratch);
    HWY_DYNAMIC_DISPATCH(pack_row)(scratch, panorama_ != nullptr, row);
}

void SurroundingsView::draw_behind(Framebuffer &target, float edge) const {
    SurroundingsRow scratch;
    const auto width = static_cast<std::size_t>(target.width);
    for (int y = 0; y < target.height; ++y) {
        const std::size_t row = static_cast<std::size_t>(y) * width;
        draw_row(y, {target.colour.data() + row, target.depth.data() + row, width, edge}, scratch);
    }
}

} // namespace pbm
#endif // HWY_ONCE
