#include "pictures.h"

#include "pbm_format/chunks/mapped_chunk.h"
#include "pbm_format/reading/point_stream_reader.h"
#include "pbm_render/bricks/round_points.h"
#include "pbm_render/camera/normal_table.h"
#include "unit/support/value_of.h"

#include <algorithm>

namespace pbm::faults {
namespace {

Sphere bounds_of(ByteView file) {
    StreamedModel model(value_of(Reader::open(file)), {.threads = 1});
    return value_of(model.bounds()).sphere;
}

// Decodes all chunks of a file by load_chunk.
std::vector<std::vector<Chunk>> decode_all(ByteView file) {
    Reader reader = value_of(Reader::open(file));
    std::vector<std::vector<Chunk>> levels(1);
    levels[0].push_back(reader.root_chunk());
    for (int level = 1; level <= reader.depth(); ++level) {
        const LevelDirectory &directory = *value_of(reader.directory(level));
        std::vector<Chunk> chunks(directory.chunks.size());
        for (std::size_t i = 0; i < chunks.size(); ++i)
            if (!reader.load_chunk(level, i, levels.back()[directory.chunks[i].shape.parent_chunk], chunks[i]))
                std::abort(); // the golden file is damaged
        levels.push_back(std::move(chunks));
    }
    return levels;
}

// The sides of the points of each chunk.
std::vector<std::vector<Sides>> decode_sides_of(Reader &reader) {
    std::vector<std::vector<Sides>> levels(1);
    PointStreamReader sides(reader, PointStream::sides);
    for (int level = 1; level <= reader.depth(); ++level) {
        const LevelDirectory &directory = *value_of(reader.directory(level));
        levels.emplace_back(directory.chunks.size());
        if (!sides.read_directory(directory))
            std::abort(); // the golden file is damaged
        for (std::size_t i = 0; i < directory.chunks.size(); ++i)
            if (const PointStreamEntry entry = sides.entry(level, i); entry.raw_bytes > 0) {
                const HeldBytes stored = value_of(reader.source().require(entry.range()));
                if (!sides.load(level, i, directory.chunks[i], stored.bytes, levels.back()[i]))
                    std::abort();
            }
    }
    return levels;
}

// Whether a run of second sides is that of a chunk.
bool are_second_sides(const PointRun &run, const Sides &sides) {
    bool same = run.chunk->normals.size() == sides.size();
    for (std::size_t i = 0; same && i < sides.size(); ++i)
        same =
            run.origins[i] == sides.points[i] && run.chunk->normals[i] == (sides.values.normals[2 * i + 1] | kSideBits);
    return same;
}

// Gives points with sides the first one.
void show_first_sides(const Sides &sides, const AttributeSet &set, PointAttributes &points) {
    for_columns(
        set,
        [&](const StreamInfo &, std::size_t width, auto &to, const auto &from) {
            for (std::size_t i = 0; i < sides.size() && !from.empty(); ++i)
                for (std::size_t k = 0; k < width; ++k)
                    to[width * sides.points[i] + k] = from[2 * width * i + k];
        },
        points, sides.values);
    for (const std::uint32_t point : sides.points)
        points.normals[point] |= kSideBits;
}

std::vector<std::shared_ptr<const TiledImage>> rasters(const TiledImages &images) {
    std::vector<std::shared_ptr<const TiledImage>> all{images.panorama, images.ground_texture};
    all.insert(all.end(), images.ground_lit.begin(), images.ground_lit.end());
    return all;
}

} // namespace

Pictures::Pictures(const Golden &golden)
    : golden_(golden), reader_(value_of(Reader::open(golden.bytes))),
      view_(whole_view(bounds_of(golden.bytes), value_of(Reader::open(golden.bytes)).parameters().grid.up)),
      whole_(value_of(show(golden.bytes, view_))), chunks_(decode_all(golden.bytes)), sides_(decode_sides_of(reader_)),
      whole_picture_(draw(whole_, view_).colour) {
    directories_.push_back(nullptr);
    for (int level = 1; level <= reader_.depth(); ++level)
        directories_.push_back(value_of(reader_.directory(level)));
}

// Whether every drawn chunk equals that of the golden file.
bool Pictures::same_chunks(const Shown &shown) const {
    const AttributeSet &set = reader_.parameters().attributes;
    return std::all_of(shown.detail.runs.begin(), shown.detail.runs.end(), [&](const PointRun &run) {
        const LevelDirectory &directory = *directories_[static_cast<std::size_t>(run.level)];
        const auto chunk = std::find_if(directory.chunks.begin(), directory.chunks.end(), [&](const ChunkEntry &entry) {
            return entry.first_point == run.entry->first_point;
        });
        if (chunk == directory.chunks.end() || chunk->shape != run.entry->shape || chunk->cone != run.entry->cone)
            return false;
        const auto level = static_cast<std::size_t>(run.level);
        const auto index = static_cast<std::size_t>(chunk - directory.chunks.begin());
        if (run.origins != nullptr)
            return are_second_sides(run, sides_[level][index]);
        Chunk drawn; // as decoded, but for sides and round points
        copy_chunk(*run.chunk, set, run.level, drawn);
        const Chunk &whole = chunks_[level][index];
        PointAttributes points = whole.points;
        show_first_sides(sides_[level][index], set, points);
        PointView view = view_points(points, 0, points.size(), set);
        MarkedPoints round;
        mark_round_points(view, reader_.parameters(), run.level, round);
        if (!round.normals.empty()) {
            points.normals = round.normals;
            points.radii = round.radii;
        }
        return drawn.masks == whole.masks && drawn.points == points;
    });
}

// Whether every tile equals that of the golden file or is refused.
bool Pictures::same_tiles(const Shown &shown) const {
    const auto damaged = rasters(shown.images), whole = rasters(whole_.images);
    if (damaged.size() != whole.size())
        return false;
    for (std::size_t i = 0; i < whole.size(); ++i) {
        if ((damaged[i] == nullptr) != (whole[i] == nullptr))
            return false;
        if (whole[i] == nullptr)
            continue;
        const TileGrid &grid = whole[i]->grid();
        for (int level = 0; level < grid.levels(); ++level)
            for (std::uint32_t ty = 0; ty < grid.tiles_down(level); ++ty)
                for (std::uint32_t tx = 0; tx < grid.tiles_across(level); ++tx) {
                    const std::uint8_t *texels = damaged[i]->tile(level, tx, ty);
                    const std::uint8_t *expected = whole[i]->tile(level, tx, ty);
                    if (texels != nullptr && !std::equal(texels, texels + grid.tile_bytes(level), expected))
                        return false;
                }
    }
    return true;
}

Pictures::Picture Pictures::picture_of(ByteView file, const std::string &story, Tally &tally) const {
    const Result<Shown> shown = show(file, view_);
    if (!shown)
        return std::nullopt;
    tally.require(shown->model->reader().parameters() == whole_.model->reader().parameters() &&
                      shown->model->reader().header().root == whole_.model->reader().header().root,
                  story + ": other parameters are drawn than were written");
    tally.require(same_chunks(*shown), story + ": points are drawn that nobody wrote");
    tally.require(same_tiles(*shown), story + ": texels are drawn that nobody wrote");
    return draw(*shown, view_).colour;
}

// The picture without that region, by inverting all of its bits.
const Pictures::Picture &Pictures::expected(const Region &region, Tally &tally) {
    const auto known = expected_.find(region.begin);
    if (known != expected_.end())
        return known->second;
    if (region.part == Part::padding)
        return expected_[region.begin] = whole_picture_;
    Bytes without = golden_.bytes;
    for (std::uint64_t at = region.begin; at < region.end; ++at)
        without[at] = static_cast<std::uint8_t>(~without[at]);
    return expected_[region.begin] = picture_of(without, golden_.name + " without " + describe(region), tally);
}

void Pictures::check(ByteView damaged, const Region &region, const std::string &story, Tally &tally) {
    const Picture picture = picture_of(damaged, story, tally);
    const Picture &right = expected(region, tally);
    if (!tally.require(picture.has_value() == right.has_value(), story + ": refused or not, by which bit it is"))
        return;
    tally.count(!picture ? "refused as a whole" : *picture == *whole_picture_ ? "drawn whole" : "drawn coarser");
    if (!picture)
        return;
    std::uint64_t wrong = 0;
    for (std::size_t i = 0; i < picture->size(); ++i)
        wrong += (*picture)[i] == (*right)[i] ? 0 : 1;
    tally.count("pixels", picture->size());
    tally.count("wrong pixels", wrong);
    tally.require(wrong == 0, story + ": " + std::to_string(wrong) + " wrong pixels");
}

} // namespace pbm::faults
