# find_package(pbm) for outside projects: pbm::format, pbm::bake, pbm::render, pbm::pbm-build and pbm_add_asset().
include(CMakePackageConfigHelpers)
set(PBM_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/pbm)

target_compile_features(pbm_format PUBLIC cxx_std_20)
target_compile_features(pbm_bake PUBLIC cxx_std_20)
target_compile_features(pbm_render PUBLIC cxx_std_20)
foreach(library pbm_format pbm_bake pbm_render)
    # Our warnings are ours: a program that links the static library gets none of them.
    get_target_property(libraries ${library} INTERFACE_LINK_LIBRARIES)
    list(REMOVE_ITEM libraries "$<LINK_ONLY:pbm_warnings>")
    set_target_properties(${library} PROPERTIES INTERFACE_LINK_LIBRARIES "${libraries}")
endforeach()
install(TARGETS pbm_format pbm_bake pbm_render EXPORT pbmTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY format_spec/pbm_format runtime/pbm_bake runtime/pbm_render DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
    FILES_MATCHING PATTERN "*.h")
install(FILES LICENSE README.md format_spec/BVG.md format_spec/ERRATA.md format_spec/mask_ranks.txt docs/validator.md
    DESTINATION ${CMAKE_INSTALL_DOCDIR} OPTIONAL)
install(FILES format_spec/bvg.magic DESTINATION ${CMAKE_INSTALL_DATADIR}/pbm)

install(EXPORT pbmTargets NAMESPACE pbm:: DESTINATION ${PBM_CMAKE_DIR})
configure_package_config_file(cmake/pbmConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/pbmConfig.cmake
    INSTALL_DESTINATION ${PBM_CMAKE_DIR})
# Before 1.0 a minor version may change everything.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/pbmConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/pbmConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/pbmConfigVersion.cmake
    cmake/PbmAddAsset.cmake
    DESTINATION ${PBM_CMAKE_DIR})
