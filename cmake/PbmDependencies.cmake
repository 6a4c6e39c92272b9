# The libraries that the format needs. Whoever has them elsewhere (another system, one build for several programs) sets:
#   PBM_ZSTD_TARGET       the CMake target of zstd; a decoder suffices without pbm_writing. Default: zstd's own package
#   PBM_HIGHWAY_INCLUDE   the folder that holds hwy/highway.h. Default: that of Highway's own package
set(PBM_ZSTD_TARGET "" CACHE STRING "CMake target of zstd; empty: zstd::libzstd_shared of the package zstd")
set(PBM_HIGHWAY_INCLUDE "" CACHE PATH "Folder of Highway's headers; empty: that of the package hwy")

set(PBM_FINDS_ZSTD FALSE)
if(NOT PBM_ZSTD_TARGET)
    find_package(zstd REQUIRED)
    set(PBM_FINDS_ZSTD TRUE) # and whoever uses the installed libraries must
    set(PBM_ZSTD_TARGET zstd::libzstd_shared)
    if(PBM_STATIC)
        set(PBM_ZSTD_TARGET zstd::libzstd_static)
    endif()
endif()

# Headers only: the one thing of Highway's own library that its headers need is system/simd/simd_targets.cpp.
if(NOT PBM_HIGHWAY_INCLUDE)
    find_package(hwy REQUIRED)
    set(PBM_HIGHWAY_INCLUDE $<TARGET_PROPERTY:hwy::hwy,INTERFACE_INCLUDE_DIRECTORIES>)
endif()
