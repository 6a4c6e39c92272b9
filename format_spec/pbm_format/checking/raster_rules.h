// Checks a raster whose tile directory was decoded. BVG.md 3.10.12 to 3.10.14
#pragma once

#include "pbm_format/rasters/image_section.h"

#include <functional>

namespace pbm {

// Counts faults, and passes on the wanted ones.
struct FaultSink {
    std::function<bool(const CatalogueEntry &)> wants; // called once per fault: whether `take` gets it
    std::function<void(Error)> take;
    std::uint64_t count = 0;

    bool counts(const CatalogueEntry &entry) { return ++count, wants(entry); } // counts; whether it is wanted
    void add(Error error);
};

// Checks padding (3.10.13), tiles, and with `means` each mip level against the finer one (3.10.14), in the order of the
// file. Returns level 0, which is complete if no fault was counted.
Image check_raster(const StoredRaster &raster, int threads, bool means, FaultSink &faults);

} // namespace pbm
