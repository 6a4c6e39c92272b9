// Headers of LAS and LAZ files: versions 1.0 to 1.5, point formats 0 to 10.
// Based on: ASPRS. LAS Specification 1.4 - R15. 2019
#pragma once

#include "pbm_scan/conventions/geotiff_keys.h"
#include "system/bytes.h"
#include "system/error.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace pbm::build {

// Where the fields of a point format lie; 0: it has none.
struct PointFormat {
    std::size_t size, time, colour, infrared, wave;
    bool is_new; // 6 to 10: flags and classes have bytes of their own
};

struct LasHeader {
    const PointFormat *format = nullptr;
    std::size_t first = 0;  // byte of the file at which the points begin, at most its size
    std::size_t stride = 0; // bytes of a record, at least format->size
    std::uint64_t announced = 0;
    bool has_records_behind = false; // behind the points
    glm::dvec3 scale{1}, offset{0}, lowest{0}, highest{0};
    std::string crs; // WKT, or the GeoTIFF keys as a text
    CrsFacts crs_facts;
    std::vector<std::string> other_records; // "user 123" of records that nothing is made of
    bool has_index = false;                 // records that only say where points are
    bool has_superseded = false;            // records that a later one replaces
    std::uint64_t lost_records = 0;         // announced ones that are not there or cut short
    ByteView extra_bytes;                   // descriptions of the bytes behind the fields of the format; 192 bytes each
    bool is_compressed = false;             // LAZ
    ByteView laz_record;                    // what the record "laszip encoded" holds; empty without one
    std::uint64_t laz_offset = 100;         // of laz_record; without one, of the number of records
};

// errors  bad_input            the header is damaged, cut short or contradicts itself
//         unsupported_version  neither LAS 1.0 to 1.4 nor LAS 1.5
//         unsupported_feature  compressed before LASzip 1.0
Result<LasHeader> read_las_header(ByteView file);

} // namespace pbm::build
