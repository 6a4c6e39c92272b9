// The door of pbm::render: pictures of models, on the processor alone.
//
// A complete program. It flies once round a model and reads only what each picture shows: moving_camera FILE.pbvg
//
//   #include <pbm/render.h>
//
//   #include <cmath>
//   #include <cstdio>
//
//   int main(int argc, char **argv) {
//       if (argc != 2)
//           return 1;
//       const auto file = pbm::MappedFile::open(argv[1]); // owns the bytes; everything below only views them
//       if (!file)
//           return std::fprintf(stderr, "%s\n", file.error().message.c_str()), pbm::exit_code(file.error().code);
//       auto reader = pbm::Reader::open(file->bytes());
//       if (!reader)
//           return std::fprintf(stderr, "%s\n", reader.error().message.c_str()), pbm::exit_code(reader.error().code);
//       pbm::StreamedModel model(std::move(*reader));
//       pbm::FastRenderer renderer(model.reader().parameters(), model.reader().header().chunk_points, 0);
//       const auto bounds = model.bounds();
//       if (!bounds)
//           return std::fprintf(stderr, "%s\n", bounds.error().message.c_str()), pbm::exit_code(bounds.error().code);
//       pbm::Framebuffer picture(640, 480);
//       for (int frame = 0; frame < 8; ++frame) {
//           const double angle = 2 * 3.14159265358979 * frame / 8;
//           pbm::Camera camera = pbm::default_camera(*bounds, model.reader().parameters().grid.up, 640, 480);
//           const double distance = glm::length(camera.position - camera.focal_point);
//           camera.position = camera.focal_point + distance * glm::dvec3(std::sin(angle), 0.3, std::cos(angle));
//           const auto detail = model.load({.camera = camera, .width = 640, .height = 480}); // or choose() and request()
//           if (!detail)
//               return std::fprintf(stderr, "%s\n", detail.error().message.c_str()), pbm::exit_code(detail.error().code);
//           const auto drawn = renderer.render(detail->runs, camera, {}, picture);
//           std::printf("frame %d: %llu points\n", frame, static_cast<unsigned long long>(drawn.drawn_points));
//       }
//   }
//
// What it offers
//   camera        Camera, default_camera, Framebuffer            pbm_render/camera/, picture/
//   detail        StreamedModel: the chunks that a view needs    pbm_render/detail/
//   renderers     FastRenderer, FineRenderer, ReferenceRenderer  pbm_render/fast/, fine/, reference/
//   surroundings  Surroundings, add_depth_cue                    pbm_render/surroundings/, shading/
//
// A splat is the small disc as which a point is drawn: a pixel or a few wide, turned by the point's normal. Functions
// that return a Result throw nothing; all others throw std::bad_alloc at most.
#pragma once

#include "pbm_format/reading/reader.h"
#include "pbm_render/detail/streamed_model.h"
#include "pbm_render/fast/fast_renderer.h"
#include "pbm_render/fine/fine_renderer.h"
#include "pbm_render/reference/reference_renderer.h"
#include "pbm_render/shading/depth_cue.h"
#include "system/files/mapped_file.h"

#include <glm/geometric.hpp>
