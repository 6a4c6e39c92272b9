# WebAssembly: Debian's emscripten, and libraries of Debian's packages whose headers do not depend on the machine. zstd's
# decoder is compiled from Debian's source package (scripts/install_packages.sh web).
enable_language(C)
option(PBM_WEB_THREADS "Build the module with threads, whose objects no other module can use" OFF)
if(PBM_WEB_THREADS)
    add_compile_options(-pthread)
endif()
add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-include${PROJECT_SOURCE_DIR}/bindings/web/standard_library.h>)
add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fconstexpr-steps=100000000>) # packed_rankings.h

# Only these headers: those of the host's C library must not be found.
set(web_headers ${PROJECT_BINARY_DIR}/headers)
file(MAKE_DIRECTORY ${web_headers})
foreach(header glm nlohmann stb xxhash.h)
    if(NOT EXISTS /usr/include/${header})
        message(FATAL_ERROR "/usr/include/${header} is not there: run scripts/install_packages.sh web")
    endif()
    file(CREATE_LINK /usr/include/${header} ${web_headers}/${header} SYMBOLIC)
endforeach()
set(PBM_HIGHWAY_INCLUDE ${web_headers})

# Highway 1.0.3 was written before these instructions had their names: without them it looks bytes up one by one.
function(pbm_use_instruction path old new)
    file(READ ${path} text)
    string(REPLACE "${old}" "${new}" replaced "${text}")
    if(replaced STREQUAL text)
        message(FATAL_ERROR "${path} has no \"${old}\": this is another Highway")
    endif()
    file(WRITE ${path} "${replaced}")
endfunction()
if(NOT EXISTS ${web_headers}/hwy)
    file(COPY /usr/include/hwy DESTINATION ${web_headers}/part)
    set(path ${web_headers}/part/hwy/ops/wasm_128-inl.h)
    pbm_use_instruction(${path} "#if 0\n  return Vec128<TI, NI>{wasm_i8x16_swizzle" "#if 1\n  return Vec128<TI, NI>{wasm_i8x16_swizzle")
    pbm_use_instruction(${path} "return (wasm_i64x2_extract_lane(m.raw, 0) |\n          wasm_i64x2_extract_lane(m.raw, 1)) == 0;"
        "return !wasm_v128_any_true(m.raw);")
    pbm_use_instruction(${path} "  const __i32x4 mask_i = " "  return wasm_i32x4_bitmask(mask.raw);\n  const __i32x4 mask_i = ")
    pbm_use_instruction(${path} "const Mask128<T> mask) {\n  alignas(16) uint64_t lanes[2];"
        "const Mask128<T> mask) {\n  return wasm_i8x16_bitmask(mask.raw);\n  alignas(16) uint64_t lanes[2];")
    pbm_use_instruction(${path} "CountTrue(hwy::SizeTag<4> /*tag*/, const Mask128<T> m) {"
        "CountTrue(hwy::SizeTag<4> tag, const Mask128<T> m) {\n  return PopCount(BitsFromMask(tag, m));")
    file(RENAME ${web_headers}/part/hwy ${web_headers}/hwy)
endif()
foreach(package glm nlohmann_json)
    file(WRITE ${CMAKE_FIND_PACKAGE_REDIRECTS_DIR}/${package}-config.cmake "")
    add_library(${package}::${package} INTERFACE IMPORTED)
    target_include_directories(${package}::${package} SYSTEM INTERFACE ${web_headers})
endforeach()

set(PBM_ZSTD_SOURCE ${PROJECT_SOURCE_DIR}/build/zstd CACHE PATH "Folder of zstd's sources")
file(GLOB zstd_sources ${PBM_ZSTD_SOURCE}/lib/common/*.c ${PBM_ZSTD_SOURCE}/lib/decompress/*.c)
if(NOT zstd_sources)
    message(FATAL_ERROR "zstd's sources are not in ${PBM_ZSTD_SOURCE}: run scripts/install_packages.sh web")
endif()
add_library(pbm_zstd STATIC ${zstd_sources})
target_include_directories(pbm_zstd SYSTEM PUBLIC ${PBM_ZSTD_SOURCE}/lib)
# One decoder of Huffman codes and one of sequences instead of two each, and no texts: 8 KB less of the download.
target_compile_definitions(pbm_zstd PRIVATE ZSTD_DISABLE_ASM ZSTD_LEGACY_SUPPORT=0 HUF_FORCE_DECOMPRESS_X1
    ZSTD_FORCE_DECOMPRESS_SEQUENCES_SHORT ZSTD_STRIP_ERROR_STRINGS)
set(PBM_ZSTD_TARGET pbm_zstd)
