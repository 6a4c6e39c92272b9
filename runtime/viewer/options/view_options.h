// The part of a command line that says which view of which model is wanted; pbm-render and pbm-view share it.
#pragma once

#include "command_line/command_line.h"
#include "command_line/progress_display.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_render/camera/camera.h"
#include "pbm_render/detail/detail_selection.h"
#include "pbm_render/reference/reference_renderer.h"
#include "viewer/options/look_options.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace pbm {
namespace command_line {
struct CommandLine;
}

inline constexpr int kMaxSamples = 64;

enum class Renderer { fast, reference };

struct ViewOptions {
    glm::ivec2 resolution{1280, 720};                         // pixels
    std::optional<glm::dvec3> position, focal_point, view_up; // model space; absent: the default camera's
    double view_angle = 30;                                   // degrees
    Renderer renderer = Renderer::fast;
    double max_error = kDefaultMaxError; // pixels
    Splats splats = Splats::ellipses;    // of the reference renderer
    LookOptions look;
    LoadOptions load;
    command_line::Verbosity verbosity = command_line::Verbosity::normal;
};

// The dissertation's switches that ask for what is in the file; `arguments` of command_line takes them.
// `more`: those of one program.
std::vector<command_line::OldSwitch> old_switches(std::initializer_list<command_line::OldSwitch> more);

// Declares the options of a view and -q, -v; the next option belongs to the group "Options". `options` must outlive the
// parsing.
void add_view_options(command_line::CommandLine &line, ViewOptions &options);

// Declares --renderer, for programs that have both.
void add_renderer_option(command_line::CommandLine &line, ViewOptions &options);

// The default camera for a picture of `size`, but for what the command line says. `bounds` is the model's bounding
// sphere, `up` the axis of its grid.
//
// errors  usage  it sees nothing
Result<Camera> choose_camera(const ViewOptions &options, const Sphere &bounds, UpAxis up, glm::ivec2 size);

// The picture of `size` that `camera` takes, no voxel larger than `max_error` pixels.
DetailView detail_view(const ViewOptions &options, const Camera &camera, glm::ivec2 size, double max_error);

// The options that make pbm-render draw this very view: every number reads back as the same double. `view_angle` in
// degrees, since the camera's radians do not.
std::string view_as_options(const Camera &camera, double view_angle, glm::ivec2 size);

// The words of the command line.
const std::string &word_of(Quality quality);
const std::string &word_of(DepthCue cue);

// The options that make it draw with these switches, each with a space in front; those that are as usual are left out.
std::string look_as_options(const LookOptions &look);

// Fails if the pictures of that resolution which a program keeps would take more than the memory granted.
//
// errors  memory
Status check_picture_memory(const ViewOptions &options);

} // namespace pbm
