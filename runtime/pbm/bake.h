// The door of pbm::bake: shadows of lights, computed once and stored with the points of a model.
//
// A complete program that bakes the shadow of a sun into a copy of a model: bake_sun FILE.pbvg OUTPUT.pbvg.
// It links pbm::bake and pbm::format.
//
//   #include <pbm/bake.h>
//   #include <pbm/format.h>
//
//   #include <cstdio>
//
//   int main(int argc, char **argv) {
//       const auto fail = [](const pbm::Error &error) {
//           return std::fprintf(stderr, "%s\n", error.message.c_str()), pbm::exit_code(error.code);
//       };
//       if (argc != 3)
//           return 1;
//       const auto file = pbm::MappedFile::open(argv[1]);
//       if (!file)
//           return fail(file.error());
//       auto reader = pbm::Reader::open(file->bytes());
//       if (!reader)
//           return fail(reader.error());
//       auto model = pbm::load_model(*reader, {.max_level = reader->depth()});
//       if (!model)
//           return fail(model.error());
//       pbm::ModelParameters &parameters = model->parameters;
//       parameters.lights = {{.kind = pbm::LightKind::directional, .direction = {0.48F, -0.8F, -0.36F}}};
//       parameters.attributes.lights = 1;
//       parameters.attributes.shadow_bits = {};
//       parameters.attributes.shadow_bits[0].fill(1); // lit or not
//       model->levels.back().points.shadows = {};     // of the lights before
//       model->images.ground_lit.clear();
//       const pbm::ShadowCasters casters(*model, 0);
//       model->levels.back().points.shadows[0] = pbm::bake_light(casters, parameters.lights[0], {.maps = 1});
//       pbm::average_levels(*model, 0); // the coarser levels hold the means of the finest one
//       const auto bytes = pbm::write_model(argv[2], *model);
//       return bytes ? 0 : fail(bytes.error());
//   }
//
// Contents: bake_light (points) and bake_ground (a ground plane), with shadow maps or with rays against the faces of a
// scan (ShadowRays); lit_levels (the coarser levels of one light). Functions throw at most std::bad_alloc.
//
// Stability: stable. What a header marked so declares keeps compiling until the next major version. What one marked
// experimental declares may change with a minor version. docs/reference/versions.md
#pragma once

#include "pbm_bake/shadow_baker.h"
