# Run by cpack before it packs: adds to each package what Debian's policy asks for.
foreach(package IN LISTS CPACK_COMPONENTS_ALL)
    set(share ${CPACK_TEMPORARY_DIRECTORY}/${package}/usr/share)
    set(doc ${share}/doc/${package})
    file(MAKE_DIRECTORY ${doc}) # file(INSTALL) would obey DESTDIR, which is that of another package
    file(COPY_FILE ${CPACK_PBM_COPYRIGHT} ${doc}/copyright)
    file(COPY_FILE ${CPACK_PBM_CHANGELOG} ${doc}/changelog.Debian)
    file(GLOB pages ${share}/man/man1/*.1)
    execute_process(COMMAND gzip -9nf ${doc}/changelog.Debian ${pages} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
