// Encodes points of a .pbvg file as a PLY file: header and rows. pbm-build reads them back as exactly the same points.
// Based on: Turk. The PLY polygon file format. 1994; Campbell. Point Based Modelling and Rendering. 2006 (materials)
#pragma once

#include "point_stream.h"

#include <string>

namespace pbm {

struct PlyFormat {
    bool ascii = false;            // else binary, little-endian
    bool single_precision = false; // coordinates as float, else double
};

// Properties of vertices:
//   x y z               double (float): the voxel's centre, model units
//   nx ny nz            float: unit vector of the normal table
//   radius              float: splat radius, model units, rounded below the radius table's value so that it
//                       is not rounded up to the next one
//   red green blue      uchar, if the file has colours
//   material_index      uchar, if points have one; likewise other streams to which kStreams gives a property
//   two_sided           uchar: 1 if both sides are visible
//   scalar_NAME         float, or double where float is not enough: the field NAME; NaN: no value
// Element material follows if the file has other materials than the default one; its property shape, uchar, is there if
// some points lie on no surface: 1 for their materials. Comments hold name, licence, credit,
// unit, up axis and grid.
class PlyPoints {
  public:
    // Points of one level. `reader` must outlive the result.
    //
    // errors  unsupported_feature  doubles cannot distinguish voxels of this size at this distance from the origin
    //         usage                the same for floats, with `single_precision`
    static Result<PlyPoints> of(const Reader &reader, int level, std::uint64_t count, PlyFormat format);

    std::string header() const;
    Bytes rows(const PointBlock &block) const; // at most row_bytes() per point; thread-safe
    std::size_t row_bytes() const;
    std::string materials() const; // follows the rows; may be empty

  private:
    PlyPoints(const Reader &reader, int level, std::uint64_t count, PlyFormat format)
        : reader_(&reader), level_(level), count_(count), format_(format) {}
    const AttributeSet &attributes() const { return reader_->parameters().attributes; }
    bool has_materials() const;
    bool has_shapes() const;
    bool has_tints() const;
    StreamList exported_bytes() const; // streams exported unchanged

    const Reader *reader_;
    int level_;
    std::uint64_t count_;
    PlyFormat format_;
};

} // namespace pbm
