// Reads glTF 2.0: JSON with buffers beside it or within, and GLB.
// Based on: Khronos Group. glTF 2.0 Specification. 2021
#pragma once

#include "pbm_scan/surface/scan_format.h"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace pbm::build {

// Reads the default scene, or the first: its nodes with their transforms, meshes of triangles, strips, fans and points.
// A mesh that several nodes show, or instances, is there several times. Skins have the pose of the nodes of their
// joints, morph targets the weights that the file gives them.
//
// Colours of points are COLOR_0 x base colour factor x base colour image, as the specification says. Materials without
// any of these but a factor become materials. Of metallic roughness the highlights are kept: ks is
// (1 - roughness) (0.1 + 0.6 metallic), the power 2 / roughness^4 - 2 within 1..1024, the environment
// 0.4 metallic (1 - roughness), the tint 1. Unlit materials show their colour as it is. Emission and occlusion of faces
// are layers of images, of one texel where the file has a factor alone; a triangle with such a layer has that of
// reflectance too.
//
// Extensions: KHR_texture_transform, KHR_mesh_quantization, KHR_materials_unlit, KHR_draco_mesh_compression,
// EXT_meshopt_compression, KHR_meshopt_compression (without version 1 of its streams), EXT_texture_webp,
// EXT_mesh_gpu_instancing, KHR_node_visibility, and of KHR_materials_pbrSpecularGlossiness the colour. A file that
// requires another one is refused; others have a line of the report.
//
// errors  bad_input            damaged or cut short; with `strict` also a dropped attribute
//         too_large            more than 2^31 - 1 vertices, or instances of many more vertices than the file has bytes
//         unsupported_feature  a required extension
//         unsupported_version  glTF 1
Result<Surface> read_gltf(const ScanFile &file, const ReadOptions &options);
bool is_gltf(std::span<const std::uint8_t> bytes);

// Its buffers and images that are files.
std::vector<NamedFile> files_of_gltf(const ScanFile &file);

} // namespace pbm::build
