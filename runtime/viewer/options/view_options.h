// Command-line options for a model and a view of it, shared by pbm-render and pbm-view.
#pragma once

#include "command_line/command_line.h"
#include "command_line/progress_display.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/detail_selection.h"
#include "pbm_render/tables/table_renderer.h"
#include "viewer/options/look_options.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace pbm {

enum class Renderer { fast, reference };

struct ViewOptions {
    glm::ivec2 resolution{1280, 720};                         // pixels
    std::optional<glm::dvec3> position, focal_point, view_up; // model space; absent: the default camera's
    double view_angle = 30;                                   // degrees
    std::string view;                                         // name of a view of the file; empty: none is asked for
    bool orthographic = false;
    ClipRegion clip; // model space
    Backs backs = Backs::automatic;
    std::optional<UpAxis> up; // absent: the grid's
    Renderer renderer = Renderer::fast;
    std::optional<double> max_error;  // pixels; absent: the default of the quality
    Splats splats = Splats::ellipses; // of --renderer reference
    LookOptions look;
    LoadOptions load;
    command_line::Verbosity verbosity = command_line::Verbosity::normal;
};

// The dissertation's switches for contents of the file, and `more` of one program, for command_line::parse().
std::vector<command_line::OldSwitch> old_switches(std::initializer_list<command_line::OldSwitch> more);

// Declares the options of a view, -q and -v, and returns to the group "Options". `options` must outlive the parsing.
void add_view_options(command_line::CommandLine &line, ViewOptions &options);

// Declares --renderer and --splats, for programs that have both renderers.
void add_renderer_option(command_line::CommandLine &line, ViewOptions &options);

// The up axis of the view: of the default camera, of a turntable, and of the lights where the file has none. Ground
// plane and panorama stay as they are in the file.
inline UpAxis up_of(const ViewOptions &options, const Grid &grid) { return options.up.value_or(grid.up); }

// Declares --drop-shadow, --scale-bar and --dpi, for programs that write pictures.
void add_finish_options(command_line::CommandLine &line, Finish &finish);

// The default camera for a picture of `size`, overridden by the command line: a camera whose position is given looks at
// the centre of the extent's sphere.
//
// errors  usage                the camera sees nothing
//         unsupported_feature  neither does the default camera: the model lies too far from the origin
Result<Camera> choose_camera(const ViewOptions &options, const Extent &extent, const Grid &grid, glm::ivec2 size);
// The same for the first frame of a turntable, which shows all of the model unless the command line has a camera.
Result<Camera> choose_turntable(const ViewOptions &options, const Extent &extent, const Grid &grid, glm::ivec2 size);

// Removes what is for one model only: camera, clip region, up axis, colours and classes.
void forget_camera(ViewOptions &options);

// The largest edge of a voxel in pictures of this size, quality and motion, pixels.
double max_error_of(const ViewOptions &options, glm::ivec2 size, Quality quality, Motion motion);

// The detail view for a picture of `size` in which no voxel is larger than `max_error` pixels.
DetailView detail_view(const ViewOptions &options, const Camera &camera, glm::ivec2 size, double max_error);

// The options that make pbm-render draw this view. Every number reads back as the same double; so the angle is that of
// `options`, in degrees, not the camera's radians.
std::string view_as_options(const Camera &camera, const ViewOptions &options, glm::ivec2 size);
// Those of the camera alone, each after a space.
std::string camera_as_options(const Camera &camera, double view_angle);

// The command line's word for a value.
const std::string &word_of(Backs backs);
const std::string &word_of(LightsFollow follow);
const std::string &word_of(Shading shading);
const std::string &word_of(Tone tone);
const std::string &word_of(Quality quality);
const std::string &word_of(DepthCue cue);
const std::string &word_of(UpAxis up);

// The options that select this look, each after a space; defaults are left out.
std::string look_as_options(const LookOptions &look);

// The options of the detail, each after a space; defaults are left out.
std::string detail_as_options(const ViewOptions &options);

// Fails if the framebuffers for this resolution exceed --max-memory.
//
// errors  memory
Status check_picture_memory(const ViewOptions &options);

} // namespace pbm
