// Draws frames with all renderers in turn, in each round.
//
//   bench_frames ROUNDS VIEWS WIDTH HEIGHT (WHAT THREADS DISTANCE FILE)...
//
// WHAT: fast, avx2 (fast, without newer instructions) or reference (FILE: a model), or embree (FILE: its mesh, drawn
// for the views of the first model named). VIEWS: number of views around the model. The distance to the surface at the
// middle of the picture is DISTANCE times that of the whole view. Or WHAT is dive: the fast renderer, VIEWS frames on
// the way from the whole view to DISTANCE, each nearer by the same factor; each round opens the model anew. Loading is
// not part of the time of a frame. Prints a JSON array, an object for each four arguments: what, threads, distance,
// file, drawn_points (mean), covered_pixels (mean; of models), milliseconds: [round][view], processors (mean number in
// use while drawing). A first round, not counted, warms up.
#include "embree_peer.h"
#include "pbm_render/appearance/appearance.h"
#include "pbm_scan/surface_reader.h"
#include "system/processes/this_process.h"
#include "value_or_throw.h"
#include "viewer/navigation/camera_control.h"
#include "viewer/pbm-render/model_drawer.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <hwy/targets.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace {

using namespace pbm;
using bench::value_or_throw;

// AVX2 and what came before it.
constexpr std::int64_t kOlderTargets = HWY_AVX2 | HWY_SSE4 | HWY_SSSE3 | HWY_STATIC_TARGET;

struct Task {
    std::string what;
    int threads;
    double distance;
    std::string file;
};

// The renderers, shared by tasks with equal parameters.
class Renderers {
  public:
    Renderers(int views, int width, int height)
        : view_count_(views), picture_(width, height), colours_(width, height, false) {}

    ModelDrawer &model(const Task &task) {
        auto &drawer = models_[{task.what, task.threads, task.file}];
        if (!drawer) {
            ViewOptions options;
            options.renderer = task.what == "reference" ? Renderer::reference : Renderer::fast;
            options.load.threads = task.threads;
            drawer = value_or_throw(ModelDrawer::open(task.file, options), task.file);
        }
        return *drawer;
    }

    bench::EmbreePeer &embree(const Task &task, const glm::dvec3 &centre) {
        auto &peer = peers_[{task.threads, task.file}];
        if (!peer) {
            const build::Surface mesh = value_or_throw(build::read_surface(task.file, build::ReadOptions{}), task.file);
            peer = std::make_unique<bench::EmbreePeer>(mesh, centre, task.threads);
        }
        return *peer;
    }

    void forget_models() { models_.clear(); }

    std::vector<Camera> views(ModelDrawer &drawer, double distance, bool dive) {
        const Camera whole = camera_around(drawer.extent().sphere, drawer.grid().up, picture_.width, picture_.height);
        const Camera end = dive ? nearer(drawer, whole, distance) : whole;
        std::vector<Camera> cameras;
        cameras.reserve(static_cast<std::size_t>(view_count_));
        for (int i = 0; i < view_count_; ++i)
            if (dive) {
                // The part of the way that is left: from 1 to 0, while the distance falls from 1 to `distance`.
                const double left =
                    (std::pow(distance, static_cast<double>(i) / (view_count_ - 1)) - distance) / (1 - distance);
                Camera &camera = cameras.emplace_back(end);
                camera.position += left * (whole.position - end.position);
            } else {
                cameras.push_back(
                    nearer(drawer, orbit(whole, whole.up, glm::two_pi<double>() * i / view_count_, 0), distance));
            }
        return cameras;
    }

    Framebuffer &picture() { return picture_; }
    Framebuffer &colours() { return colours_; } // without depths, as in the programs

  private:
    // Moves the camera along its view direction. If the middle of the picture is empty, the nearest surface counts.
    Camera nearer(ModelDrawer &drawer, Camera camera, double distance) {
        if (distance == 1)
            return camera;
        if (const Status loaded = drawer.load(camera, {picture_.width, picture_.height}, Motion::moving); !loaded)
            throw std::runtime_error(loaded.error().message);
        drawer.draw(camera, picture_, Motion::moving);
        const auto width = static_cast<std::size_t>(picture_.width), height = static_cast<std::size_t>(picture_.height);
        float surface = picture_.depth[height / 2 * width + width / 2];
        if (std::isinf(surface))
            surface = *std::min_element(picture_.depth.begin(),
                                        picture_.depth.begin() + static_cast<std::ptrdiff_t>(picture_.pixels()));
        const glm::dvec3 forward = eye_axes(camera).forward;
        camera.position += forward * ((1 - distance) * surface);
        camera.focal_point = camera.position + forward * (distance * surface);
        return camera;
    }

    const int view_count_;
    Framebuffer picture_, colours_;
    std::map<std::tuple<std::string, int, std::string>, std::unique_ptr<ModelDrawer>> models_;
    std::map<std::tuple<int, std::string>, std::unique_ptr<bench::EmbreePeer>> peers_;
};

// Times of all rounds of a task.
struct Cost {
    std::vector<std::vector<double>> milliseconds; // [round][view]
    double drawing = 0, processing = 0;            // seconds: wall clock, and processor time of all threads
    std::uint64_t drawn_points = 0, covered_pixels = 0, frames = 0;
};

void draw_all(Renderers &renderers, const Task &task, const std::vector<Camera> &views, const glm::dvec3 &centre,
              Cost &cost) {
    Framebuffer &picture = renderers.picture();
    std::vector<double> &times = cost.milliseconds.emplace_back();
    const auto timed = [&](auto &&draw) {
        const std::clock_t processing = std::clock();
        const auto start = std::chrono::steady_clock::now();
        draw();
        const std::chrono::duration<double> drawing = std::chrono::steady_clock::now() - start;
        cost.processing += static_cast<double>(std::clock() - processing) / CLOCKS_PER_SEC;
        cost.drawing += drawing.count();
        times.push_back(1e3 * drawing.count());
        ++cost.frames;
    };
    for (const Camera &camera : views) {
        if (task.what == "embree") {
            bench::EmbreePeer &peer = renderers.embree(task, centre);
            timed([&] { peer.render(camera, picture); });
        } else {
            ModelDrawer &drawer = renderers.model(task);
            if (const Status loaded = drawer.load(camera, {picture.width, picture.height}, Motion::moving); !loaded)
                throw std::runtime_error(task.file + ": " + loaded.error().message);
            Framebuffer &target = drawer.needs_depths() ? picture : renderers.colours();
            timed([&] { cost.drawn_points += drawer.draw(camera, target, Motion::moving).drawn_points; });
            cost.covered_pixels +=
                target.pixels() -
                static_cast<std::size_t>(std::ranges::count(target.colour, pack_rgba(RenderOptions{}.background)));
        }
    }
}

nlohmann::json measure(int rounds, Renderers &renderers, const std::vector<Task> &tasks) {
    const Task &first =
        *std::find_if(tasks.begin(), tasks.end(), [](const Task &task) { return task.what != "embree"; });
    const glm::dvec3 centre = renderers.model(first).extent().sphere.centre;
    std::vector<std::vector<Camera>> views;
    views.reserve(tasks.size());
    for (const Task &task : tasks)
        views.push_back(
            renderers.views(renderers.model(task.what == "embree" ? first : task), task.distance, task.what == "dive"));
    std::vector<Cost> costs(tasks.size());
    for (int round = -1; round < rounds; ++round) {
        if (round == 0)
            costs.assign(tasks.size(), {});
        for (std::size_t i = 0; i < tasks.size(); ++i) {
            if (tasks[i].what == "dive")
                renderers.forget_models();
            hwy::SetSupportedTargetsForTest(tasks[i].what == "avx2" ? hwy::SupportedTargets() & kOlderTargets : 0);
            draw_all(renderers, tasks[i], views[i], centre, costs[i]);
            hwy::SetSupportedTargetsForTest(0);
        }
    }
    nlohmann::json results = nlohmann::json::array();
    for (std::size_t i = 0; i < tasks.size(); ++i)
        results.push_back({{"what", tasks[i].what},
                           {"threads", tasks[i].threads},
                           {"distance", tasks[i].distance},
                           {"file", tasks[i].file},
                           {"drawn_points", costs[i].drawn_points / costs[i].frames},
                           {"covered_pixels", costs[i].covered_pixels / costs[i].frames},
                           {"milliseconds", costs[i].milliseconds},
                           {"processors", costs[i].processing / costs[i].drawing}});
    return results;
}

int run(const std::vector<std::string> &arguments) {
    std::vector<Task> tasks;
    bool model_named = false;
    for (std::size_t i = 4; i + 4 <= arguments.size(); i += 4) {
        tasks.push_back({arguments[i], std::stoi(arguments[i + 1]), std::stod(arguments[i + 2]), arguments[i + 3]});
        model_named |= arguments[i] != "embree";
    }
    if (!model_named || arguments.size() % 4 != 0) {
        std::cerr << "usage: bench_frames ROUNDS VIEWS WIDTH HEIGHT (fast|avx2|reference|dive|embree THREADS DISTANCE "
                     "FILE)...\n";
        return 1;
    }
    Renderers renderers(std::stoi(arguments[1]), std::stoi(arguments[2]), std::stoi(arguments[3]));
    std::cout << measure(std::stoi(arguments[0]), renderers, tasks) << "\n";
    return 0;
}

} // namespace

int main(int argc, char **argv) {
    use_large_pages(); // as pbm-render does
    try {
        return run({argv + 1, argv + argc});
    } catch (const std::exception &problem) {
        std::cerr << "bench_frames: " << problem.what() << "\n";
        return 1;
    }
}
