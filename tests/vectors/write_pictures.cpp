// write_pictures: draws every golden file and rewrites pictures.json of each version. format_spec/golden/README.md
#include "unit/render/golden_pictures.h"
#include "unit/support/value_of.h"

#include <glm/geometric.hpp>

#include <cstdio>
#include <exception>
#include <map>

namespace pbm::golden {
namespace {

Json as_json(const glm::dvec3 &v) { return Json::array({v.x, v.y, v.z}); }

// From the front and above, since the ground is visible from above only.
Json new_camera(const Model &model) {
    Camera camera = default_camera(model, kWidth, kHeight);
    camera.position += camera.up * (0.4 * glm::distance(camera.position, camera.focal_point));
    return {{"position", as_json(camera.position)},
            {"focal_point", as_json(camera.focal_point)},
            {"up", as_json(camera.up)},
            {"view_angle", camera.view_angle}};
}

Json entry_of(const Framebuffer &picture) { return {{"hash", hash_of(picture)}, {"cells", hex(coarse(picture))}}; }

// Updates the hashes. Keeps camera and cells, which are frozen, and adds them only if they are missing.
Json describe(const std::filesystem::path &file, const Json &before) {
    const MappedFile bytes = value_of(MappedFile::open(file.string()));
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

void write_pictures() {
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
} // namespace pbm::golden

int main() {
    try {
        pbm::golden::write_pictures();
        return 0;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "write_pictures: %s\n", error.what());
        return 4;
    }
}
