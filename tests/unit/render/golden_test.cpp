// Golden files seen: what was frozen once is drawn for ever. format_spec/golden/README.md
#include "pbm_format/container/hash.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "system/files/mapped_file.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <nlohmann/json.hpp>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

namespace pbm {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kWidth = 96, kHeight = 72, kCell = 12; // pixels
constexpr int kMostOff = 16;                         // of 255, the mean of a cell

std::string hex(std::span<const std::uint8_t> bytes) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    std::string text;
    for (const std::uint8_t byte : bytes) {
        text += kDigits[byte >> 4];
        text += kDigits[byte & 15];
    }
    return text;
}

// XXH3-128, low half first, of red, green, blue, alpha of each pixel, top row first.
std::string hash_of(const Framebuffer &picture) {
    StreamingHash hash;
    for (const std::uint32_t pixel : picture.colour) {
        const Rgba8 colour = unpack_rgba(pixel);
        hash.add(colour);
    }
    const Hash128 whole = hash.finish();
    Bytes bytes;
    for (const std::uint64_t half : whole)
        for (int shift = 0; shift < 64; shift += 8)
            bytes.push_back(static_cast<std::uint8_t>(half >> shift));
    return hex(bytes);
}

// Means of red, green, blue of each cell of 12 x 12 pixels.
Bytes coarse(const Framebuffer &picture) {
    Bytes means;
    for (int top = 0; top < kHeight; top += kCell)
        for (int left = 0; left < kWidth; left += kCell)
            for (std::size_t c = 0; c < 3; ++c) {
                int sum = 0;
                for (int i = 0; i < kCell * kCell; ++i) {
                    const int pixel = (top + i / kCell) * kWidth + left + i % kCell;
                    sum += unpack_rgba(picture.colour[static_cast<std::size_t>(pixel)])[c];
                }
                means.push_back(static_cast<std::uint8_t>(sum / (kCell * kCell)));
            }
    return means;
}

// A golden file from a fixed place.
class Scene {
  public:
    Scene(ByteView file, const Camera &camera)
        : camera_(camera), streamed_(Reader::open(file).value(), {.threads = 1}),
          surroundings_(std::make_shared<const Surroundings>(parameters(), streamed_.reader().images().value())),
          detail_(streamed_.load({.camera = camera, .width = kWidth, .height = kHeight, .max_error = 1}).value()) {}

    Framebuffer fast(int threads = 1) const { return draw<FastRenderer>(threads); }
    Framebuffer fine(int threads = 1) const { return draw<FineRenderer>(threads, 4); }
    Framebuffer reference(const Model &model) const {
        Framebuffer picture(kWidth, kHeight);
        ReferenceRenderer(model, surroundings_).render(camera_, {}, picture);
        return picture;
    }

  private:
    const ModelParameters &parameters() const { return streamed_.reader().parameters(); }

    // `own`: options of this renderer only.
    template <class Renderer, class... Own> Framebuffer draw(int threads, Own... own) const {
        Framebuffer picture(kWidth, kHeight);
        Renderer renderer(parameters(), streamed_.reader().header().chunk_points, threads, surroundings_);
        renderer.render(detail_.runs, camera_, {}, picture, own...);
        return picture;
    }

    Camera camera_;
    StreamedModel streamed_;
    std::shared_ptr<const Surroundings> surroundings_;
    Detail detail_;
};

Json as_json(const glm::dvec3 &v) { return Json::array({v.x, v.y, v.z}); }
glm::dvec3 vector_of(const Json &v) { return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()}; }

Camera camera_of(const Json &json) {
    return {.position = vector_of(json.at("position")),
            .focal_point = vector_of(json.at("focal_point")),
            .up = vector_of(json.at("up")),
            .view_angle = json.at("view_angle")};
}

// From the front and above, since the ground is seen from above only.
Json new_camera(const Model &model) {
    Camera camera = default_camera(model, kWidth, kHeight);
    camera.position += camera.up * (0.4 * glm::distance(camera.position, camera.focal_point));
    return {{"position", as_json(camera.position)},
            {"focal_point", as_json(camera.focal_point)},
            {"up", as_json(camera.up)},
            {"view_angle", camera.view_angle}};
}

Model model_of(ByteView file) {
    Reader reader = Reader::open(file).value();
    return load_model(reader, {.threads = 1}).value();
}

Json entry_of(const Framebuffer &picture) { return {{"hash", hash_of(picture)}, {"cells", hex(coarse(picture))}}; }

// Hashes anew; camera and cells only where there are none: these stay for ever.
Json describe(const std::filesystem::path &file, const Json &before) {
    const MappedFile bytes = MappedFile::open(file.string()).value();
    const Model model = model_of(bytes.bytes());
    Json entry = before.is_null() ? Json{{"file", file.filename().string()}, {"camera", new_camera(model)}} : before;
    const Scene scene(bytes.bytes(), camera_of(entry.at("camera")));
    const auto add = [&](const char *name, const Framebuffer &picture) {
        if (!entry.contains(name))
            entry[name] = entry_of(picture);
        entry[name]["hash"] = hash_of(picture);
    };
    add("fast", scene.fast());
    add("fine", scene.fine());
    add("reference", scene.reference(model));
    return entry;
}

void expect_picture(const Framebuffer &picture, const Json &expected, const std::string &story) {
    const Bytes cells = coarse(picture);
    const std::string &kept = expected.at("cells").get_ref<const std::string &>();
    ASSERT_EQ(kept.size(), 2 * cells.size()) << story;
    int most = 0;
    for (std::size_t i = 0; i < cells.size(); ++i)
        most = std::max(most, std::abs(std::stoi(kept.substr(2 * i, 2), nullptr, 16) - int{cells[i]}));
    EXPECT_LE(most, kMostOff) << story << ": another picture than when the version was frozen";
    EXPECT_EQ(hash_of(picture), expected.at("hash").get<std::string>())
        << story << ": if drawing was to change, write the hashes anew (format_spec/golden/README.md)";
}

void expect_pictures(const std::filesystem::path &file, const Json &expected) {
    const MappedFile bytes = MappedFile::open(file.string()).value();
    const Scene scene(bytes.bytes(), camera_of(expected.at("camera")));
    expect_picture(scene.reference(model_of(bytes.bytes())), expected.at("reference"), file.string() + ", reference");
    const Framebuffer fast = scene.fast(), fine = scene.fine();
    expect_picture(fast, expected.at("fast"), file.string() + ", fast");
    expect_picture(fine, expected.at("fine"), file.string() + ", fine");
    EXPECT_EQ(scene.fast(8).colour, fast.colour) << file << ", 8 threads";
    EXPECT_EQ(scene.fine(8).colour, fine.colour) << file << ", 8 threads";
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        EXPECT_EQ(scene.fast().colour, fast.colour) << file << ", " << hwy::TargetName(target);
        EXPECT_EQ(scene.fine().colour, fine.colour) << file << ", " << hwy::TargetName(target);
        hwy::SetSupportedTargetsForTest(0);
    }
}

std::vector<std::filesystem::path> versions() {
    std::vector<std::filesystem::path> folders;
    for (const auto &folder : std::filesystem::directory_iterator(PBM_SOURCE_DIR "/format_spec/golden"))
        if (folder.is_directory())
            folders.push_back(folder.path());
    return folders;
}

Json read_json(const std::filesystem::path &path) {
    std::ifstream in(path);
    return in ? Json::parse(in) : Json{{"files", Json::array()}};
}

TEST(Golden, EveryFileOfEveryFrozenVersionIsDrawnAsItWas) {
    if (std::getenv("PBM_WRITE_PICTURES") != nullptr)
        GTEST_SKIP();
    ASSERT_FALSE(versions().empty());
    for (const auto &folder : versions()) {
        std::set<std::string> drawn;
        const Json pictures = read_json(folder / "pictures.json");
        for (const Json &expected : pictures.at("files")) {
            drawn.insert(expected.at("file").get<std::string>());
            expect_pictures(folder / expected.at("file").get<std::string>(), expected);
        }
        for (const auto &file : std::filesystem::directory_iterator(folder))
            EXPECT_TRUE(file.path().extension() != ".pbvg" || drawn.contains(file.path().filename().string()))
                << file.path() << " is not in pictures.json";
    }
}

// No test: writes pictures.json of each version where PBM_WRITE_PICTURES is set.
TEST(Golden, PicturesAreWritten) {
    if (std::getenv("PBM_WRITE_PICTURES") == nullptr)
        GTEST_SKIP();
    for (const auto &folder : versions()) {
        std::map<std::string, Json> before, files;
        const Json pictures = read_json(folder / "pictures.json");
        for (const Json &entry : pictures.at("files"))
            before[entry.at("file").get<std::string>()] = entry;
        for (const auto &file : std::filesystem::directory_iterator(folder))
            if (file.path().extension() == ".pbvg")
                files[file.path().filename().string()] = describe(file.path(), before[file.path().filename().string()]);
        Json all{{"width", kWidth}, {"height", kHeight}, {"cell", kCell}, {"files", Json::array()}};
        for (const auto &[name, entry] : files)
            all["files"].push_back(entry);
        std::ofstream(folder / "pictures.json") << all.dump(1) << '\n';
    }
}

} // namespace
} // namespace pbm
