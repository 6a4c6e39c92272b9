// PBM from C, and from every language that calls C: opens, reads, draws, validates and builds binary voxel grids
// (.pbvg). C99 and C++.
//
// A complete program that draws a model as a PPM picture: draw_model FILE.pbvg PICTURE.ppm.
// It links libpbm: cc draw_model.c $(pkg-config --cflags --libs pbm)
//
//   #include <pbm/pbm.h>
//
//   #include <stdio.h>
//
//   enum { WIDTH = 640, HEIGHT = 480 };
//   static uint8_t pixels[HEIGHT][WIDTH][4];
//
//   static int fail(const pbm_error *error) {
//       fprintf(stderr, "%s\n", error->message);
//       return error->code;
//   }
//
//   int main(int argc, char **argv) {
//       pbm_error error;
//       pbm_model *model;
//       pbm_camera camera = PBM_NEW(pbm_camera);
//       pbm_picture picture = PBM_NEW(pbm_picture);
//       FILE *file;
//       if (argc != 3) {
//           fprintf(stderr, "usage: draw_model FILE.pbvg PICTURE.ppm\n");
//           return PBM_USAGE;
//       }
//       if (pbm_open_file(argv[1], &model, &error) != PBM_OK)
//           return fail(&error);
//       picture.width = WIDTH;
//       picture.height = HEIGHT;
//       picture.pixels = &pixels[0][0][0];
//       picture.pixel_bytes = sizeof pixels;
//       if (pbm_default_camera(model, WIDTH, HEIGHT, &camera, &error) != PBM_OK ||
//           pbm_render(model, &camera, NULL, &picture, &error) != PBM_OK)
//           return fail(&error);
//       pbm_close(model);
//       file = fopen(argv[2], "wb");
//       if (file == NULL)
//           return PBM_IO;
//       fprintf(file, "P6 %d %d 255\n", WIDTH, HEIGHT);
//       for (int y = 0; y < HEIGHT; ++y)
//           for (int x = 0; x < WIDTH; ++x)
//               fwrite(pixels[y][x], 1, 3, file);
//       return fclose(file) == 0 ? PBM_OK : PBM_IO;
//   }
//
// Contents
//   opening     pbm_open_file, pbm_open_private, pbm_open_memory, pbm_open_ranges; pbm_close
//   asking      pbm_get_info, pbm_get_field
//   points      pbm_count_points, pbm_read_points; pbm_count_sides, pbm_read_sides
//   pictures    pbm_default_camera, pbm_render
//   validating  pbm_validate_file, pbm_validate_memory
//   building    pbm_new_builder, pbm_set_option, pbm_set_progress, pbm_add_file, pbm_add_arrays, pbm_build,
//               pbm_cancel_build, pbm_get_report, pbm_free_builder
//
// Every function but pbm_version returns a pbm_code: PBM_OK, or why it failed. A failed call changes nothing that the
// caller gave, but for the contents of arrays and pixels. Its last parameter takes the details, and may be null.
//
// Structures that the caller fills begin with their size, so that later versions may add members at the end:
// initialise them with PBM_NEW. A member of zero then asks for its default.
//
// Handles are numbers in the guise of pointers: they are never dereferenced and never used again. A null pointer, the
// handle of another kind, or one that was closed is PBM_USAGE. Null pointers are refused wherever this file does not
// allow them, and arrays whose number of elements is too small; where an array is shorter than the caller says, the
// behaviour is undefined, as everywhere in C.
//
// Threads: every function may be called from any thread. Calls with the same handle wait for each other; others run at
// the same time. A callback must not call a function with the handle that it was given to, which is PBM_USAGE. The
// library starts threads of its own as `threads` allow: 0 means one per processor, at most 64. Results do not depend on
// their number.
//
// The library prints nothing, never ends the process, and lets no C++ exception out; memory that runs out is PBM_LIMIT,
// unless not even the few hundred bytes of a builder's JSON can be allocated, which ends the process (std::terminate).
// A file that pbm_open_file has opened, or that pbm_validate_file or pbm_build is reading, must not be cut short by
// others, as by a program that copies another file over it: the system then ends the process (SIGBUS), as it does with
// every mapped file. pbm_open_private, pbm_open_memory and pbm_open_ranges map no file. Names of files and texts are
// UTF-8, and end with a zero byte. Coordinates are right-handed; angles are radians; colours are sRGB.
//
// Stability: stable. Functions are never removed or changed as long as the library is libpbm.so.1, which keeps programs
// compiling and linked programs running. Each function carries the version in which it came (PBM_1.0).
#ifndef PBM_PBM_H
#define PBM_PBM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define PBM_API __attribute__((visibility("default")))
#else
#define PBM_API
#endif

// Initialises a structure that begins with its size: pbm_camera camera = PBM_NEW(pbm_camera);
#ifdef __cplusplus
#define PBM_NEW(type) (pbm_sized<type>())
#else
#define PBM_NEW(type) ((type){.struct_size = sizeof(type)})
#endif

// "1.0.0": the version of the library.
PBM_API const char *pbm_version(void);

// The exit codes of all programs (docs/reference/exit-codes.md), and two more.
typedef enum pbm_code {
    PBM_OK = 0,
    PBM_USAGE = 1,       // the call is wrong
    PBM_IO = 2,          // the system did not read or write a file
    PBM_INVALID = 3,     // invalid or damaged input
    PBM_LIMIT = 4,       // memory, or another limit of the running program
    PBM_UNSUPPORTED = 5, // unsupported version or feature
    PBM_CANCELLED = 6,   // a callback or another thread asked for it
    PBM_PENDING = 7      // bytes have not arrived yet: a callback returned PBM_LATER
} pbm_code;

#define PBM_NO_OFFSET UINT64_MAX

// Texts are cut where they do not fit.
typedef struct pbm_error {
    pbm_code code;
    uint64_t offset;   // byte of the file, or PBM_NO_OFFSET
    char name[48];     // of the fault in docs/reference/validator-codes.md, "octree.empty_mask", or empty
    char rule[16];     // of BVG.md, "4.2", or empty
    char message[512]; // one line
} pbm_error;

typedef struct pbm_model pbm_model;

// Reads header and small sections, and maps the file.
//
// errors  PBM_IO, PBM_INVALID, PBM_UNSUPPORTED
PBM_API pbm_code pbm_open_file(const char *path, pbm_model **model, pbm_error *error);

// The same, but reads all of the file into memory now and maps nothing: for a process that must go on if the file is
// cut short, written over or removed later. Costs memory of the file's size for as long as the model is open, and the
// time to read it, about 1 s for 2 GB that the system has in its cache; the model of a mapped file has opened once 64
// KB were read. A file that changes while it is read is PBM_INVALID. Where files are too large for that,
// pbm_open_ranges with a function that calls pread reads what each call needs.
PBM_API pbm_code pbm_open_private(const char *path, pbm_model **model, pbm_error *error);

// `bytes` must stay readable and unchanged until the model is closed. They are used where they lie if their address is
// a multiple of 8, as it is of what malloc returns; else they are copied.
PBM_API pbm_code pbm_open_memory(const void *bytes, uint64_t size, pbm_model **model, pbm_error *error);

// Copies `size` bytes from `offset` on to `to`; all of them lie inside the file. Returns 0; PBM_LATER if they have not
// arrived yet; or anything else if it cannot, which makes the call that needs them fail with PBM_IO.
typedef int (*pbm_read_range)(void *context, uint64_t offset, uint64_t size, void *to);

// What a pbm_read_range returns to whom must not wait, such as a web page. The call then asks for all other ranges that
// it knows it needs, most urgent first. pbm_render draws what it can; every other function fails with PBM_PENDING, and
// is called again once these ranges are there.
enum { PBM_LATER = 7 };

// A file of `size` bytes of which only what a call needs is read, as from a server that answers range requests. `read`
// is called by the thread that calls a function with this model. Ranges may be read again.
PBM_API pbm_code pbm_open_ranges(pbm_read_range read, void *context, uint64_t size, pbm_model **model,
                                 pbm_error *error);

// Waits until calls of other threads with this model have ended. Null does nothing.
PBM_API pbm_code pbm_close(pbm_model *model);

// Bits of pbm_info.attributes. All points have a normal and a radius.
enum {
    PBM_HAS_COLOURS = 1,
    PBM_HAS_MATERIALS = 2, // an index per point
    PBM_HAS_TEXTURE = 4,   // marble or wood
    PBM_HAS_SHADOWS = 8,
    PBM_HAS_GROUND = 16,
    PBM_HAS_PANORAMA = 32,
    PBM_IS_CLOSED = 64, // its surface bounds volumes, and normals point out of them: from outside no back is visible
    PBM_HAS_ROUND_POINTS = 128, // some points lie on no surface: pbm_points.round
    PBM_HAS_SIDES = 256,        // some points stand for both sides of a thin wall: pbm_read_sides
    PBM_HAS_OFFSETS = 512       // it says where the surface lies within some voxels, and pictures show it there
};

typedef struct pbm_info {
    size_t struct_size;
    uint64_t file_bytes;
    uint64_t points; // of the finest level
    int32_t depth;   // levels are 0, a single point, .. depth, the finest one
    uint32_t attributes;
    double origin[3];     // minimum corner of the grid, model units
    double voxel_size;    // edge of a finest voxel, model units; 2^(depth - L) times as much at level L
    double lowest[3];     // box around the occupied voxels of level 6, or of the finest one: the points lie inside,
    double highest[3];    // and it is at most 1/64 of the grid's edge too large on each side
    const char *unit;     // of the model: "m", "mm", "cm", "in", "ft", "km" or "unknown"
    const char *up;       // "+y", "+z" or "+x"
    const char *metadata; // a JSON object
    char content_id[33];  // 128 bits, hexadecimal: models with the same one hold the same points and scene
    int32_t fields;       // scalar fields
    int32_t materials;
    int32_t lights;
} pbm_info;

// Texts of `info` live until the model is closed.
PBM_API pbm_code pbm_get_info(pbm_model *model, pbm_info *info, pbm_error *error);

// A scalar field: a measurement of the points, such as their intensity or class.
typedef struct pbm_field {
    size_t struct_size;
    const char *name;
    const char *unit;    // may be empty
    double lowest;       // value of the lowest stored number
    double step;         // between values of two stored numbers
    int32_t bits;        // of a stored number: 8 or 16
    const char *average; // how coarser levels get theirs: "mean", "majority" or "max"
} pbm_field;

// Texts of `field` live until the model is closed. `index`: 0 .. pbm_info.fields - 1.
PBM_API pbm_code pbm_get_field(pbm_model *model, int32_t index, pbm_field *field, pbm_error *error);

// Reads the directory of the level, and no points. `level`: 0 .. depth.
PBM_API pbm_code pbm_count_points(pbm_model *model, int32_t level, uint64_t *points, pbm_error *error);

// Where to write the points of a level, one after the other in Morton order. Null arrays are left out, and what only
// they need is not computed.
typedef struct pbm_points {
    size_t struct_size;
    uint64_t capacity;    // points that every array has room for
    double *positions;    // [capacity][3] model units: centres of the voxels
    float *positions_f32; // [capacity][3] the same in single precision, less `offset`
    double offset[3];     // subtracted from positions_f32 before rounding; 0: nothing
    float *normals;       // [capacity][3] unit length
    uint8_t *colours;     // [capacity][3] sRGB; of their material, where the model has no colours
    float *radii;         // [capacity] model units: of the disc that closes the gaps to the neighbours
    uint8_t *materials;   // [capacity] index
    uint8_t *two_sided;   // [capacity] 1: the point shows both of its sides
    float *const *fields; // [field_count] arrays of [capacity] values, or null; NaN: the point has no value
    int32_t field_count;  // at most pbm_info.fields
    int32_t threads;
    uint8_t *round; // [capacity] 1: the point lies on no surface: a disc of its radius that faces the eye, no normal
} pbm_points;

// Writes all points of a level. `written` takes their number and may be null.
//
// errors  PBM_USAGE    the arrays are too short: the message says how many points there are
//         PBM_INVALID  the file is damaged
PBM_API pbm_code pbm_read_points(pbm_model *model, int32_t level, const pbm_points *points, uint64_t *written,
                                 pbm_error *error);

// Points of a level that stand for both sides of a thin wall (BVG.md 19). pbm_read_points gives the means of the two
// sides, as the file has them for readers that know no sides. Arrays may be null.
typedef struct pbm_sides {
    size_t struct_size;
    uint64_t capacity;  // points that every array has room for
    uint64_t *points;   // [capacity] index in the arrays of pbm_read_points, ascending
    float *normals;     // [capacity][2][3] unit length
    uint8_t *colours;   // [capacity][2][3] sRGB; of their material, where the model has no colours
    uint8_t *materials; // [capacity][2] index
} pbm_sides;
// The number of such points: decodes them. `level`: 0 .. depth.
PBM_API pbm_code pbm_count_sides(pbm_model *model, int32_t level, uint64_t *points, pbm_error *error);
PBM_API pbm_code pbm_read_sides(pbm_model *model, int32_t level, const pbm_sides *sides, uint64_t *written,
                                pbm_error *error);

// Bits of pbm_camera.clip.
enum { PBM_CLIP_PLANE = 1, PBM_CLIP_BOX = 2 };

// Whether points that face away from the eye are drawn. PBM_BACKS_AUTO: unless the file says that its surface is
// closed, and the eye is outside of the grid's cube; then no back can be seen. Without backs one sees into rooms from
// outside.
typedef enum pbm_backs { PBM_BACKS_AUTO = 0, PBM_BACKS_SHOWN = 1, PBM_BACKS_HIDDEN = 2 } pbm_backs;

// A pinhole camera, or an orthographic one that sees as much of the focal point's plane. Lengths are model units.
typedef struct pbm_camera {
    size_t struct_size;
    double position[3];
    double focal_point[3]; // in the middle of the picture
    double up[3];          // of any length, not along the line of sight
    double view_angle;     // vertical, radians, above 0 and below pi; 0: 30 degrees
    int32_t orthographic;  // 0 or 1
    uint32_t clip;         // what to cut open with
    double plane_point[3];
    double plane_normal[3]; // leads to the side that is kept; of any length
    double box_lowest[3];
    double box_highest[3]; // what lies inside is kept
    int32_t backs;         // pbm_backs
} pbm_camera;

// A camera in front of the model that sees all of it in a picture of this size (pixels, 1 .. 32768).
PBM_API pbm_code pbm_default_camera(pbm_model *model, int32_t width, int32_t height, pbm_camera *camera,
                                    pbm_error *error);

// `fine` blends points into a smooth surface and smooths edges; it takes about ten times as long.
typedef enum pbm_quality { PBM_FAST = 0, PBM_FINE = 1 } pbm_quality;

// Screen-space shading that shows the shape of models without colours. PBM_NO_CUE: eye-dome lighting for clouds of
// points whose scan has neither faces, nor colours, nor normals; none for other models. PBM_CUE_OFF: none for any
// model.
typedef enum pbm_depth_cue {
    PBM_NO_CUE = 0,
    PBM_EYE_DOME = 1,
    PBM_AMBIENT_OCCLUSION = 2,
    PBM_CUE_OFF = 3
} pbm_depth_cue;

// What lights stay with when the camera moves. By default those of the file stay with the model, and a model without
// lights is lit from beside the eye. Lights that follow the eye cast no shadows.
typedef enum pbm_light_follows { PBM_LIGHTS_DEFAULT = 0, PBM_LIGHTS_EYE = 1, PBM_LIGHTS_MODEL = 2 } pbm_light_follows;

// How points take light. PBM_SHADING_AUTO: a model without lights of its own whose points have more than one colour
// takes a soft light, under which a surface that faces the eye keeps its colour; everything else is lit. PBM_UNLIT: the
// colours alone.
typedef enum pbm_shading { PBM_SHADING_AUTO = 0, PBM_LIT = 1, PBM_UNLIT = 2 } pbm_shading;

// Colours of a field's values. viridis: dark violet over green to yellow; grey: black to white; classes: a colour for
// each label, that of maps for the classes of LAS. PBM_MAP_AUTO: classes for a field whose average is "majority" if no
// range is given; grey for intensities without a range, brightened until their median is a middle grey; else viridis.
typedef enum pbm_colour_map {
    PBM_MAP_AUTO = 0,
    PBM_MAP_VIRIDIS = 1,
    PBM_MAP_GREY = 2,
    PBM_MAP_CLASSES = 3
} pbm_colour_map;

// Bits of pbm_render_options.flags.
enum {
    PBM_BACKGROUND = 1, // use `background`; else 51, 51, 51, 255
    PBM_NO_TEXTURE = 2, // leave these out
    PBM_NO_COLOURS = 4, // draw points in the colours of their material
    PBM_NO_SHADOWS = 8, // every light reaches every point
    PBM_NO_GROUND = 16,
    PBM_NO_PANORAMA = 32,
    PBM_NO_REFLECTIONS = 64,
    PBM_HEADLIGHT = 128, // use `headlight`, in place of all other lights
    PBM_NO_LEGEND = 256, // which says what the colours of `colour_by` mean
    PBM_GRADIENT = 512   // from `background` at the upper edge to `background_below` at the lower one
};

typedef struct pbm_render_options {
    size_t struct_size;
    int32_t quality;   // pbm_quality
    int32_t samples;   // per pixel of fine pictures, 1 .. 256; default 8; where one is enough, one is taken
    int32_t depth_cue; // pbm_depth_cue
    uint32_t flags;
    uint8_t background[4]; // red, green, blue, alpha
    int32_t finest_level;  // do not draw finer levels than this one; default: all
    double max_error;      // pixels: largest edge of a drawn voxel that has children; default 2, of fine pictures 1.42,
                           // and less if they are smaller than 1280x720
    int32_t threads;
    uint64_t max_memory;    // bytes of decoded points that are kept, for this picture and the next ones; default 8 GiB
    int32_t light_follows;  // pbm_light_follows
    double colour_range[2]; // values with the first and the last colour, ascending; both 0: most values lie between
    double headlight[2];    // where its light comes from: radians to the right of the eye, -pi .. pi, and above it,
                            // -pi/2 .. pi/2. It follows the camera
    // What points have the colours of, with a legend: the name of a field, "class" or "return" (the fields
    // "classification" and "return_number"); or, unless a field is called so, "height" along the up axis, "normal", or
    // "plain": their material. Null or empty: what the model has, or "height" where PBM_NO_CUE is eye-dome lighting
    const char *colour_by;
    int32_t colour_map; // pbm_colour_map
    // Classes of points that are left out, and those that are drawn alone: numbers and names of LAS with commas between
    // them, "noise,ground,31", of the field "classification" or "class". Null or empty: all are drawn
    const char *drop_class;
    const char *show_class;
    int32_t shading; // pbm_shading
    uint8_t background_below[4];
} pbm_render_options;

typedef struct pbm_picture {
    size_t struct_size;
    int32_t width, height; // pixels, 1 .. 32768
    uint8_t *pixels;       // [height][stride] bytes, top row first: red, green, blue, alpha (straight)
    size_t pixel_bytes;    // size of `pixels`
    size_t stride;         // bytes from a row to the next one; default 4 x width
    float *depths;         // [height][depth_stride] or null: distances along the view, model units; infinity: nothing
    size_t depth_count;    // elements of `depths`
    size_t depth_stride;   // elements from a row to the next one; default `width`
} pbm_picture;

// Draws a picture; reads what it shows, and keeps that in memory for the next ones. `options` may be null. With other
// values of `threads`, `max_memory`, the classes or the colours of a field than in the last call it reads everything
// anew. A fine picture that differs from the last one in nothing but a larger number of samples draws only those that
// it has more: first 1 sample and then 8 take as long as 8 at once.
//
// Of a file whose callback returned PBM_LATER during the call, the picture shows what is there: coarser levels, points
// without the colours of a field, or the background alone. It is exact if PBM_OK is returned and no callback returned
// PBM_LATER.
//
// errors  PBM_USAGE    the camera has no line of sight or is not finite; the arrays are too short; no such field or
// class
//         PBM_INVALID  a part of the file that this picture or an earlier one needed is damaged: the first part that
//                      was found. The picture is drawn all the same, with coarser levels in place of damaged ones
//         PBM_LIMIT    the picture needs more than `max_memory`: it is drawn with what fits. With a larger `max_error`
//                      it needs less
PBM_API pbm_code pbm_render(pbm_model *model, const pbm_camera *camera, const pbm_render_options *options,
                            const pbm_picture *picture, pbm_error *error);

typedef enum pbm_validation_level {
    PBM_VALIDATE = 0,       // every rule of points, images and tree
    PBM_VALIDATE_QUICK = 1, // header and section table: milliseconds
    PBM_VALIDATE_DEEP = 2   // also the averages of coarser levels, and advice
} pbm_validation_level;

typedef enum pbm_severity { PBM_INFO = 0, PBM_WARNING = 1, PBM_ERROR = 2 } pbm_severity;

typedef struct pbm_finding {
    int32_t severity;    // pbm_severity; only errors make a file invalid
    pbm_code code;       // of an error
    uint64_t offset;     // byte of the file
    const char *name;    // in docs/reference/validator-codes.md: "octree.empty_mask"
    const char *rule;    // of BVG.md: "4.2"; empty for advice
    const char *section; // "header", "level 7 chunks", ..
    const char *message; // one line
    const char *remedy;  // one line
} pbm_finding;

// Called for each finding, in the order of the file, by the thread that validates. The finding is gone afterwards.
// Returns 0, or anything else to hear of no further one, which makes the call return PBM_CANCELLED.
typedef int (*pbm_report_finding)(void *context, const pbm_finding *finding);

typedef struct pbm_validation {
    size_t struct_size;
    int32_t level; // pbm_validation_level
    int32_t threads;
    uint64_t max_findings;     // default 100
    pbm_report_finding report; // may be null
    void *context;             // of `report`
    // Filled by the call:
    pbm_code verdict;                 // PBM_OK: the file is valid; else the exit code of the gravest error
    uint64_t errors, warnings, infos; // also those beyond max_findings
    uint64_t points;                  // verified
} pbm_validation;

// Return PBM_OK if there is a verdict, whatever it is.
PBM_API pbm_code pbm_validate_file(const char *path, pbm_validation *validation, pbm_error *error);
PBM_API pbm_code pbm_validate_memory(const void *bytes, uint64_t size, pbm_validation *validation, pbm_error *error);

// A builder collects options and scans, then builds a model of them: of files, or of arrays.
typedef struct pbm_builder pbm_builder;

PBM_API pbm_code pbm_new_builder(pbm_builder **builder, pbm_error *error);

// Waits until calls of other threads have ended. Null does nothing.
PBM_API pbm_code pbm_free_builder(pbm_builder *builder);

// An option of pbm-build that decides what is in the model, by its long name without dashes: "depth", "9" or "strict",
// null (docs/reference/pbm-build.md; topics Input, Measurements, Mesh, Grid, Lights, Materials, Surroundings, Output),
// or "recipe" (a TOML file with such options), or "threads". `value` is null or "true" for flags; "false" leaves a flag
// out. Lists of "light", "material", "field" and "viewpoint" are given one by one. Of arrays "pose", "columns" and
// "input-format" are refused. pbm_build verifies options, all of them together.
PBM_API pbm_code pbm_set_option(pbm_builder *builder, const char *key, const char *value, pbm_error *error);

// Called as a build goes on: `step` is its name, `done` is 0 .. 1 of this step. Calls come from any thread, one at a
// time. Returns 0, or anything else to cancel: pbm_build then returns PBM_CANCELLED as soon as the step lets it. The
// last call that can cancel comes directly before the output is replaced, with the step "write".
typedef int (*pbm_report_progress)(void *context, const char *step, double done);

// `report` may be null: no calls.
PBM_API pbm_code pbm_set_progress(pbm_builder *builder, pbm_report_progress report, void *context, pbm_error *error);

// A scan of any format that pbm-build reads. It is opened by pbm_build.
PBM_API pbm_code pbm_add_file(pbm_builder *builder, const char *path, pbm_error *error);

// A scan in arrays, which are copied. Null: the scan has no such attribute.
typedef struct pbm_arrays {
    size_t struct_size;
    uint64_t vertex_count;             // 1 .. 2^31 - 1
    const double *positions;           // [vertex_count][3]: these
    const float *positions_f32;        // or these
    const float *normals;              // [vertex_count][3] of any length; 0, 0, 0: none here
    const uint8_t *colours;            // [vertex_count][3] sRGB
    const float *radii;                // [vertex_count] of splats, units of the positions; 0: none here
    const uint8_t *materials;          // [vertex_count] 0 .. 7: numbers of the options "material"
    uint64_t face_count;               // 0: a cloud of points
    const uint32_t *faces;             // [face_count][3] vertices, counter-clockwise from outside
    int32_t field_count;               // 0 .. 8
    const char *const *field_names;    // [field_count], each 1 .. 32 bytes
    const char *const *field_units;    // [field_count], or null
    const double *const *field_values; // [field_count] arrays of [vertex_count]; NaN: no value. All are kept; the
                                       // option "field" with the same name says how
} pbm_arrays;

// errors  PBM_USAGE  an array is missing, a face names a vertex that is not there
PBM_API pbm_code pbm_add_arrays(pbm_builder *builder, const pbm_arrays *arrays, pbm_error *error);

// Builds a model of all scans, which the builder then forgets; it keeps the options. Writes it to the file `output`,
// replacing an old one in one step once the new one is verified, and opens it as `*model`. Either may be null, not
// both: without a file the model is in memory alone. The same scans and options give the same bytes as pbm-build.
//
// errors  as pbm-build, and PBM_CANCELLED; an old output stays as it was
PBM_API pbm_code pbm_build(pbm_builder *builder, const char *output, pbm_model **model, pbm_error *error);

// Cancels the build that runs with this builder, or else the next one: pbm_build returns PBM_CANCELLED, mostly within a
// tenth of a second. May be called from any thread, and does not wait. The output is replaced all the same if that has
// begun.
PBM_API pbm_code pbm_cancel_build(pbm_builder *builder);

// What became of each attribute in the last build that succeeded, and its figures: the JSON of pbm-build --json. The
// text lives until the next build, or until the builder is freed.
PBM_API pbm_code pbm_get_report(pbm_builder *builder, const char **json, pbm_error *error);

#ifdef __cplusplus
} // extern "C"

template <class Structure> inline Structure pbm_sized() {
    Structure structure = Structure();
    structure.struct_size = sizeof(Structure);
    return structure;
}
#endif

#endif
