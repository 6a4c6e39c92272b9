#include "pbm_render/detail/detail_selection.h"

#include "pbm_format/reading/reader.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/camera/normal_table.h"
#include "pbm_render/camera/transform_table.h"
#include "unit/render/test_model.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

namespace pbm {
namespace {

using test::Random;

// A model, its directories, and the set of resident chunks.
class ChosenModel {
  public:
    explicit ChosenModel(Model model, std::uint32_t chunk_points = 512)
        : model_(std::move(model)), file_(value_of(encode_model(model_, {.chunk_points = chunk_points, .threads = 1}))),
          reader_(value_of(Reader::open(file_))) {
        const std::size_t levels = model_.levels.size();
        directories_.resize(levels);
        whole_.resize(levels);
        codes_ = {{0}};
        LevelMasks masks(1);
        for (std::size_t level = 1; level < levels; ++level) {
            directories_[level] = value_of(reader_.directory(static_cast<int>(level)));
            codes_.push_back(value_of(expand_level(codes_.back(), model_.levels[level].masks, std::size_t{1} << 30)));
            masks.push_back(model_.levels[level].masks);
        }
        for (std::size_t level = 1; level < levels; ++level)
            finest_below_.push_back(subtree_starts(masks, static_cast<int>(level)).back());
        for (std::size_t level = 1; level < levels; ++level)
            for (const ChunkEntry &entry : directories_[level]->chunks)
                whole_[level].push_back(whole(static_cast<int>(level), entry));
        everything_at_hand();
    }

    int depth() const { return reader_.depth(); }
    const Grid &grid() const { return model_.parameters.grid; }
    const ModelParameters &parameters() const { return model_.parameters; }
    const Level &level(int level) const { return model_.levels[static_cast<std::size_t>(level)]; }
    const LevelDirectory &directory(int level) const { return *directories_[static_cast<std::size_t>(level)]; }
    std::vector<ChunkSlot> &states(int level) { return states_[static_cast<std::size_t>(level)]; }

    void everything_at_hand() { states_ = whole_; }
    // Evicts the chunks for which `lost` is true and all chunks below them.
    template <class Lost> void forget(Lost &&lost) {
        everything_at_hand();
        for (int level = 1; level <= depth(); ++level)
            for (std::size_t i = 0; i < states(level).size(); ++i) {
                const ChunkEntry &entry = directory(level).chunks[i];
                const bool orphan = level > 1 && states(level - 1)[entry.shape.parent_chunk].chunk == nullptr;
                if (orphan || lost(level, i))
                    states(level)[i] = {};
            }
    }

    DetailSelection select(const DetailView &view) {
        std::vector<LevelState> levels(1);
        for (int level = 1; level <= depth(); ++level)
            levels.push_back({.directory = &directory(level), .chunks = states(level)});
        return select_detail(model_.parameters, reader_.header().root.value({StreamKind::radius}), levels, view);
    }

    // For each finest point: the number of runs that show it or an ancestor.
    std::vector<int> count_shown(const DetailSelection &selection) const {
        std::vector<int> shown(model_.levels.back().points.size());
        for (const PointRun &run : selection.runs) {
            const auto &below = finest_below_[static_cast<std::size_t>(run.level) - 1];
            for (std::uint64_t i = below[run.entry->first_point + run.first];
                 i < below[run.entry->first_point + run.last]; ++i)
                ++shown[i];
        }
        return shown;
    }

    // Centre of a point, model space.
    glm::dvec3 centre(int level, std::uint64_t point) const {
        const auto [x, y, z] = morton_decode(codes_[static_cast<std::size_t>(level)][point]);
        return glm::dvec3(grid().origin[0], grid().origin[1], grid().origin[2]) +
               (glm::dvec3(x, y, z) + 0.5) * grid().voxel_size_at(level);
    }

    double radius(int level, std::uint64_t point) const {
        return radius_fraction(this->level(level).points.radii[point]) * grid().edge();
    }

    // The chunk of a level that holds a finest point.
    const ChunkEntry &chunk_of(int level, std::uint64_t finest_point) const {
        const auto &below = finest_below_[static_cast<std::size_t>(level) - 1];
        const auto after = std::upper_bound(below.begin(), below.end(), finest_point);
        const auto point = static_cast<std::uint64_t>(after - below.begin()) - 1;
        const std::vector<ChunkEntry> &chunks = directory(level).chunks;
        return *(std::upper_bound(chunks.begin(), chunks.end(), point,
                                  [](std::uint64_t p, const ChunkEntry &entry) { return p < entry.first_point; }) -
                 1);
    }

  private:
    // The slot of a resident chunk.
    ChunkSlot whole(int level, const ChunkEntry &entry) const {
        const auto radii = ByteView(this->level(level).points.radii).subspan(entry.first_point, entry.shape.points);
        auto chunk = std::make_shared<ResidentChunk>();
        chunk->bounds = bounds_of(bricks(level, entry), level);
        chunk->largest_radius = *std::max_element(radii.begin(), radii.end());
        return {.chunk = std::move(chunk)};
    }

    // One brick per point, with only the fields that bounds_of reads.
    std::vector<BrickRecord> bricks(int level, const ChunkEntry &entry) const {
        std::vector<BrickRecord> bricks;
        for (std::uint64_t i = entry.first_point; i < entry.first_point + entry.shape.points; ++i) {
            const auto [x, y, z] = morton_decode(codes_[static_cast<std::size_t>(level)][i]);
            bricks.push_back({.x = static_cast<std::uint16_t>(x / 8),
                              .y = static_cast<std::uint16_t>(y / 8),
                              .z = static_cast<std::uint16_t>(z / 8)});
        }
        return bricks;
    }

    Model model_;
    Bytes file_;
    Reader reader_;
    std::vector<const LevelDirectory *> directories_;
    std::vector<std::vector<ChunkSlot>> whole_, states_;   // [level][chunk]
    std::vector<std::vector<MortonCode>> codes_;           // [level]
    std::vector<std::vector<std::uint64_t>> finest_below_; // [level - 1]: first finest point below each point
};

ChosenModel sphere(std::uint32_t chunk_points = 512) {
    return ChosenModel(test::sphere_model(6, {}, 0.45), chunk_points);
}

// Eye and focal point around or inside the cube of these models: edge 2, origin (-1, -2, -3).
DetailView random_view(Random &random) {
    const auto direction = [&] {
        return glm::normalize(glm::dvec3(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5) + 1e-3);
    };
    DetailView view;
    const glm::dvec3 middle(0, -1, -2);
    view.camera.position = middle + direction() * (4 * random.unit());
    view.camera.focal_point = middle + direction() * random.unit();
    view.camera.up = direction();
    view.camera.view_angle = 0.1 + random.unit();
    view.width = 64 + static_cast<int>(random.below(400));
    view.height = 64 + static_cast<int>(random.below(400));
    view.max_error = 0.5 + 8 * random.unit();
    return view;
}

// Whether a splat may cover a pixel.
bool is_in_view(const Projection &projection, const DetailView &view, glm::dvec3 point, double radius) {
    const glm::dvec3 p = projection.point(point);
    if (p.z <= radius) // renderers skip splats that contain the eye
        return false;
    const double reach = radius * projection.focal / p.z;
    return p.x / p.z >= -reach && p.x / p.z <= view.width + reach && p.y / p.z >= -reach &&
           p.y / p.z <= view.height + reach;
}

bool faces_away(const ChosenModel &model, int level, std::uint64_t point, glm::dvec3 eye) {
    const std::uint16_t normal = model.level(level).points.normals[point];
    const UnitVector &n = normal_table()[normal & kNormalIndexMask];
    const glm::dvec3 ray = glm::normalize(model.centre(level, point) - eye);
    return (normal & kTwoSidedBit) == 0 && glm::dot(glm::dvec3(n[0], n[1], n[2]), ray) > double{kFacingSlack};
}

// Whether, at any level, all points of the chunk that contains the point face away.
bool is_on_the_back(const ChosenModel &model, std::uint64_t finest_point, glm::dvec3 eye) {
    for (int level = model.depth(); level >= 1; --level) {
        const ChunkEntry &entry = model.chunk_of(level, finest_point);
        bool away = true;
        for (std::uint64_t i = 0; i < entry.shape.points && away; ++i)
            away = faces_away(model, level, entry.first_point + i, eye);
        if (away)
            return true;
    }
    return false;
}

TEST(DetailSelection, ShowsEveryVisibleVoxelOnceWhateverIsLoaded) {
    ChosenModel model = sphere();
    Random random(3);
    std::uint64_t culled = 0;
    for (int round = 0; round < 60; ++round) {
        const DetailView view = random_view(random);
        if (!is_usable(view.camera))
            continue;
        const std::uint64_t lost_in_100 = random.below(3) * 15;
        const int last_level = 1 + static_cast<int>(random.below(6));
        model.forget([&](int level, std::size_t) {
            return level > 1 && (level > last_level || random.below(100) < lost_in_100);
        });
        const std::vector<int> shown = model.count_shown(model.select(view));
        const Projection projection(view.camera, view.width, view.height);
        for (std::uint64_t i = 0; i < shown.size(); ++i) {
            ASSERT_LE(shown[i], 1) << "round " << round << ", point " << i;
            if (shown[i] == 1)
                continue;
            ++culled;
            const glm::dvec3 centre = model.centre(model.depth(), i);
            const bool seen = is_in_view(projection, view, centre, model.radius(model.depth(), i));
            ASSERT_TRUE(!seen || is_on_the_back(model, i, view.camera.position))
                << "round " << round << ", point " << i;
        }
    }
    EXPECT_GT(culled, 50'000U);
}

// Loads the missing chunks until none is missing, as a program without a window does.
TEST(DetailSelection, LoadingMissingChunksEndsInTheWholePicture) {
    ChosenModel model = sphere();
    Random random(6);
    std::uint64_t shown_points = 0;
    for (int round = 0; round < 400; ++round) {
        DetailView view = random_view(random);
        // Errors near those of whole levels: there a chunk may be too coarse although none of its parts is.
        const double distance = glm::length(view.camera.position - glm::dvec3(0, -1, -2));
        const double focal = view.height / (2 * std::tan(view.camera.view_angle / 2));
        const int level = 2 + static_cast<int>(random.below(5));
        view.max_error = model.grid().voxel_size_at(level) * focal / distance * (0.7 + 1.6 * random.unit());
        if (!is_usable(view.camera))
            continue;
        std::set<std::pair<int, std::size_t>> loaded;
        model.forget([](auto &&...) { return true; });
        DetailSelection selection = model.select(view);
        while (!selection.missing.empty()) {
            const std::size_t before = loaded.size();
            for (const MissingChunk &chunk : selection.missing)
                loaded.insert({chunk.place.level, chunk.place.index});
            ASSERT_GT(loaded.size(), before);
            model.forget([&](int of_level, std::size_t index) { return loaded.count({of_level, index}) == 0; });
            selection = model.select(view);
        }
        const std::vector<int> shown = model.count_shown(selection);
        const Projection projection(view.camera, view.width, view.height);
        for (std::uint64_t i = 0; i < shown.size(); ++i) {
            shown_points += shown[i] == 1 ? 1 : 0;
            ASSERT_TRUE(shown[i] == 1 ||
                        !is_in_view(projection, view, model.centre(model.depth(), i), model.radius(model.depth(), i)) ||
                        is_on_the_back(model, i, view.camera.position))
                << "round " << round << ", point " << i;
        }
    }
    EXPECT_GT(shown_points, 100'000U);
}

TEST(DetailSelection, LeavesOutChunksOutsideOfTheClipRegionOnly) {
    ChosenModel model = sphere();
    Random random(8);
    std::uint64_t left_out = 0;
    for (int round = 0; round < 60; ++round) {
        DetailView view = random_view(random);
        if (!is_usable(view.camera))
            continue;
        model.forget([](auto &&...) { return false; });
        const std::vector<int> whole = model.count_shown(model.select(view));
        view.camera.clip.plane = {.point = {0, -1, -2}, .normal = view.camera.up};
        const std::vector<int> cut = model.count_shown(model.select(view));
        for (std::uint64_t i = 0; i < whole.size(); ++i) {
            const bool is_inside =
                glm::dot(view.camera.up, model.centre(model.depth(), i) - glm::dvec3(0, -1, -2)) >= 0;
            ASSERT_TRUE(!is_inside || cut[i] >= whole[i]) << "round " << round << ", point " << i;
            left_out += cut[i] < whole[i] ? 1 : 0;
        }
    }
    EXPECT_GT(left_out, 50'000U);
}

TEST(DetailSelection, DrawsNoVoxelLargerThanAllowed) {
    ChosenModel model = sphere();
    Random random(4);
    std::uint64_t coarse = 0;
    for (int round = 0; round < 60; ++round) {
        const DetailView view = random_view(random);
        const Projection projection(view.camera, view.width, view.height);
        const DetailSelection selection = model.select(view);
        EXPECT_TRUE(selection.missing.empty());
        for (const PointRun &run : selection.runs) {
            if (run.level == model.depth())
                continue;
            for (std::uint64_t i = run.first; i < run.last; ++i) {
                const glm::dvec3 centre = model.centre(run.level, run.entry->first_point + i);
                if (!is_in_view(projection, view, centre, 0))
                    continue;
                ++coarse;
                ASSERT_LE(model.grid().voxel_size_at(run.level) * projection.focal / projection.point(centre).z,
                          view.max_error)
                    << "round " << round;
            }
        }
    }
    EXPECT_GT(coarse, 10'000U);
}

DetailView front_view(double distance = 6) {
    DetailView view;
    view.camera = camera_in_front({0, -1, -2}, distance);
    view.width = view.height = 200;
    return view;
}

TEST(DetailSelection, EndsAtTheLevelAskedForAndAtTheFinest) {
    ChosenModel model = sphere();
    DetailView view = front_view();
    view.max_error = 1e-6;
    for (int finest = 1; finest <= model.depth() + 2; ++finest) {
        view.finest = finest;
        for (const PointRun &run : model.select(view).runs)
            EXPECT_EQ(run.level, std::min(finest, model.depth()));
    }
    view.max_error = 1e6;
    const DetailSelection coarsest = model.select(view);
    ASSERT_EQ(coarsest.runs.size(), 1U);
    EXPECT_EQ(coarsest.runs[0].level, 1);
}

TEST(DetailSelection, RefinesAroundAnEyeThatIsInside) {
    ChosenModel model(test::sphere_model(6, {}, 0.3), 512);
    DetailView view = front_view();
    view.max_error = 1e6;
    view.camera.position = {0, -1, -1.4 - 1e-3}; // just inside the front of the sphere
    bool finest = false;
    for (const PointRun &run : model.select(view).runs)
        finest |= run.level == model.depth();
    EXPECT_TRUE(finest);
}

// Order of missing chunks: parents before children, then by falling error in pixels.
TEST(DetailSelection, NamesMissingChunksMostUrgentFirst) {
    ChosenModel model = sphere();
    const DetailView view = front_view(3);
    const DetailSelection complete = model.select(view);
    model.forget([](auto &&...) { return true; });
    const DetailSelection nothing = model.select(view);
    EXPECT_TRUE(nothing.runs.empty());
    EXPECT_TRUE(nothing.present.empty());
    std::vector<ChunkPlace> missing;
    for (const MissingChunk &chunk : nothing.missing) {
        missing.push_back(chunk.place);
        if (chunk.place.level == 1)
            continue;
        const ChunkPlace parent{chunk.place.level - 1,
                                model.directory(chunk.place.level).chunks[chunk.place.index].shape.parent_chunk};
        EXPECT_NE(std::find(missing.begin(), missing.end() - 1, parent), missing.end() - 1);
    }
    EXPECT_TRUE(std::is_sorted(nothing.missing.begin(), nothing.missing.end(),
                               [](const auto &a, const auto &b) { return a.error > b.error; }));
    // Missing chunks are those of the complete picture, and some that only their own radii prove invisible.
    EXPECT_GE(missing.size(), complete.present.size());
    EXPECT_LE(missing.size(), complete.present.size() * 5 / 4);
    for (const ChunkPlace place : complete.present)
        EXPECT_NE(std::find(missing.begin(), missing.end(), place), missing.end());
}

TEST(DetailSelection, AsksForDirectoriesOnlyWhereTheyAreNeeded) {
    ChosenModel model = sphere();
    DetailView view = front_view();
    view.max_error = 12; // pixels: level 5
    const DetailSelection selection = model.select(view);
    const int finest =
        std::max_element(selection.runs.begin(), selection.runs.end(), [](const PointRun &a, const PointRun &b) {
            return a.level < b.level;
        })->level;
    ASSERT_LT(finest, model.depth());
    std::vector<LevelState> levels(1);
    for (int known = 0; known <= finest; ++known) {
        if (known > 0)
            levels.push_back({.directory = &model.directory(known), .chunks = model.states(known)});
        EXPECT_EQ(select_detail(model.parameters(), 255, levels, view).needs_directory, known < finest) << known;
    }
}

TEST(DetailSelection, NeverAsksForARefusedChunkNorForThoseBelow) {
    ChosenModel model = sphere();
    const DetailView view = front_view(3);
    const DetailSelection whole = model.select(view);
    const ChunkPlace refused = whole.present[whole.present.size() / 2];
    model.forget([&](int level, std::size_t i) { return level == refused.level && i == refused.index; });
    model.states(refused.level)[refused.index].refused = true;
    const DetailSelection selection = model.select(view);
    EXPECT_TRUE(selection.missing.empty());
    const std::vector<int> before = model.count_shown(whole), shown = model.count_shown(selection);
    EXPECT_LT(selection.present.size(), whole.present.size());
    for (std::size_t i = 0; i < shown.size(); ++i)
        EXPECT_GE(shown[i], before[i]);
}

TEST(DetailSelection, IsTheSameForLargeChunks) {
    ChosenModel model = sphere(kDefaultChunkPoints); // one chunk per level
    for (const double max_error : {100.0, 12.0, 6.0, 3.0, 1.0}) {
        DetailView view = front_view();
        view.max_error = max_error;
        const DetailSelection selection = model.select(view);
        ASSERT_EQ(selection.runs.size(), 1U);
        EXPECT_EQ(selection.runs[0].first, 0U);
        EXPECT_EQ(selection.runs[0].last, selection.runs[0].entry->shape.points);
        EXPECT_EQ(selection.present.size(), static_cast<std::size_t>(selection.runs[0].level));
    }
}

} // namespace
} // namespace pbm
