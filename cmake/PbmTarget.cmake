# What every target of ours has in common: warnings, floating point that does not change between machines, sanitizers.

add_library(pbm_warnings INTERFACE)
target_compile_options(pbm_warnings INTERFACE
    -Wall -Wextra -Wshadow -Wconversion
    $<$<BOOL:${PBM_WARNINGS_AS_ERRORS}>:-Werror>)

# Bytes of a file may not depend on whether the compiler fuses multiplications and additions. Nobody reads errno after a
# square root or the flags of floating-point exceptions.
add_compile_options(-ffp-contract=off -fno-math-errno -fno-trapping-math)

# Parsing these takes a tenth of the compiler's time where each file does it for itself. Files include what they use all the
# same: without PBM_UNITY nothing is precompiled.
set(pbm_standard_headers <algorithm> <array> <atomic> <bit> <charconv> <cmath> <filesystem> <functional> <future> <memory>
    <mutex> <optional> <span> <sstream> <string> <string_view> <variant> <vector>)

# A compiler that searches its memory for what it may free less often takes a tenth less time, and a third more memory (1 GB).
if(PBM_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    add_compile_options(--param=ggc-min-heapsize=500000)
endif()

if(PBM_SANITIZE)
    add_compile_options(-fsanitize=${PBM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    # Five of UBSan's checks take a third of the compiler's time, two thirds where there is SIMD. `address` reports the use of
    # what null, object-size and pointer-overflow look at; what vptr looks at, casts between classes with virtual functions, is
    # not in this code; alignment is asserted where bytes of files are viewed as records.
    add_compile_options(-fno-sanitize=null,alignment,object-size,pointer-overflow,vptr)
    add_link_options(-fsanitize=${PBM_SANITIZE})
endif()

# On x86 a file with SIMD is compiled once for each of these and once for machines that have none of them.
set(all_simd_targets HWY_AVX3 HWY_AVX2 HWY_SSE4 HWY_SSSE3)
set(PBM_SIMD_TARGETS "${all_simd_targets}" CACHE STRING "Highway targets to compile for, on x86: fewer take less time")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64|ARM64")
    # NEON alone, which every 64-bit ARM has. Scalable vectors (SVE) end g++ 12 in an internal error. Highway 1.0.3 would compile
    # NEON for processors with AES, which some lack and nothing here uses, if it could choose at run time: this says that it cannot.
    set(disabled_simd_targets "HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128")
    add_compile_definitions(TOOLCHAIN_MISS_SYS_AUXV_H)
else()
    list(REMOVE_ITEM all_simd_targets ${PBM_SIMD_TARGETS})
    list(JOIN all_simd_targets "|" disabled_simd_targets)
endif()
if(disabled_simd_targets)
    add_compile_definitions("HWY_DISABLED_TARGETS=(${disabled_simd_targets})")
endif()

# pbm_precompiled(TARGET OWNER [HEADERS...]): TARGET uses the precompiled headers of the target OWNER, which must have the same
# flags and be made first: those of the standard library and HEADERS.
function(pbm_precompiled target owner)
    if(target STREQUAL owner)
        target_precompile_headers(${target} PRIVATE ${pbm_standard_headers} ${ARGN})
    else()
        target_precompile_headers(${target} REUSE_FROM ${owner})
    endif()
endfunction()

# pbm_shareable(TARGET): libpbm.so is made of its objects too.
function(pbm_shareable target)
    if(PBM_BUILD_BINDINGS)
        target_compile_options(${target} PRIVATE -fPIC -fvisibility=hidden -fvisibility-inlines-hidden)
    endif()
endfunction()

# pbm_compiled(TARGET [SIMD SOURCES...] [UNOPTIMISED] [APART SOURCES...]): what makes TARGET compile faster.
#   SIMD         files of Highway, which are compiled one by one.
#   UNOPTIMISED  nothing in it takes time: command lines, reports. With sanitizers it is not optimised, else little, which
#                makes its code smaller too. At -O1 g++ 12 takes optional values for uninitialised ones.
#   APART        files whose names are other files' too. The rest of the target is compiled several files at a time where
#                PBM_UNITY is on.
function(pbm_compiled target)
    cmake_parse_arguments(ARG "UNOPTIMISED" "" "SIMD;APART" ${ARGN})
    if(PBM_SANITIZE AND ARG_UNOPTIMISED)
        target_compile_options(${target} PRIVATE -O0)
    elseif(ARG_UNOPTIMISED)
        target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>
            $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>) # clang does not know it
    endif()
    pbm_shareable(${target})
    set_target_properties(${target} PROPERTIES UNITY_BUILD ${PBM_UNITY})
    # The fuzzers' libraries have flags of their own.
    if(PBM_UNITY AND NOT PBM_BUILD_FUZZERS AND NOT (PBM_SANITIZE AND ARG_UNOPTIMISED))
        pbm_precompiled(${target} pbm_base)
    endif()
    set_source_files_properties(${ARG_SIMD} ${ARG_APART} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    if(PBM_SANITIZE) # 10 s instead of 57 for brick_splatter.cpp: a register's scope is of no interest
        set_source_files_properties(${ARG_SIMD} PROPERTIES COMPILE_OPTIONS -fno-sanitize-address-use-after-scope)
    endif()
endfunction()

# pbm_install(ARGUMENTS...): install(), where PBM_INSTALL is on.
function(pbm_install)
    if(PBM_INSTALL)
        install(${ARGV})
    endif()
endfunction()

# All man pages and completions of shells; each is made by its own program.
if(PROJECT_IS_TOP_LEVEL)
    add_custom_target(man ALL)
endif()
set(PBM_ZSH_COMPLETIONS_DIR ${CMAKE_INSTALL_DATADIR}/zsh/site-functions CACHE STRING
    "Where zsh's completions are installed; Debian's packages use share/zsh/vendor-completions")

# pbm_program(NAME [QUICK] LIBRARIES...): one of the installed programs, from main.cpp of the current folder and further
# SOURCES, its man page and its completions, all in the current component. QUICK: the C++ run time is part of it, since to
# load it takes a third of the time in which the program starts and ends; not for programs that use libraries in C++ which
# are not.
function(pbm_program name)
    cmake_parse_arguments(ARG "QUICK" "" "SOURCES;LIBRARIES" ${ARGN})
    add_executable(${name} main.cpp ${ARG_SOURCES})
    target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} pbm_warnings)
    if(ARG_QUICK AND NOT PBM_SANITIZE AND NOT PBM_STATIC)
        target_link_options(${name} PRIVATE -static-libstdc++ -static-libgcc)
    endif()
    target_compile_definitions(${name} PRIVATE PBM_VERSION="${PROJECT_VERSION}")
    pbm_compiled(${name} UNOPTIMISED)
    pbm_install(TARGETS ${name} EXPORT ${CMAKE_INSTALL_DEFAULT_COMPONENT_NAME} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})

    set(pages ${PROJECT_BINARY_DIR}/man)
    file(MAKE_DIRECTORY ${pages})
    set(man ${pages}/${name}.1)
    set(bash ${pages}/${name}.bash)
    set(zsh ${pages}/_${name})
    set(fish ${pages}/${name}.fish)
    add_custom_command(OUTPUT ${man} ${bash} ${zsh} ${fish}
        COMMAND ${name} --help=man > ${man}
        COMMAND ${name} --help=bash > ${bash}
        COMMAND ${name} --help=zsh > ${zsh}
        COMMAND ${name} --help=fish > ${fish}
        DEPENDS ${name} COMMENT "Writing man page and completions of ${name}" VERBATIM)
    if(PROJECT_IS_TOP_LEVEL)
        add_custom_target(${name}-man DEPENDS ${man})
        add_dependencies(man ${name}-man)
    elseif(PBM_INSTALL)
        add_custom_target(${name}-man ALL DEPENDS ${man})
    endif()
    pbm_install(FILES ${man} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
    pbm_install(FILES ${bash} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME ${name})
    pbm_install(FILES ${zsh} DESTINATION ${PBM_ZSH_COMPLETIONS_DIR})
    pbm_install(FILES ${fish} DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
    if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/report.schema.json) # of --json
        pbm_install(FILES report.schema.json DESTINATION ${CMAKE_INSTALL_DATADIR}/pbm RENAME ${name}.schema.json)
    endif()
endfunction()
