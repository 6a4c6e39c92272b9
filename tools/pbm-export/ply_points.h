// Points of a .pbvg file as a PLY file: header and rows. pbm-build reads them back to the very same points.
// Based on: Turk. The PLY polygon file format. 1994
// Based on: Campbell. Point Based Modelling and Rendering. 2006 (element material)
#pragma once

#include "point_stream.h"

#include <string>

namespace pbm {

struct PlyFormat {
    bool ascii = false;            // else binary, little-endian
    bool single_precision = false; // coordinates as float, else double
};

// Vertices have
//   x y z               double (float): the voxel's centre, model units
//   nx ny nz            float: unit vector of the normal table
//   radius              float: of the splat, model units, a rounding step below the radius table's value, so that it is
//                       not rounded up to the next one
//   red green blue      uchar, where the file has colours
//   material_index      uchar, where points have one; so are other streams that kStreams gives a property
//   two_sided           uchar: 1 where both sides show
// and element material follows them where the file has other materials than the default one. Comments hold name,
// licence and credit, unit, up axis and grid.
class PlyPoints {
  public:
    // Of one level. Refers to `reader`.
    //
    // errors  unsupported_feature  voxels so small, at their place, that doubles cannot tell them apart
    //         usage                the same for floats, with `single_precision`
    static Result<PlyPoints> of(const Reader &reader, int level, std::uint64_t count, PlyFormat format);

    std::string header() const;
    Bytes rows(const PointBlock &block) const; // at most row_bytes() per point; safe to call from several threads
    std::size_t row_bytes() const;
    std::string materials() const; // after the rows; may be empty

  private:
    PlyPoints(const Reader &reader, int level, std::uint64_t count, PlyFormat format)
        : reader_(&reader), level_(level), count_(count), format_(format) {}
    const AttributeSet &attributes() const { return reader_->parameters().attributes; }
    bool has_materials() const;
    StreamList exported_bytes() const; // streams that are properties as they are

    const Reader *reader_;
    int level_;
    std::uint64_t count_;
    PlyFormat format_;
};

} // namespace pbm
