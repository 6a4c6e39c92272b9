# Copies of the library's reading side whose checks can be taken away, for tests and measurements of these checks.

# Files of pbm_format that refuse files; the others hold no checks of them.
set(PBM_REFUSING_SOURCES brick_index chunk content_rules directory file_rules file_walk frame image image_section layout
    mapped_chunk metadata normal_cone octree raster_rules reader sections sibling_layout stream_rules tiled_image unfilter
    validate)

# pbm_switched_sources(OUT FOLDER SCRIPT ARGUMENTS...): sets OUT to the sources of pbm_format, those that refuse files as
# copies in FOLDER/pbm_format/ROOM, which the Python script makes: SCRIPT ARGUMENTS... SOURCES.
function(pbm_switched_sources out folder script)
    set(originals)
    set(copies)
    set(all)
    foreach(library pbm_reading pbm_checking pbm_writing)
        get_target_property(sources ${library} SOURCES)
        get_target_property(source_folder ${library} SOURCE_DIR)
        foreach(source ${sources})
            cmake_path(GET source STEM name)
            cmake_path(IS_RELATIVE source is_relative)
            if(name IN_LIST PBM_REFUSING_SOURCES AND source MATCHES "\\.cpp$")
                list(APPEND originals ${source_folder}/${source})
                list(APPEND copies ${folder}/${source})
                list(APPEND all ${folder}/${source})
            elseif(is_relative)
                list(APPEND all ${source_folder}/${source})
            else()
                list(APPEND all ${source})
            endif()
        endforeach()
    endforeach()
    set(instrument ${PROJECT_SOURCE_DIR}/tests/check_mutations/instrument.py)
    add_custom_command(OUTPUT ${copies} COMMAND ${Python3_EXECUTABLE} -B ${script} ${ARGN} ${originals}
        DEPENDS ${script} ${instrument} ${originals} VERBATIM)
    set(${out} ${all} PARENT_SCOPE)
endfunction()

# pbm_like_the_library(TARGET FOLDER): headers and libraries as pbm_format has them, but the copies in FOLDER first.
function(pbm_like_the_library target folder)
    find_package(nlohmann_json REQUIRED)
    target_include_directories(${target} BEFORE PRIVATE ${folder})
    target_include_directories(${target} SYSTEM PRIVATE $<TARGET_PROPERTY:pbm_reading,INCLUDE_DIRECTORIES>)
    target_link_libraries(${target} PRIVATE pbm_system ${PBM_ZSTD_TARGET} nlohmann_json::nlohmann_json)
    add_dependencies(${target} pbm_reading) # makes the headers that are generated
endfunction()
