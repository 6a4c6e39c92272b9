#include "pbm_build/grid/grid_choice.h"

#include "pbm_build/lattice/lattice.h"
#include "pbm_build/lattice/radix_sort.h"
#include "pbm_build/surface/face_normal.h"
#include "pbm_format/reading/reader.h"
#include "pbm_scan/surface/refusal.h"
#include "pbm_scan/text/printable.h"
#include "system/files/mapped_file.h"
#include "system/threads/parallel.h"
#include "system/threads/thread_pool.h"

#include <glm/common.hpp>
#include <glm/trigonometric.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

namespace pbm::build {
namespace {

constexpr double kMargin = 0x1p-20; // of the extent, on both sides together
constexpr std::size_t kBlock = 65536;

void widen(Bounds &bounds, const glm::dvec3 &p) {
    bounds.lowest = glm::min(bounds.lowest, p);
    bounds.highest = glm::max(bounds.highest, p);
}

std::string number(double value) { return formatted("%.3g", value); }

// Minimum voxel edge over the farthest coordinate: a voxel spans at least 64 doubles.
constexpr double kMinVoxel = 0x1p-46;

// Histogram of squared lengths: the class is the sign, the exponent and the six highest fraction bits of the double.
constexpr int kLengthShift = 46;
constexpr std::size_t kLengthClasses = std::size_t{1} << (63 - kLengthShift);

std::size_t length_class(double squared) {
    return static_cast<std::size_t>(std::bit_cast<std::uint64_t>(squared) >> kLengthShift);
}

double middle_of_class(std::size_t index) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(index) << kLengthShift | std::uint64_t{1}
                                                                                         << (kLengthShift - 1));
}

} // namespace

double Bounds::extent() const { return std::max({highest.x - lowest.x, highest.y - lowest.y, highest.z - lowest.z}); }

double farthest_coordinate(const Bounds &bounds) {
    const glm::dvec3 farthest = glm::max(glm::abs(bounds.lowest), glm::abs(bounds.highest));
    return std::max({farthest.x, farthest.y, farthest.z});
}

Bounds bounds_of(std::span<const glm::dvec3> positions) {
    Bounds bounds{positions.front(), positions.front()};
    for (const glm::dvec3 &p : positions)
        widen(bounds, p);
    return bounds;
}

Bounds bounds_of(const Surface &surface) {
    const glm::dvec3 first =
        surface.triangles.empty() ? surface.positions.front() : surface.positions[surface.triangles.front().x];
    Bounds bounds{first, first};
    for (const glm::uvec3 &t : surface.triangles)
        for (int corner = 0; corner < 3; ++corner)
            widen(bounds, surface.positions[t[corner]]);
    for (std::size_t i = surface.first_point(); i < surface.positions.size(); ++i)
        widen(bounds, surface.positions[i]);
    return bounds;
}

Status check_bounds(const Bounds &bounds) {
    const double extent = bounds.extent();
    const double farthest = farthest_coordinate(bounds);
    if (!(farthest <= 1e30))
        return too_large("coordinates reach " + number(farthest) + ", the limit is 1e30: scale the scan down");
    if (extent > 0 && extent < 1e-30)
        return too_large("the scan is only " + number(extent) + " units long, the limit is 1e-30: scale the scan up");
    return {};
}

Grid centred_grid(const Bounds &bounds, int depth) {
    const glm::dvec3 centre = bounds.lowest / 2.0 + bounds.highest / 2.0;
    const double farthest = farthest_coordinate({centre, centre});
    double edge = bounds.extent() * (1 + kMargin);
    if (!(edge > 0))
        edge = 1;
    edge = std::max(edge, std::ldexp(farthest * kMinVoxel, kMaxDepth));
    Grid grid{.depth = depth, .origin = {}, .voxel_size = std::ldexp(edge, -depth)};
    for (int axis = 0; axis < 3; ++axis)
        grid.origin[static_cast<std::size_t>(axis)] = centre[axis] - edge / 2;
    return grid;
}

Result<Grid> snapped_grid(const Bounds &bounds, double voxel_size) {
    if (!std::isnormal(voxel_size) || !std::isfinite(std::ldexp(voxel_size, kMaxDepth)))
        return usage_error("a voxel size of " + number(voxel_size) + " is out of range");
    const double farthest = farthest_coordinate(bounds);
    if (voxel_size < farthest * kMinVoxel)
        return usage_error("a voxel size of " + number(voxel_size) + " is finer than coordinates of " +
                           number(farthest) + " can be; use at least " + number(farthest * kMinVoxel));
    for (int depth = kMinBuildDepth; depth <= kMaxDepth; ++depth) {
        Grid grid{.depth = depth, .origin = {}, .voxel_size = voxel_size};
        bool holds = true;
        for (int axis = 0; axis < 3; ++axis) {
            const double low = bounds.lowest[axis], high = bounds.highest[axis];
            const double corner = std::floor(((low / 2 + high / 2) - grid.edge() / 2) / voxel_size) * voxel_size;
            grid.origin[static_cast<std::size_t>(axis)] = corner;
            holds = holds && low >= corner && high < corner + grid.edge();
        }
        if (holds)
            return grid;
    }
    const double least = bounds.extent() / static_cast<double>((1 << kMaxDepth) - 2);
    return usage_error("a voxel size of " + number(voxel_size) + " needs more than " + std::to_string(kMaxDepth) +
                       " levels; use at least " + number(least));
}

Result<Grid> read_grid(const std::string &path) {
    const Result<MappedFile> file = MappedFile::open(path);
    if (!file)
        return file.error();
    const Result<Reader> reader = Reader::open(file->bytes());
    if (!reader)
        return reader.error();
    return reader->parameters().grid;
}

double median_edge(const Surface &surface, int threads) {
    ThreadPool pool(resolve_threads(threads));
    std::vector<std::vector<std::uint32_t>> counts(static_cast<std::size_t>(pool.threads()),
                                                   std::vector<std::uint32_t>(kLengthClasses));
    pool.run((surface.triangles.size() + kBlock - 1) / kBlock, [&](std::size_t block, std::size_t thread) {
        for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, surface.triangles.size()); ++i) {
            const glm::uvec3 &t = surface.triangles[i];
            for (int corner = 0; corner < 3; ++corner) {
                const glm::dvec3 edge = surface.positions[t[corner]] - surface.positions[t[(corner + 1) % 3]];
                ++counts[thread][length_class(glm::dot(edge, edge))];
            }
        }
    });
    std::uint64_t edges = 0;
    for (std::size_t length = 1; length < kLengthClasses; ++length) // class 0: zero length
        for (const auto &count : counts)
            edges += count[length];
    std::uint64_t seen = 0;
    for (std::size_t length = 1; length < kLengthClasses; ++length) {
        for (const auto &count : counts)
            seen += count[length];
        if (2 * seen >= edges && seen > 0)
            return std::sqrt(middle_of_class(length));
    }
    return 0;
}

int mesh_depth(const Bounds &bounds, double median_edge) {
    int depth = kMinMeshDepth;
    // The voxel edge halves from depth to depth: the closest by ratio is the first one <= sqrt(2) x median.
    while (depth < kMaxMeshDepth && std::ldexp(bounds.extent(), -depth) > median_edge * 1.4142135623730951)
        ++depth;
    return depth;
}

std::vector<std::uint64_t> occupied_voxels(const Surface &surface, const Bounds &bounds, int threads) {
    const std::span<const glm::dvec3> points = std::span(surface.positions).subspan(surface.first_point());
    const Lattice lattice(centred_grid(bounds, kMaxDepth));
    std::vector<MortonCode> codes(points.size());
    parallel_for(codes.size(), kBlock, threads,
                 [&](std::size_t i) { codes[i] = code_of(voxel_of(lattice(points[i]))); });
    std::vector<MortonCode> spare;
    radix_sort(codes, spare, 0, 3 * kMaxDepth);

    std::vector<std::uint64_t> occupied(kMaxDepth + 1, 0);
    occupied[0] = 1;
    for (std::size_t i = 1; i < codes.size(); ++i) {
        const MortonCode difference = codes[i] ^ codes[i - 1];
        if (difference != 0) // one more voxel on the first level whose prefixes differ, and on all below it
            ++occupied[static_cast<std::size_t>(kMaxDepth - (std::bit_width(difference) - 1) / 3)];
    }
    for (std::size_t level = 1; level < occupied.size(); ++level)
        occupied[level] += occupied[level - 1];
    return occupied;
}

int point_depth(const std::vector<std::uint64_t> &occupied) {
    int depth = kMaxPointDepth;
    while (depth > kMinPointDepth &&
           6 * occupied[static_cast<std::size_t>(depth)] < 11 * occupied[static_cast<std::size_t>(depth) - 1])
        --depth;
    return depth;
}

namespace {

// Sum of value(number of the triangle) over all triangles, each rounded to 2^-44; values are less than 2^19. It does
// not depend on the order of the triangles.
template <class Value> double sum_over_triangles(const Surface &surface, int threads, const Value &value) {
    // The sum may need 75 bits: the low 32 bits of each value and the rest are summed separately.
    constexpr double kScale = 0x1p44;
    std::atomic<std::uint64_t> high{0}, low{0};
    parallel_blocks(surface.triangles.size(), kBlock, threads, [&](std::size_t begin, std::size_t end) {
        std::uint64_t high_sum = 0, low_sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const auto rounded = static_cast<std::uint64_t>(value(i) * kScale + 0.5);
            high_sum += rounded >> 32;
            low_sum += rounded & 0xFFFFFFFF;
        }
        high += high_sum;
        low += low_sum;
    });
    return (static_cast<double>(high.load()) * 0x1p32 + static_cast<double>(low.load())) / kScale;
}

double area_of(const Surface &surface, std::size_t triangle) {
    const glm::uvec3 &t = surface.triangles[triangle];
    const glm::dvec3 n = face_normal(surface.positions[t.x], surface.positions[t.y], surface.positions[t.z]);
    return glm::length(n) / 2;
}

// Squared length of a - b, as vectors of length 1; 0 where one of them is missing.
double squared_chord(const ShortNormal &a, const ShortNormal &b) {
    if (is_zero(a) || is_zero(b))
        return 0;
    const double cosine = static_cast<double>(dot(a, b)) / (kNormalScale * kNormalScale);
    return std::max(0.0, 2 - 2 * cosine);
}

} // namespace

double relative_area(const Surface &surface, const Bounds &bounds, int threads) {
    const double edge = centred_grid(bounds, kMinDepth).edge();
    return sum_over_triangles(surface, threads, [&](std::size_t i) { return area_of(surface, i) / edge / edge; });
}

namespace {

// How much something changes along an edge of a triangle within one voxel, squared: the mean over its edges.
// `difference(from, to)`: the squared difference between two vertices.
template <class Difference>
double squared_change_on(const Surface &surface, std::size_t triangle, double voxel_size,
                         const Difference &difference) {
    const glm::uvec3 &t = surface.triangles[triangle];
    double squared = 0;
    for (int corner = 0; corner < 3; ++corner) {
        const std::uint32_t from = t[corner], to = t[(corner + 1) % 3];
        const double length = glm::length(surface.positions[from] - surface.positions[to]);
        const double part = length > voxel_size ? voxel_size / length : 1;
        squared += difference(from, to) * part * part / 3;
    }
    return squared;
}

// Mean of squared_change(number of the triangle), at most 3, over the area.
template <class Change>
double mean_over_area(const Surface &surface, const Bounds &bounds, int threads, const Change &squared_change) {
    const double edge = centred_grid(bounds, kMinDepth).edge();
    const double area = relative_area(surface, bounds, threads);
    const double sum = sum_over_triangles(
        surface, threads, [&](std::size_t i) { return area_of(surface, i) / edge / edge * squared_change(i); });
    return area > 0 ? sum / area : 0;
}

// Of sRGB channels, 0..1.
double squared_difference(const Rgb8 &a, const Rgb8 &b) {
    double sum = 0;
    for (std::size_t channel = 0; channel < 3; ++channel) {
        const double step = (static_cast<double>(a[channel]) - static_cast<double>(b[channel])) / 255;
        sum += step * step;
    }
    return sum;
}

} // namespace

double normal_change(const Surface &surface, const Bounds &bounds, std::span<const ShortNormal> normals,
                     double voxel_size, int threads) {
    const auto difference = [&](std::uint32_t from, std::uint32_t to) {
        return squared_chord(normals[from], normals[to]);
    };
    const double squared = mean_over_area(
        surface, bounds, threads, [&](std::size_t i) { return squared_change_on(surface, i, voxel_size, difference); });
    return 2 * std::asin(std::min(1.0, std::sqrt(squared) / 2));
}

double colour_change(const Surface &surface, const Bounds &bounds, double voxel_size, int threads) {
    const std::vector<Rgb8> &colours = surface.colours;
    if (colours.empty())
        return 0;
    const auto difference = [&](std::uint32_t from, std::uint32_t to) {
        return squared_difference(colours[from], colours[to]);
    };
    return std::sqrt(mean_over_area(surface, bounds, threads, [&](std::size_t i) {
        return squared_change_on(surface, i, voxel_size, difference);
    }));
}

namespace {

// Of the part of an image that is on a triangle.
double texels_on(const Texture &image, const TextureCorners &at) {
    constexpr double kMax = 0x1p30;
    const glm::dvec2 u(at[1] - at[0]), v(at[2] - at[0]);
    const double size = static_cast<double>(image.width) * static_cast<double>(image.height);
    return std::min(kMax, std::abs(u.x * v.y - u.y * v.x) / 2 * size);
}

} // namespace

double texels_per_voxel(const Surface &surface, const Bounds &bounds, double voxel_size, int threads) {
    if (surface.texture_ids.empty())
        return 0;
    const double edge = centred_grid(bounds, kMinDepth).edge();
    const auto has_image = [&](std::size_t i) { return surface.texture_ids[i] != Surface::kNoTexture; };
    const double area = sum_over_triangles(
        surface, threads, [&](std::size_t i) { return has_image(i) ? area_of(surface, i) / edge / edge : 0; });
    constexpr double kUnit = 0x1p12; // sum_over_triangles takes values below 2^19
    const double texels =
        kUnit * sum_over_triangles(surface, threads, [&](std::size_t i) {
            return has_image(i)
                       ? texels_on(surface.textures[surface.texture_ids[i]], surface.texture_corners[i]) / kUnit
                       : 0.0;
        });
    return area > 0 ? texels * (voxel_size / edge) * (voxel_size / edge) / area : 0;
}

double relief_change(const Surface &surface, std::span<const Relief> reliefs, const Bounds &bounds, double voxel_size,
                     int threads) {
    const ImageLayer &layer = surface.layer(Layer::normals);
    if (reliefs.empty())
        return 0;
    const double edge = centred_grid(bounds, kMinDepth).edge();
    const auto relative_area_of = [&](std::size_t i) {
        return layer.ids[i] == Surface::kNoTexture ? 0 : area_of(surface, i) / edge / edge;
    };
    const double area = sum_over_triangles(surface, threads, relative_area_of);
    const double sum = sum_over_triangles(surface, threads, [&](std::size_t i) {
        const double of_triangle = relative_area_of(i);
        if (!(of_triangle > 0))
            return 0.0;
        const double texels = texels_on(surface.textures[layer.ids[i]], layer.corners[i]);
        const double per_voxel = std::sqrt(texels / of_triangle) * voxel_size / edge;
        return of_triangle * squared_change(reliefs[layer.ids[i]], per_voxel);
    });
    return area > 0 ? 2 * std::asin(std::min(1.0, std::sqrt(sum / area) / 2)) : 0;
}

double screen_voxel(const Bounds &bounds, UpAxis up, int depth) {
    const glm::dvec3 size = bounds.highest - bounds.lowest;
    const int upwards = up == UpAxis::x ? 0 : up == UpAxis::y ? 1 : 2;
    const double height = size[upwards], across = std::max(size[(upwards + 1) % 3], size[(upwards + 2) % 3]);
    const double edge = bounds.extent();
    const double pixels = std::min(across > 0 ? kScreenWidth * edge / across : kScreenWidth,
                                   height > 0 ? kScreenHeight * edge / height : kScreenWidth);
    constexpr double kFramed = 0.95; // part of the picture that a first view fills
    return std::ldexp(kFramed * pixels, -depth);
}

double estimated_bytes(double relative_area, double normal_change, double colour_change, int depth) {
    // Bytes per voxel. However little colours change, they are rounded to other numbers in many voxels.
    constexpr double kVoxelsPerArea = 1.5, kPlain = 0.1, kOfChange = 2.8, kColoured = 0.5, kOfColour = 2,
                     kMostOfColour = 1;
    const double of_colour =
        colour_change > 0 ? std::min(kColoured + kOfColour * std::sqrt(colour_change), kMostOfColour) : 0;
    const double per_voxel = kPlain + kOfChange * std::sqrt(normal_change) + of_colour;
    return std::ldexp(kVoxelsPerArea * relative_area, 2 * depth) * per_voxel;
}

namespace {

// The finest depth at which the lower bound of the voxels is within max_points: a surface of area A has at least about
// A / voxel^2 voxels.
int finest_depth(const Surface &surface, const Bounds &bounds, std::uint64_t max_points, int threads) {
    int depth = kMaxDepth;
    const double area = relative_area(surface, bounds, threads);
    const auto occupied = occupied_voxels(surface, bounds, threads);
    const auto least = [&] {
        return std::max(std::ldexp(area, 2 * depth), static_cast<double>(occupied[static_cast<std::size_t>(depth)]));
    };
    while (depth > kMinBuildDepth && least() > static_cast<double>(max_points))
        --depth;
    return depth;
}

// Verifies that the box lies within a grid taken from another file: no point may be moved.
Status check_fits(const Bounds &bounds, const Grid &grid) {
    if (grid.depth < kMinBuildDepth)
        return usage_error("the grid of --grid-like has depth " + std::to_string(grid.depth) + ", the least is " +
                           std::to_string(kMinBuildDepth));
    for (int axis = 0; axis < 3; ++axis) {
        const double corner = grid.origin[static_cast<std::size_t>(axis)];
        const double low = bounds.lowest[axis], high = bounds.highest[axis];
        if (low < corner || high - corner > grid.edge())
            return usage_error(
                formatted("the scan reaches from %.12g to %.12g along %c, the grid of --grid-like from %.12g to "
                          "%.12g; choose a larger grid, or --scale and --origin",
                          low, high, "xyz"[axis], corner, corner + grid.edge()));
    }
    return {};
}

// The finest depth from `depth` on that the screen shows and the budget allows.
int depth_of_screen(const Surface &surface, const Bounds &bounds, std::span<const ShortNormal> normals,
                    std::span<const Relief> reliefs, const GridRequest &request, int depth, int threads) {
    const double budget = std::max(kMinBudget, static_cast<double>(request.scan_bytes));
    const double area = relative_area(surface, bounds, threads);
    if (!(area > 0)) // a line or a point has no detail
        return depth;
    // Of images and faces, whose colours may change anywhere.
    const bool has_fine_colours =
        !surface.texture_ids.empty() || !surface.face_colours.empty() || !surface.layer(Layer::emission).ids.empty();
    while (depth < kMaxScreenDepth && screen_voxel(bounds, request.up.value_or(UpAxis::y), depth) > kMaxScreenVoxel) {
        const double voxel_size = centred_grid(bounds, depth + 1).voxel_size;
        const double change = std::hypot(normal_change(surface, bounds, normals, voxel_size, threads),
                                         relief_change(surface, reliefs, bounds, voxel_size, threads));
        const double of_colour = has_fine_colours ? 1 : colour_change(surface, bounds, voxel_size, threads);
        if (estimated_bytes(area, change, of_colour, depth + 1) > budget)
            break;
        ++depth;
    }
    return depth;
}

// The depth from that of the surface on that its images ask for; `reason` says so if it is a finer one.
int depth_of_images(const Surface &surface, const Bounds &bounds, std::span<const Relief> reliefs, int of_surface,
                    int threads, std::string &reason) {
    const auto voxel_size = [&](int depth) { return centred_grid(bounds, depth).voxel_size; };
    const int finest = std::max(of_surface, std::min(kMaxMeshDepth, of_surface + kMaxDepthsForTexels));
    const double first_texels = texels_per_voxel(surface, bounds, voxel_size(of_surface), threads);
    int of_texels = of_surface, of_relief = of_surface;
    for (double texels = first_texels; texels > kMaxTexels && of_texels < finest; texels /= 4)
        ++of_texels;
    const double first_change = relief_change(surface, reliefs, bounds, voxel_size(of_surface), threads);
    for (double change = first_change; change > kMaxNormalChange && of_relief < finest;
         change = relief_change(surface, reliefs, bounds, voxel_size(of_relief), threads))
        ++of_relief;
    const int depth = std::max(of_texels, of_relief);
    if (of_texels == depth && depth > of_surface)
        reason = formatted("%d: at %d, which the surface asks for, a voxel has %.0f texels", depth, of_surface,
                           first_texels);
    else if (depth > of_surface)
        reason = formatted("%d: at %d, which the surface asks for, normal maps change by %.0f degrees in a voxel",
                           depth, of_surface, glm::degrees(first_change));
    return depth;
}

// The finer of the depths for triangles and for points.
ChosenGrid grid_by_detail(const Surface &surface, const Bounds &bounds, std::span<const ShortNormal> normals,
                          const GridRequest &request, int threads) {
    int depth = kMinBuildDepth;
    std::string reason;
    if (!surface.triangles.empty()) {
        depth = mesh_depth(bounds, median_edge(surface, threads));
        const double change = normal_change(surface, bounds, normals, centred_grid(bounds, depth).voxel_size, threads);
        if (depth < kMaxMeshDepth && change > kMaxNormalChange) {
            reason = formatted("%d: at %d, which the median edge asks for, normals change by %.0f degrees in a voxel",
                               depth + 1, depth, glm::degrees(change));
            ++depth;
        }
        const std::vector<Relief> reliefs = measure_relief(surface, threads);
        depth = depth_of_images(surface, bounds, reliefs, depth, threads, reason);
        if (const int of_screen = depth_of_screen(surface, bounds, normals, reliefs, request, depth, threads);
            of_screen > depth) {
            depth = of_screen;
            reason.clear();
        }
    }
    if (surface.point_count() > 0)
        if (const int of_points = point_depth(occupied_voxels(surface, bounds, threads)); of_points > depth) {
            depth = of_points;
            reason.clear();
        }
    return {centred_grid(bounds, depth), std::move(reason)};
}

} // namespace

Result<ChosenGrid> choose_grid(const Surface &surface, const Bounds &bounds, std::span<const ShortNormal> normals,
                               const GridRequest &request, int threads) {
    ChosenGrid chosen;
    if (request.voxel_size) {
        auto snapped = snapped_grid(bounds, *request.voxel_size);
        if (!snapped)
            return snapped.error();
        chosen.grid = *snapped;
    } else if (request.depth) {
        chosen.grid = centred_grid(bounds, *request.depth);
    } else if (request.max_points) {
        chosen.grid = centred_grid(bounds, finest_depth(surface, bounds, *request.max_points, threads));
    } else if (request.like) {
        if (Status fits = check_fits(bounds, *request.like); !fits)
            return fits.error();
        return ChosenGrid{*request.like, {}};
    } else {
        chosen = grid_by_detail(surface, bounds, normals, request, threads);
    }
    chosen.grid.unit = request.unit.value_or(Unit::unknown);
    chosen.grid.up = request.up.value_or(UpAxis::y);
    return chosen;
}

} // namespace pbm::build
