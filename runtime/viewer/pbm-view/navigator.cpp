#include "navigator.h"

#include "pbm_render/camera/unit_grid.h"

namespace pbm {
namespace {

constexpr int kFirstSaved = 6; // number of a saved view, to 9

} // namespace

Result<Camera> Navigator::first_camera(const ShownModel &model, glm::ivec2 size) const {
    if (size == glm::ivec2(0))
        size = shown_.size == glm::ivec2(0) ? shown_.options.resolution : shown_.size;
    const auto choose = shown_.is_for_video ? choose_turntable : choose_camera;
    return choose(shown_.options, model.extent(), model.grid(), size);
}

void Navigator::show_model(const std::optional<Camera> &first, const std::optional<SavedView> &of_file) {
    glide_.reset();
    ViewOptions &options = shown_.options;
    if (first)
        shown_.camera = *first;
    else
        options.clip = shown_.camera.clip;
    options.view_angle = view_angle_;
    if (of_file && !options.position && !options.focal_point && !options.view_up) {
        if (first) {
            shown_.camera = of_file->camera;
            shown_.camera.clip = first->clip;
            shown_.camera.backs = first->backs;
        }
        options.view_angle = of_file->view_angle;
        options.orthographic = shown_.camera.orthographic;
    }
    if (first)
        axis_ = shown_.camera.up;
}

void Navigator::hold() {
    glide_.reset();
    if (is_usable(pictures_.camera()))
        shown_.camera = pictures_.camera();
}

void Navigator::set_camera(const Camera &camera) {
    if (!is_usable(camera) || shown_.is_recorded || shown_.is_overwritten)
        return;
    shown_.camera = camera;
    pictures_.change_view();
}

void Navigator::move_to(const Camera &camera) {
    glide_.reset();
    set_camera(camera);
}

void Navigator::set_clip(const ClipRegion &clip) {
    shown_.options.clip = clip;
    Camera camera = shown_.camera;
    camera.clip = clip;
    move_to(camera);
}

void Navigator::drag(Drag drag, glm::dvec2 offset) { move_to(after_drag(shown_.camera, steering(), drag, offset)); }

void Navigator::zoom(double notches, glm::dvec2 pixel, const std::optional<MeasuredPoint> &seen) {
    if (!shown_.has_picture())
        return;
    if (!anchor_ || anchor_->pixel != pixel || anchor_->camera != shown_.camera) {
        // The point of the surface, or else of the focal point's plane, that the camera sees under the mouse. The
        // picture may show an earlier camera: its depth is a guess then.
        const PictureSpace space = shown_.space();
        const double depth = seen ? space.place(seen->place).depth : 0;
        anchor_ = {pixel, shown_.camera, space.point(pixel, depth > 0 ? depth : space.focal_depth())};
    }
    move_to(after_wheel(shown_.camera, steering(), notches, anchor_->point));
    anchor_->camera = shown_.camera;
}

void Navigator::press(Arrow arrow, bool pressed) {
    pressed ? arrows_.press(arrow, Window::now()) : arrows_.release(arrow, Window::now());
}

void Navigator::glide_to(const Camera &camera) {
    if (!shown_.model || shown_.is_recorded || !is_usable(camera))
        return;
    if (shown_.is_for_video) // its first picture is about to be drawn
        return move_to(camera);
    glide_.emplace(shown_.camera, camera, Window::now());
}

void Navigator::reset(glm::ivec2 size) {
    if (!shown_.model)
        return;
    if (const auto camera = first_camera(*shown_.model, size))
        glide_to(*camera);
}

void Navigator::choose_view(int number) {
    if (number >= kFirstSaved)
        recall_view(number);
    else if (number == 5)
        toggle_projection();
    else if (number > 0)
        look_from(static_cast<StandardView>(number - 1));
}

void Navigator::look_from(StandardView view) {
    if (!shown_.has_picture())
        return;
    const Camera from = standard_view(view, shown_.up(), shown_.camera, shown_.model->bounds(), shown_.size);
    glide_to(framed(from, shown_.model->extent(), shown_.size.x, shown_.size.y));
}

void Navigator::fit() {
    if (shown_.has_picture())
        glide_to(framed(shown_.camera, shown_.model->extent(), shown_.size.x, shown_.size.y));
}

void Navigator::turn_up_axis(glm::ivec2 size) {
    if (!shown_.model || shown_.is_recorded)
        return;
    const UpAxis before = shown_.up();
    const UpAxis up = before == UpAxis::y ? UpAxis::z : before == UpAxis::z ? UpAxis::x : UpAxis::y;
    forget_camera(shown_.options);
    if (up != shown_.model->grid().up)
        shown_.options.up = up;
    Look look = *shown_.look;
    look.appearance.up = up;
    if (look.appearance.lights == default_lights(before) && shown_.model->parameters().lights.empty())
        look.appearance.lights = default_lights(up);
    shown_.look = std::make_shared<Look>(std::move(look));
    notices_.notify("Up axis: " + word_of(up));
    if (const auto camera = first_camera(*shown_.model, size)) {
        axis_ = camera->up;
        move_to(*camera);
    }
}

void Navigator::toggle_projection() {
    if (!shown_.model)
        return;
    Camera camera = shown_.camera;
    camera.orthographic = !camera.orthographic;
    shown_.options.orthographic = camera.orthographic;
    move_to(camera);
    notices_.notify(camera.orthographic ? "Orthographic" : "Perspective");
}

void Navigator::switch_backs() {
    if (!shown_.model)
        return;
    Camera camera = shown_.camera;
    camera.backs = shows_backs(camera, shown_.model->parameters()) ? Backs::hide : Backs::show;
    shown_.options.backs = camera.backs;
    move_to(camera);
    notices_.notify(camera.backs == Backs::show ? "Backs are shown" : "Backs are hidden: B shows them");
}

void Navigator::switch_mode() {
    mode_ = mode_ == CameraMode::orbit ? CameraMode::fly : CameraMode::orbit;
    notices_.notify(mode_ == CameraMode::orbit ? "Target camera" : "Flying camera");
}

void Navigator::save_view(int number) {
    if (!shown_.model || number < kFirstSaved)
        return;
    const Status saved = saved_views_.save(shown_.model->path(), number, {shown_.camera, shown_.options.view_angle});
    const std::string digit = std::to_string(number);
    notices_.notify(saved ? "Saved this view: " + digit + " shows it" : "View " + digit + ": " + saved.error().message,
                    !saved);
}

void Navigator::recall_view(int number) {
    if (!shown_.model)
        return;
    const auto view = saved_views_.find(shown_.model->path(), number);
    if (!view) {
        const std::string digit = std::to_string(number);
        return notices_.notify("There is no view " + digit + " of this model yet: Ctrl + " + digit + " saves one");
    }
    ViewOptions &options = shown_.options;
    options.view_angle = view->view_angle;
    options.orthographic = view->camera.orthographic;
    options.clip = view->camera.clip;
    options.backs = view->camera.backs;
    glide_to(view->camera);
}

void Navigator::follow() {
    const double now = Window::now();
    if (const glm::dvec2 steps = arrows_.take_steps(now); shown_.model && steps != glm::dvec2(0))
        move_to(after_arrows(shown_.camera, steering(), steps));
    if (!glide_)
        return;
    set_camera(glide_->at(now));
    if (glide_->is_done(now))
        glide_.reset();
}

std::optional<double> Navigator::due(double now) const { return glide_ ? now : arrows_.next_step(now); }

} // namespace pbm
