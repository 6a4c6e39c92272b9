// Writes a scan of points as PLY, block by block in constant memory.
#pragma once

#include "ply_text.h"

#include "pbm-sample/points/point_scan.h"
#include "system/bytes.h"
#include "system/error.h"

#include <functional>
#include <string>

namespace pbm::sample {

struct PointPlyOptions {
    PlyEncoding encoding = PlyEncoding::binary_little_endian;
    bool normals = false;
    std::string comment; // one line
    int threads = 0;     // 0: one per processor; does not change the bytes
};

// Vertices are float x y z, float nx ny nz if `normals`, uchar red green blue; there are no faces. A vertex takes 15 or
// 27 bytes. Threads make blocks of 4,096 points; `write` gets them in order, on the calling thread. Memory: about half
// a megabyte for each of threads + 2 blocks, whatever the number of points.
//
// errors  those of `write`
Status stream_ply(const PointScan &scan, const PointPlyOptions &options, const std::function<Status(ByteView)> &write);

} // namespace pbm::sample
