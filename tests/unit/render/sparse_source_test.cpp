// Pictures of a file of which only some byte ranges have arrived.
#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_format/writing/writer.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/surroundings/surroundings.h"
#include "system/files/mapped_file.h"
#include "unit/render/test_model.h"
#include "unit/support/network_file.h"
#include "unit/support/test_models.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <thread>

namespace pbm {
namespace {

using test::NetworkFile;

constexpr int kWidth = 160, kHeight = 120; // pixels

// A model as a program holds it that draws whatever has arrived.
struct ShownModel {
    explicit ShownModel(Reader reader, StreamingOptions options = {.threads = 2})
        : images(value_of(read_images(reader))), model(std::move(reader), std::move(options)),
          surroundings(std::make_shared<const Surroundings>(model.reader().parameters(), images)),
          renderer(model.reader().parameters(), model.reader().header().chunk_points, 1, surroundings) {}

    Framebuffer draw(const Detail &detail, const Camera &camera) {
        Framebuffer picture(kWidth, kHeight);
        renderer.render(detail.runs, camera, {}, picture);
        return picture;
    }

    TiledImages images;
    StreamedModel model;
    std::shared_ptr<const Surroundings> surroundings;
    FastRenderer renderer;
    std::size_t tiles_that_came_later = 0;
};

// Fetches the wanted ranges, a few at a time, and returns the complete picture.
Framebuffer draw_from(NetworkFile &network, ShownModel &shown, const DetailView &view) {
    Detail detail = value_of(shown.model.load(view));
    for (; !detail.wanted.empty(); detail = value_of(shown.model.load(view)))
        network.fetch(std::vector(detail.wanted.begin(),
                                  detail.wanted.begin() + std::min<std::ptrdiff_t>(3, std::ssize(detail.wanted))));
    Framebuffer picture = shown.draw(detail, view.camera);
    for (auto wanted = shown.surroundings->take_wanted(); !wanted.empty(); wanted = shown.surroundings->take_wanted()) {
        shown.tiles_that_came_later += wanted.size(); // until then coarser mip levels are shown
        network.fetch(wanted);
        picture = shown.draw(detail, view.camera);
    }
    EXPECT_TRUE(shown.surroundings->take_errors().empty());
    return picture;
}

Extent bounds_from(NetworkFile &network, ShownModel &shown) {
    EXPECT_EQ(shown.model.bounds().error().code, ErrorCode::usage);
    network.fetch(shown.model.bounds_wanted());
    EXPECT_TRUE(shown.model.bounds_wanted().empty());
    return value_of(shown.model.bounds());
}

void expect_same_picture(const Framebuffer &a, const Framebuffer &b, const std::string &story) {
    EXPECT_EQ(a.colour, b.colour) << story;
    EXPECT_EQ(a.depth, b.depth) << story;
}

// From the front and above, since the ground is visible from above only.
DetailView view_of(const Extent &bounds, UpAxis up, int finest) {
    DetailView view{.camera = default_camera(bounds, up, kWidth, kHeight),
                    .width = kWidth,
                    .height = kHeight,
                    .max_error = 0.5,
                    .finest = finest};
    view.camera.position += view.camera.up * (0.4 * glm::distance(view.camera.position, view.camera.focal_point));
    return view;
}

TEST(SparseSource, DrawsGoldenFilesAsAWholeFileDoes) {
    int files = 0;
    std::size_t tiles = 0;
    for (const auto &path : std::filesystem::recursive_directory_iterator(PBM_SOURCE_DIR "/format_spec/golden")) {
        const std::string version = path.path().parent_path().filename().string();
        const bool has_streams = version == "1.4" || version == "1.6"; // of points
        if (path.path().extension() != ".pbvg" || (version != "1.0" && !has_streams))
            continue;
        const std::string name = path.path().filename().string();
        const MappedFile file = value_of(MappedFile::open(path.path().string()));
        NetworkFile network(file.bytes());
        ShownModel whole(value_of(Reader::open(file.bytes()))), sparse(network.open());
        const Extent bounds = bounds_from(network, sparse);
        EXPECT_EQ(bounds.corners, value_of(whole.model.bounds()).corners);
        for (int level = 1; level <= whole.model.reader().depth(); ++level) {
            const DetailView view = view_of(bounds, whole.model.reader().parameters().grid.up, level);
            const Framebuffer expected = whole.draw(value_of(whole.model.load(view)), view.camera);
            const Framebuffer picture = draw_from(network, sparse, view);
            expect_same_picture(expected, picture, name + ", level " + std::to_string(level));
        }
        EXPECT_EQ(whole.model.statistics().bytes_read, sparse.model.statistics().bytes_read);
        EXPECT_TRUE(sparse.model.take_errors().empty());
        tiles += sparse.tiles_that_came_later;
        ++files;
    }
    EXPECT_GE(files, 17);
    EXPECT_GE(tiles, 10U);
}

TEST(SparseSource, IsDrawnByTheReferenceRenderer) {
    for (const char *name : {"scan-plain", "shaded", "mapped-chunks"}) {
        std::filesystem::path path;
        for (const auto &file : std::filesystem::directory_iterator(PBM_SOURCE_DIR "/format_spec/golden/1.0"))
            if (file.path().stem() == name)
                path = file.path();
        const MappedFile file = value_of(MappedFile::open(path.string()));
        Reader whole = value_of(Reader::open(file.bytes()));
        NetworkFile network(file.bytes());
        Reader sparse = network.open();
        for (const int level : {1, whole.depth()}) {
            const LoadOptions options{.max_level = level, .threads = 1};
            const Result<Model> early = load_model(sparse, options);
            ASSERT_FALSE(early);
            EXPECT_EQ(early.error().code, ErrorCode::usage);
            for (int next = 1; next <= level; ++next)
                for (const SectionType type :
                     {SectionType::level_directory, SectionType::level_bricks, SectionType::level_chunks})
                    if (const SectionEntry *entry = sparse.section(type, static_cast<std::uint32_t>(next)))
                        network.fetch(FileRange{entry->offset, entry->stored_bytes});
            for (const SectionEntry *raster : rasters(sparse))
                network.fetch(FileRange{raster->offset, raster->stored_bytes});
            const Model expected = value_of(load_model(whole, options)), model = value_of(load_model(sparse, options));
            const Camera camera = default_camera(expected, kWidth, kHeight);
            Framebuffer a(kWidth, kHeight), b(kWidth, kHeight);
            const auto surroundings = [](const Model &of) {
                return std::make_shared<const Surroundings>(of.parameters, TiledImages::of(of.images));
            };
            ReferenceRenderer(expected, surroundings(expected)).render(camera, {}, a);
            ReferenceRenderer(model, surroundings(model)).render(camera, {}, b);
            expect_same_picture(a, b, name);
        }
    }
}

const Bytes &sphere_file(Storage storage) {
    static const auto make = [](Storage of) {
        const Model model = test::sphere_model(7, test::every_attribute(ColourFormat::rgb565, 7));
        return value_of(encode_model(model, {.storage = of, .chunk_points = 512, .threads = 1}));
    };
    static const Bytes packed = make(Storage::packed), mapped = make(Storage::mapped);
    return storage == Storage::packed ? packed : mapped;
}

DetailView view_from(double angle, double distance = 1.3) {
    DetailView view;
    view.camera = camera_in_front({0, -1, -2}, distance);
    view.camera.position = view.camera.focal_point + distance * glm::dvec3(std::sin(angle), 0, std::cos(angle));
    view.camera.view_angle = 0.3;
    view.width = kWidth;
    view.height = kHeight;
    return view;
}

TEST(SparseSource, FetchesWhatAPictureNeedsAndKeepsNoPackedBytes) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes &file = sphere_file(storage);
        NetworkFile network(file);
        ShownModel sparse(network.open()), whole(value_of(Reader::open(file)));
        const DetailView view = view_from(0);
        const Framebuffer picture = draw_from(network, sparse, view);
        expect_same_picture(whole.draw(value_of(whole.model.load(view)), view.camera), picture, "");
        EXPECT_LT(network.bytes(), file.size() / 2);
        EXPECT_LT(network.sparse().memory(), 4000U); // header, table, small sections
    }
}

// A missing range is no error and leaves no trace: until it arrives the picture is coarser.
TEST(SparseSource, ShowsLoadedChunksMeanwhile) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes &file = sphere_file(storage);
        NetworkFile network(file);
        ShownModel sparse(network.open()), whole(value_of(Reader::open(file)));
        const DetailView view = view_from(0);
        double coarser = -1;
        for (int round = 0; round < 1000; ++round) {
            Detail detail = sparse.model.choose(view);
            if (detail.wanted.empty() && detail.missing.empty())
                break;
            EXPECT_TRUE(std::is_sorted(detail.missing.begin(), detail.missing.end(),
                                       [](const auto &a, const auto &b) { return a.error > b.error; }));
            for (std::size_t i = 1; i < detail.wanted.size(); ++i)
                EXPECT_EQ(std::count(detail.wanted.begin(), detail.wanted.end(), detail.wanted[i]), 1);
            EXPECT_TRUE(sparse.model.take_errors().empty());
            coarser = std::max(coarser, detail.runs.empty() ? 0.0 : detail.runs.front().level);
            if (!detail.wanted.empty())
                network.fetch(detail.wanted.front());
            sparse.model.request(std::move(detail.missing));
            for (int wait = 0; wait < 20000 && sparse.model.is_loading(); ++wait)
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        const Detail detail = sparse.model.choose(view);
        EXPECT_TRUE(detail.wanted.empty() && detail.missing.empty());
        expect_same_picture(whole.draw(value_of(whole.model.load(view)), view.camera), sparse.draw(detail, view.camera),
                            "");
        EXPECT_TRUE(sparse.model.take_errors().empty());
        EXPECT_GT(coarser, 0);
    }
}

// An orbit with memory for a part of the model: evicted chunks are wanted again.
TEST(SparseSource, WantsEvictedChunksAgain) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        const Bytes &file = sphere_file(storage);
        ShownModel whole(value_of(Reader::open(file)));
        std::uint64_t largest = 0; // bytes that a single view needs
        for (int i = 0; i < 8; ++i) {
            NetworkFile network(file);
            ShownModel alone(network.open());
            draw_from(network, alone, view_from(i * 0.785));
            largest = std::max(largest, alone.model.statistics().memory);
        }
        NetworkFile network(file);
        ShownModel sparse(network.open(), {.threads = 2, .max_memory = largest + largest / 4});
        std::uint64_t first_round = 0;
        for (int i = 0; i < 16; ++i) {
            const DetailView view = view_from(i * 0.785);
            expect_same_picture(whole.draw(value_of(whole.model.load(view)), view.camera),
                                draw_from(network, sparse, view), std::to_string(i));
            EXPECT_LE(sparse.model.statistics().memory, largest + largest / 4);
            EXPECT_LT(network.sparse().memory(), 4000U);
            if (i == 7)
                first_round = network.bytes();
        }
        EXPECT_GT(network.bytes(), first_round * 3 / 2);
        EXPECT_TRUE(sparse.model.take_errors().empty());
    }
}

// Bytes that were dropped after their arrival and before decoding are wanted again.
TEST(SparseSource, WantsDroppedBytesAgain) {
    const Bytes &file = sphere_file(Storage::packed);
    NetworkFile network(file);
    ShownModel sparse(network.open()), whole(value_of(Reader::open(file)));
    const DetailView view = view_from(0);
    for (int round = 0; round < 3; ++round) {
        const Detail detail = sparse.model.choose(view);
        ASSERT_FALSE(detail.wanted.empty());
        network.fetch(detail.wanted);
        for (const FileRange &range : detail.wanted)
            network.sparse().drop({range.offset + range.bytes / 2, 1});
        EXPECT_EQ(sparse.model.choose(view).wanted, detail.wanted);
    }
    expect_same_picture(whole.draw(value_of(whole.model.load(view)), view.camera), draw_from(network, sparse, view),
                        "");
}

TEST(SparseSource, NamesDamage) {
    for (const Storage storage : {Storage::packed, Storage::mapped}) {
        Bytes file = sphere_file(storage);
        Reader directories = value_of(Reader::open(sphere_file(storage)));
        const ChunkEntry damaged = value_of(directories.directory(3))->chunks[0];
        file[damaged.offset + damaged.stored_bytes / 2] ^= 1;
        NetworkFile network(file);
        ShownModel sparse(network.open());
        Result<Detail> detail = sparse.model.load(view_from(0));
        for (; detail && !detail->wanted.empty(); detail = sparse.model.load(view_from(0)))
            network.fetch(detail->wanted);
        ASSERT_FALSE(detail);
        EXPECT_EQ(detail.error().code, ErrorCode::bad_hash);
        EXPECT_EQ(detail.error().offset, damaged.offset);
        EXPECT_TRUE(sparse.model.choose(view_from(0)).wanted.empty()); // a damaged chunk is not wanted again
    }
}

} // namespace
} // namespace pbm
