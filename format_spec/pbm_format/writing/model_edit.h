// Edits what a file says beside its points: materials, lights, up axis, unit, palettes, metadata, and the shadows of
// lights that were moved. BVG.md 3, 8.1 and 11.2
//
//   ModelEdit edit(reader);
//   edit.parameters.lights[0].intensity = {2, 2, 2};
//   const Status saved = edit_model("lion.pbvg", edit);
// Stability: stable.
#pragma once

#include "pbm_format/model/model.h"
#include "pbm_format/reading/reader.h"

#include <string>
#include <vector>

namespace pbm {

// The shadows of one light, for the place that the edit gives it.
struct FreshShadows {
    std::size_t light = 0; // index of a light with a shadow stream
    Bytes finest;          // [points of the finest level]: 0..2^bits - 1, with the bits of the file
    Image ground;          // lit fractions x 255; in a file with such rasters, of the size of the light's own
};

struct ModelEdit {
    // Starts with what the file says.
    explicit ModelEdit(const Reader &reader) : parameters(reader.parameters()), metadata(reader.metadata()) {}

    // The attributes, the number of materials, their shapes and tints, and the grid but for unit and up axis stay those
    // of the file, and so do textures and ground plane but for their palettes.
    ModelParameters parameters;
    std::string metadata;
    std::vector<FreshShadows> shadows;
};

struct EditOptions {
    int threads = 0;
    std::uint64_t max_memory = kDefaultMaxMemory; // bytes of decoded streams and rasters; content_id covers all points
};

// Returns the edited file. Without new shadows all sections but the small ones are those of `file`, byte for byte; with
// them the chunks are encoded anew, with the same chunk limit and storage. Optional feature bits and sections that this
// version does not know are left out, as BVG.md 11.2 asks.
//
// errors  usage        the edit changes what it may not, such as the number of materials
//         bad_section  a value that a reader would refuse
//         memory       more than `max_memory`
//         and those of load_model: the file is damaged
Result<Bytes> edited_model(ByteView file, const ModelEdit &edit, const EditOptions &options = {});

// Replaces the file `path` by the edited one, atomically, after verifying it as a whole. `opened`: the header of the
// file as the caller has read it, its first 128 bytes. Returns the header of the new file.
//
// errors  as edited_model
//         io  another program has changed the file since, it is read-only, or it cannot be replaced
Result<Bytes> edit_model(const std::string &path, ByteView opened, const ModelEdit &edit,
                         const EditOptions &options = {});

} // namespace pbm
