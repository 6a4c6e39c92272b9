// What the text of a coordinate reference system (CRS) says of coordinates.
#pragma once

#include "pbm_format/model/model.h"

#include <string>
#include <string_view>

namespace pbm::build {

enum class CrsKind : std::uint8_t {
    unknown,
    projected,  // a map: x to the east, y to the north
    geographic, // degrees of longitude and latitude
    geocentric, // from the centre of the earth: no axis points up
};

struct CrsFacts {
    CrsKind kind = CrsKind::unknown;
    double metres = 0;        // of its unit of length; 0: not known
    double height_metres = 0; // of its heights, where it says so; 0: not known
};

// Texts in WKT 1 and 2; "EPSG:25832". Other texts give nothing.
// Based on: OGC 01-009, Coordinate Transformation Services. 2001; ISO 19162, Well-known text of CRS. 2019
CrsFacts facts_of(std::string_view crs);

// Of the number that the register of the EPSG gives it: as far as ranges of numbers tell.
CrsFacts facts_of_epsg(unsigned code);

// The unit of a model for a unit of so many metres: unknown for other units than those of models. A foot is the
// international one or that of the US survey, which differ by 2 millionths.
Unit unit_of_metres(double metres);
std::string unit_name(double metres); // "US survey foot", "0.9144 m"

// The name of a CRS and its number, "ETRS89 / UTM zone 32N (EPSG:25832)", in place of a text that is too long to be
// kept; empty: the text is no WKT.
std::string short_crs(std::string_view wkt);

} // namespace pbm::build
