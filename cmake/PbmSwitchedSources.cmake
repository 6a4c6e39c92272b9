# Copies of the library's reading side whose checks can be taken away, for tests and measurements of these checks.

# Files of pbm_format that read or validate; those that only write hold no checks of files.
set(PBM_READING_SIDE brick_index chunk directory frame image image_section layout mapped_chunk metadata normal_cone octree reader
    sections sibling_layout stream_rules tiled_image unfilter validate)
foreach(name file_rules) # where there are such
    if(EXISTS ${PROJECT_SOURCE_DIR}/format_spec/pbm_format/${name}.cpp)
        list(APPEND PBM_READING_SIDE ${name})
    endif()
endforeach()

# pbm_switched_sources(OUT FOLDER SCRIPT COMMAND...): sets OUT to the sources of pbm_format, those of its reading side as
# copies in FOLDER/pbm_format, which the Python script makes: SCRIPT ARGUMENTS... SOURCES.
function(pbm_switched_sources out folder script)
    set(originals)
    set(copies)
    set(all)
    get_target_property(sources pbm_format SOURCES)
    get_target_property(source_folder pbm_format SOURCE_DIR)
    foreach(source ${sources})
        get_filename_component(name ${source} NAME_WE)
        if(NOT IS_ABSOLUTE ${source})
            set(source ${source_folder}/${source})
        endif()
        if(name IN_LIST PBM_READING_SIDE AND source MATCHES "\\.cpp$")
            list(APPEND originals ${source})
            list(APPEND copies ${folder}/pbm_format/${name}.cpp)
            list(APPEND all ${folder}/pbm_format/${name}.cpp)
        else()
            list(APPEND all ${source})
        endif()
    endforeach()
    set(instrument ${PROJECT_SOURCE_DIR}/tests/check_mutations/instrument.py)
    add_custom_command(OUTPUT ${copies} COMMAND ${Python3_EXECUTABLE} -B ${script} ${ARGN} ${originals}
        DEPENDS ${script} ${instrument} ${originals} VERBATIM)
    set(${out} ${all} PARENT_SCOPE)
endfunction()

# pbm_like_the_library(TARGET FOLDER): headers and libraries as pbm_format has them, but the copies in FOLDER first.
function(pbm_like_the_library target folder)
    find_package(hwy REQUIRED)
    find_package(nlohmann_json REQUIRED)
    find_package(zstd REQUIRED)
    target_include_directories(${target} BEFORE PRIVATE ${folder})
    target_include_directories(${target} SYSTEM PRIVATE $<TARGET_PROPERTY:pbm_format,INCLUDE_DIRECTORIES>)
    target_link_libraries(${target} PRIVATE zstd::libzstd_shared nlohmann_json::nlohmann_json Threads::Threads)
    add_dependencies(${target} pbm_format) # makes the headers that are generated
endfunction()
