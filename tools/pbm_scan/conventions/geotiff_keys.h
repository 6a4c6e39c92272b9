// The CRS of LAS files as GeoTIFF keys, which LAS had before WKT.
// Based on: OGC 19-008r4, GeoTIFF Standard 1.1. 2019
#pragma once

#include "pbm_scan/conventions/crs.h"
#include "system/bytes.h"

#include <string>

namespace pbm::build {

// The records LASF_Projection 34735, 34736 and 34737 of a LAS file.
struct GeotiffRecords {
    ByteView keys, numbers, texts;
};

struct GeotiffCrs {
    std::string text; // "EPSG:2263; unit US survey foot (EPSG:9003); heights EPSG:6360"; empty: the keys say nothing
    CrsFacts facts;
};

// What the keys say of projection, units and heights; damaged keys are left out.
GeotiffCrs read_geotiff(const GeotiffRecords &records);

} // namespace pbm::build
