# find_package(pbm) for outside projects: pbm::format, pbm::render.
include(CMakePackageConfigHelpers)
