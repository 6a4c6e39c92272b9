// The door of pbm::render: draws pictures of models on the CPU.
//
// A complete program that flies once round a model and reads only what each picture shows: moving_camera FILE.pbvg.
// It links pbm::render and pbm::system.
//
//   #include <pbm/render.h>
//
//   #include <cmath>
//   #include <cstdio>
//
//   int main(int argc, char **argv) {
//       const auto fail = [](const pbm::Error &error) {
//           return std::fprintf(stderr, "%s\n", error.message.c_str()), pbm::exit_code(error.code);
//       };
//       if (argc != 2)
//           return 1;
//       const auto file = pbm::MappedFile::open(argv[1]); // owns the bytes; everything below only views them
//       if (!file)
//           return fail(file.error());
//       auto reader = pbm::Reader::open(file->bytes());
//       if (!reader)
//           return fail(reader.error());
//       pbm::StreamedModel model(std::move(*reader));
//       const pbm::ModelParameters &parameters = model.reader().parameters();
//       pbm::FastRenderer renderer(parameters, model.reader().header().chunk_points, 0);
//       const auto bounds = model.bounds();
//       if (!bounds)
//           return fail(bounds.error());
//       pbm::Framebuffer picture(640, 480);
//       const pbm::UpAxis axis = parameters.grid.up;
//       const glm::dvec3 up = pbm::up_direction(axis), front = pbm::front_direction(axis);
//       for (int frame = 0; frame < 8; ++frame) {
//           const double angle = 2 * 3.14159265358979 * frame / 8;
//           pbm::Camera camera = pbm::turntable_camera(*bounds, axis, 640, 480);
//           const double distance = glm::length(camera.position - camera.focal_point);
//           const glm::dvec3 around = std::cos(angle) * front + std::sin(angle) * glm::cross(up, front);
//           camera.position = camera.focal_point + distance * (around + 0.3 * up);
//           const auto detail = model.load({.camera = camera, .width = 640, .height = 480});
//           if (!detail)
//               return fail(detail.error());
//           const auto drawn = renderer.render(detail->runs, camera, {}, picture);
//           std::printf("frame %d: %llu points\n", frame, static_cast<unsigned long long>(drawn.drawn_points));
//       }
//   }
//
// Contents
//   camera        Camera, default_camera, framed, Framebuffer    pbm_render/camera/, picture/
//                 (orthographic ones are drawn by telecentric)
//   detail        StreamedModel: the chunks that a view needs    pbm_render/detail/
//   renderers     FastRenderer, FineRenderer, ReferenceRenderer  pbm_render/fast/, fine/, reference/ (read it first)
//   surroundings  Surroundings, apply_depth_cue                  pbm_render/surroundings/, shading/
//
// Framebuffer::colour holds sRGB with straight alpha, red in the lowest byte: [height][width], top row first. Renderers
// draw a file's ground and panorama if they are constructed with a Surroundings of read_images(reader).
//
// A splat is the small disc that represents a point: one or a few pixels wide, oriented by the point's normal.
// Functions that return a Result throw nothing; all others throw at most std::bad_alloc.
//
// Stability: stable. What a header marked so declares keeps compiling until the next major version. What one marked
// experimental declares may change with a minor version. docs/reference/versions.md
#pragma once

#include "pbm_format/rasters/tiled_image.h"
#include "pbm_format/reading/load_model.h"
#include "pbm_render/camera/framing.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/shading/depth_cue.h"
#include "pbm_render/surroundings/surroundings.h"
#include "system/files/mapped_file.h"

#include <glm/geometric.hpp>
