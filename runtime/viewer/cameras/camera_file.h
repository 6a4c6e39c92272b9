// Reads the cameras of glTF files, which Blender, Maya, Houdini and Unreal export, with the nodes above them and their
// animations. Nothing of the scene that they film is read.
// Based on: Khronos Group. glTF 2.0 Specification. 2021 (sections 3.5, 3.10 and 3.11); KHR_animation_pointer
#pragma once

#include "viewer/cameras/camera_path.h"

#include "system/bytes.h"
#include "system/error.h"

#include <string>

namespace pbm {

struct CameraChoice {
    std::string file, name; // name: of a node or its camera; empty: the only one
};
// "FILE.gltf", "FILE.glb" or "FILE.gltf,NAME".
//
// errors  usage
Result<CameraChoice> parse_camera_file(const std::string &text);

// The first animation of the file that moves a node wins. Reads no more than the file holds, and no JSON above 64 MiB.
//
// errors  usage                no camera, several without a name, or none of this name
//         io                   the file, or one that it names, cannot be read
//         bad_input            damaged
//         unsupported_version  glTF 1
//         unsupported_feature  animations that are compressed
Result<CameraPath> read_camera(const CameraChoice &choice);
// The same of a file in memory; it may name others beside `choice.file`.
Result<CameraPath> parse_camera(ByteView file, const CameraChoice &choice);

} // namespace pbm
