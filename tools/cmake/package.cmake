# SPDX-License-Identifier: Apache-2.0
# The Debian package that `cpack` makes of what is built: the program, its unit for systemd, manual
# page, completions and documents. It is the component `program`; what embedding wants is not in it.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON) # tests need not be built for it
set(VEDUTA_PAGES ${CMAKE_BINARY_DIR}/pages)
install(CODE "execute_process(
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_SOURCE_DIR}/tools/package/pages.py
      $<TARGET_FILE:veduta> ${VEDUTA_PAGES}
    COMMAND_ERROR_IS_FATAL ANY)" COMPONENT program)
install(FILES ${VEDUTA_PAGES}/veduta.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
install(FILES ${VEDUTA_PAGES}/veduta.bash RENAME veduta
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)
install(FILES ${VEDUTA_PAGES}/_veduta
  DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program)
install(FILES tools/package/veduta@.service DESTINATION lib/systemd/system COMPONENT program)
install(FILES README.md CHANGELOG.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR}
  COMPONENT program)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME veduta)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "the authors of Veduta <veduta@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "database of a city's photographs in 3D")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "Veduta knows where each photograph of a city was taken, and
what the city looks like in 3D. Photos are added one at a time, by anybody and in any order.")
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS passwd)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS pocl-opencl-icd)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
  ${CMAKE_SOURCE_DIR}/tools/package/postinst ${CMAKE_SOURCE_DIR}/tools/package/postrm)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
# One package of one component.
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_COMPONENTS_ALL program)
set(CPACK_VERBATIM_VARIABLES ON)
include(CPack)
