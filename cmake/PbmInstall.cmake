# find_package(pbm) for outside projects: pbm::c, pbm::format, pbm::bake, pbm::render, pbm::pbm-build and pbm_add_asset(); with
# the component `scan` also pbm::scan, which needs more libraries than the others.
include(CMakePackageConfigHelpers)
set(PBM_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/pbm)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME libpbm-dev)

foreach(name ${pbm_libraries})
    set(library pbm_${name})
    set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
    if(NOT name STREQUAL "scan")
        list(APPEND installed_libraries ${library})
    endif()
    if(name STREQUAL "format") # is the three before it
        continue()
    endif()
    # Our warnings are ours: a program that links the static library gets none of them.
    get_target_property(linked ${library} INTERFACE_LINK_LIBRARIES)
    list(REMOVE_ITEM linked "$<LINK_ONLY:pbm_warnings>")
    set_target_properties(${library} PROPERTIES INTERFACE_LINK_LIBRARIES "${linked}")
endforeach()
if(PBM_BUILD_BINDINGS)
    list(APPEND installed_libraries pbm_c) # shared: its dependencies are its own
endif()
install(TARGETS ${installed_libraries} EXPORT pbmTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libpbm1 NAMELINK_COMPONENT libpbm-dev)
if(TARGET pbm_scan)
    install(TARGETS pbm_scan EXPORT pbm-scan ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
    install(EXPORT pbm-scan NAMESPACE pbm:: DESTINATION ${PBM_CMAKE_DIR})
endif()

# The doors, and of all other headers those that they include.
set(doors)
foreach(name format render bake scan)
    if(TARGET pbm_${name})
        list(APPEND doors pbm/${name}.h)
    endif()
endforeach()
set(header_roots format_spec runtime tools .)
list(TRANSFORM header_roots PREPEND ${PROJECT_SOURCE_DIR}/)
set(waiting ${doors})
set(installed_headers)
while(waiting)
    list(POP_FRONT waiting header)
    if(header IN_LIST installed_headers)
        continue()
    endif()
    list(APPEND installed_headers ${header})
    unset(source)
    find_file(source ${header} PATHS ${header_roots} NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH NO_CACHE REQUIRED)
    file(STRINGS ${source} includes REGEX "^#include \"")
    list(TRANSFORM includes REPLACE "^#include \"(.*)\".*" "\\1")
    list(APPEND waiting ${includes})
    cmake_path(GET header PARENT_PATH folder)
    if(NOT header IN_LIST doors)
        cmake_path(SET folder NORMALIZE pbm/${folder}) # seen by the doors only: include/pbm is searched for them
    endif()
    install(FILES ${source} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder})
endwhile()
# With the folders of the tree, so that links between pages lead somewhere.
install(FILES CHANGELOG.md LICENSE README.md SECURITY.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT pbm-doc)
install(DIRECTORY docs examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT pbm-doc PATTERN "*.sh" EXCLUDE)
# The site, where the target `site` has made it.
install(DIRECTORY ${PROJECT_BINARY_DIR}/site/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/html COMPONENT pbm-doc OPTIONAL)
install(FILES format_spec/BVG.md format_spec/ERRATA.md format_spec/mask_ranks.txt
    DESTINATION ${CMAKE_INSTALL_DOCDIR}/format_spec COMPONENT pbm-doc)
install(FILES format_spec/bvg.magic DESTINATION ${CMAKE_INSTALL_DATADIR}/pbm COMPONENT pbm-tools)
install(DIRECTORY bazel DESTINATION ${CMAKE_INSTALL_DATADIR}/pbm COMPONENT libpbm-dev)

install(EXPORT pbmTargets NAMESPACE pbm:: DESTINATION ${PBM_CMAKE_DIR})
# The programs of each package, since one may be installed without the other.
if(TARGET pbm-render)
    install(EXPORT pbm-tools NAMESPACE pbm:: DESTINATION ${PBM_CMAKE_DIR} COMPONENT pbm-tools)
endif()
if(TARGET pbm-view)
    install(EXPORT pbm-viewer NAMESPACE pbm:: DESTINATION ${PBM_CMAKE_DIR} COMPONENT pbm-viewer)
endif()
# Not in a folder that find_package searches: PATH may hold the build's programs, and without its installed neighbours
# this package is broken.
set(package ${CMAKE_CURRENT_BINARY_DIR}/to_install)
file(REMOVE ${CMAKE_CURRENT_BINARY_DIR}/pbmConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/pbmConfigVersion.cmake) # of before
configure_package_config_file(cmake/pbmConfig.cmake.in ${package}/pbmConfig.cmake
    INSTALL_DESTINATION ${PBM_CMAKE_DIR})
write_basic_package_version_file(${package}/pbmConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${package}/pbmConfig.cmake ${package}/pbmConfigVersion.cmake cmake/PbmAddAsset.cmake cmake/Findsquish.cmake
    DESTINATION ${PBM_CMAKE_DIR})
