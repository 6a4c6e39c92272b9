// Samples of a surface: one per pair of a triangle and a voxel that it passes through, and one per point. The pairs are
// found first (2 to 10 bytes each); their attributes are computed when the voxel is averaged.
#pragma once

#include "pbm_build/fields/field_choice.h"
#include "pbm_build/images/texture_pyramid.h"
#include "pbm_build/lattice/lattice.h"
#include "pbm_build/surface/vertex_normals.h"
#include "pbm_build/voxels/hit_store.h"
#include "pbm_build/voxels/sample.h"
#include "pbm_build/voxels/triangle_columns.h"
#include "pbm_format/model/model.h"
#include "pbm_scan/surface/surface.h"

#include <functional>
#include <span>

namespace pbm::build {

// A surface on the lattice of a grid. Its sources are its triangles, then its points. Refers to its arguments. Safe to
// use from several threads.
class SurfaceSampler {
  public:
    // `images`: those of the surface. `radii`: radius index per position, or empty. `fields`: of the positions.
    SurfaceSampler(const Surface &surface, std::span<const TexturePyramid> images, const VertexNormals &normals,
                   const Bytes &radii, std::span<const FieldSamples> fields, const Grid &grid, int threads)
        : surface_(surface), images_(images), normals_(normals), radii_(radii), fields_(fields),
          lattice_(to_lattice(surface.positions, grid, threads)) {}

    std::span<const FieldSamples> fields() const { return fields_; }
    std::size_t source_count() const { return surface_.triangles.size() + surface_.point_count(); }

    // False: source `i` passes through no voxel from `first` up to `last`, that excluded. True: it may.
    bool may_touch(std::size_t i, MortonCode first, MortonCode last) const;
    // The voxel of the first corner of source `i`.
    MortonCode first_voxel(std::size_t i) const;
    // Adds every voxel that source `i` passes through. `codes` is scratch memory.
    void find_hits(std::size_t i, int writer, HitStore &store, SmallTriangleCodes &codes) const;

  private:
    friend class SampleCursor;
    // Place and attributes of a corner.
    struct Corner {
        LatticePoint at;
        Sample attributes;
        std::uint8_t number = 0; // in its triangle
    };
    bool is_triangle(std::size_t source) const { return source < surface_.triangles.size(); }
    std::size_t vertex_of_point(std::size_t source) const {
        return surface_.first_point() + (source - surface_.triangles.size());
    }
    Corner corner(std::size_t vertex) const;
    FaceColour colour_of_face(std::size_t triangle) const {
        return surface_.face_colours.empty() ? FaceColour{} : surface_.face_colours[triangle];
    }
    // Null: the triangle has no image.
    const TexturePyramid *image_of(std::size_t triangle) const { return image_of(surface_.texture_ids, triangle); }
    const TexturePyramid *image_of(const std::vector<std::uint16_t> &ids, std::size_t triangle) const {
        const std::uint16_t id = ids.empty() ? Surface::kNoTexture : ids[triangle];
        return id == Surface::kNoTexture ? nullptr : &images_[id];
    }

    const Surface &surface_;
    std::span<const TexturePyramid> images_;
    const VertexNormals &normals_;
    const Bytes &radii_;
    std::span<const FieldSamples> fields_;
    std::vector<LatticePoint> lattice_;
};

// Triangles: every voxel that a triangle passes through gets a sample, so the occupied voxels cover the surface for any
// mesh. A sample has the attributes at the triangle's point nearest to the voxel's centre, or at the centroid of a
// triangle within one voxel. Samples of a triangle with a corner without a normal take that of its plane. Vertices
// without a triangle are omitted.
//
// Points: one sample each.
//
// range     of the store's buckets: sources that touch none of them are left out
// progress  called with 0..1, from any thread, one call at a time; may be empty
// errors    memory     more hits than `store` takes
//           too_large  more than kMaxSources triangles or points
Status sample_points(const SurfaceSampler &sampler, HitStore &store, const BucketRange &range,
                     const std::function<void(double)> &progress = {});

} // namespace pbm::build
