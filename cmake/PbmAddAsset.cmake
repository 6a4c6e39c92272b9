# pbm_add_asset(NAME
#     [SOURCES scan...]     files to build from; may be left out where the recipe names them
#     [RECIPE recipe.toml]  options of pbm-build as TOML
#     [OPTIONS option...]   options of pbm-build; they win over the recipe
#     [OUTPUT model.pbvg]    default: NAME.pbvg
#     [DEPENDS file...])    further files and targets that must be there first
#
# Adds a target NAME that is part of `all` and builds OUTPUT. Sources, recipe and DEPENDS are relative to the current
# source folder, OUTPUT and files in OPTIONS to the current binary folder. Files that the scans, the recipe or OPTIONS
# name (material files, further inputs) are dependencies too, by way of a dependency file; those that are built need
# DEPENDS. Whatever depends on OUTPUT is built again only if its content changed: pbm-build leaves it and its time
# alone otherwise. `get_target_property(file NAME PBM_OUTPUT)` tells the full name. What is dropped from a scan is a
# warning of the build, and stands in OUTPUT.log with errors.
#
# A name with [ ] or { is refused: the shell would take it for a pattern, and CMake does not quote it.
#
# Another version of pbm-build builds all assets again: they depend on the file pbm-build.version in the binary folder of
# the project, whose target `pbm_build_version` each build runs.
#
# Needs Ninja or Makefiles and the imported target pbm::pbm-build.
cmake_policy(PUSH)
# Ninja reads the dependency file as pbm-build writes it. CMake would rewrite it first, and quote $ and # for a shell.
cmake_policy(SET CMP0116 OLD)

function(pbm_add_asset name)
    cmake_parse_arguments(PARSE_ARGV 1 ARG "" "OUTPUT;RECIPE" "SOURCES;OPTIONS;DEPENDS")
    if(DEFINED ARG_UNPARSED_ARGUMENTS)
        message(FATAL_ERROR "pbm_add_asset(${name}): unknown argument: ${ARG_UNPARSED_ARGUMENTS}")
    endif()
    if(NOT ARG_SOURCES AND NOT ARG_RECIPE)
        message(FATAL_ERROR "pbm_add_asset(${name}): name SOURCES, or a RECIPE that has an input")
    endif()
    if(NOT TARGET pbm::pbm-build)
        message(FATAL_ERROR "pbm_add_asset(${name}): this installation of PBM has no pbm-build")
    endif()
    set(unquoted ${ARG_OPTIONS})
    list(FILTER unquoted EXCLUDE REGEX " ") # CMake quotes words with a blank
    foreach(words "${ARG_SOURCES}" "${ARG_RECIPE}" "${ARG_OUTPUT}" "${unquoted}" "${CMAKE_CURRENT_SOURCE_DIR}"
            "${CMAKE_CURRENT_BINARY_DIR}")
        if(words MATCHES "[][{]")
            message(FATAL_ERROR
                "pbm_add_asset(${name}): ${words}: the shell takes [ ] and { for a pattern of names; rename the file or "
                "its folder")
        endif()
    endforeach()
    if(NOT DEFINED ARG_OUTPUT)
        set(ARG_OUTPUT ${name}.pbvg)
    endif()
    cmake_path(ABSOLUTE_PATH ARG_OUTPUT BASE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}" NORMALIZE)
    set(sources "")
    foreach(source IN LISTS ARG_SOURCES)
        cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
        list(APPEND sources "${source}")
    endforeach()
    set(recipe "")
    if(DEFINED ARG_RECIPE)
        cmake_path(ABSOLUTE_PATH ARG_RECIPE BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
        set(recipe --recipe "${ARG_RECIPE}")
    endif()
    set(depends "")
    foreach(item IN LISTS ARG_DEPENDS)
        if(NOT TARGET "${item}")
            cmake_path(ABSOLUTE_PATH item BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
        endif()
        list(APPEND depends "${item}")
    endforeach()

    set(version "${CMAKE_BINARY_DIR}/pbm-build.version")
    if(NOT TARGET pbm_build_version)
        add_custom_target(pbm_build_version
            COMMAND sh -c "\"$1\" --version | cmp -s - \"$2\" || \"$1\" --version >\"$2\"" sh
                "$<TARGET_FILE:pbm::pbm-build>" "${version}"
            BYPRODUCTS "${version}"
            COMMENT ""
            VERBATIM)
    endif()
    cmake_path(GET ARG_OUTPUT PARENT_PATH folder)
    file(MAKE_DIRECTORY "${folder}")
    set(shown "${ARG_OUTPUT}") # as Ninja names it
    cmake_path(IS_PREFIX CMAKE_BINARY_DIR "${ARG_OUTPUT}" inside)
    if(inside)
        cmake_path(RELATIVE_PATH ARG_OUTPUT BASE_DIRECTORY "${CMAKE_BINARY_DIR}" OUTPUT_VARIABLE shown)
    endif()
    set(target "${ARG_OUTPUT}")
    if(CMAKE_GENERATOR MATCHES "Ninja")
        set(target "${shown}")
    endif()
    # Makefiles keep what a target of this name depended on, and do not see that it builds something else now.
    set(request "${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${name}.asset")
    file(CONFIGURE OUTPUT "${request}" CONTENT "${recipe};${ARG_OPTIONS};${ARG_OUTPUT};${sources}\n" @ONLY)
    add_custom_command(OUTPUT "${ARG_OUTPUT}"
        COMMAND pbm::pbm-build --warnings --log "${ARG_OUTPUT}.log" --if-changed
            --dependency-file "${ARG_OUTPUT}.d" --dependency-target "${target}" ${recipe} ${ARG_OPTIONS}
            --output "${ARG_OUTPUT}" -- ${sources}
        DEPENDS pbm::pbm-build pbm_build_version "${version}" "${request}" ${sources} ${ARG_RECIPE} ${depends}
        DEPFILE "${ARG_OUTPUT}.d"
        COMMENT "Building ${shown}"
        VERBATIM)
    add_custom_target(${name} ALL DEPENDS "${ARG_OUTPUT}")
    set_target_properties(${name} PROPERTIES PBM_OUTPUT "${ARG_OUTPUT}")
endfunction()
cmake_policy(POP)
