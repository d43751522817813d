# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts in place: the program `veduta` with its `veduta-decoder`, and for
# programs that embed the database the shared library libveduta, the headers of its door and the
# package that find_package(veduta) finds. docs/embedding.md shows their use; tests/embedding/ tests
# it.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# The libraries that define what the door declares. What they depend on comes along.
set(VEDUTA_DOOR engine/engine.h)
set(VEDUTA_DOOR_LIBRARIES veduta_engine veduta_fusion veduta_repair)

# Sets OUT to the project's headers that HEADER reaches, itself included, as paths from the root. A
# change of one of them makes CMake look again.
function(veduta_reached_headers header out)
  set(reached ${header})
  set(left ${header})
  while(left)
    list(POP_FRONT left path)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${path})
    file(STRINGS ${CMAKE_SOURCE_DIR}/${path} lines REGEX "^[ \t]*#[ \t]*include[ \t]*\"")
    foreach(line IN LISTS lines)
      string(REGEX REPLACE "^[^\"]*\"([^\"]*)\".*" "\\1" next "${line}")
      if(EXISTS ${CMAKE_SOURCE_DIR}/${next} AND NOT next IN_LIST reached)
        list(APPEND reached ${next})
        list(APPEND left ${next})
      endif()
    endforeach()
  endwhile()
  set(${out} ${reached} PARENT_SCOPE)
endfunction()

# Sets OUT to the libraries and all that they are linked with, of ours and of others.
function(veduta_linked out)
  set(linked ${ARGN})
  set(left ${ARGN})
  while(left)
    list(POP_FRONT left name)
    get_target_property(floor ${name} VEDUTA_FLOOR)
    if(NOT floor STREQUAL "floor-NOTFOUND") # what others link is theirs
      veduta_property(links ${name} LINK_LIBRARIES)
      veduta_property(interface ${name} INTERFACE_LINK_LIBRARIES)
      foreach(link IN LISTS links interface)
        if(NOT link MATCHES "^\\$<" AND NOT link IN_LIST linked)
          list(APPEND linked ${link})
          list(APPEND left ${link})
        endif()
      endforeach()
    endif()
  endwhile()
  set(${out} ${linked} PARENT_SCOPE)
endfunction()

# libveduta: every object of the libraries behind the door. Its users see nothing of the libraries
# of others: those are linked privately.
add_library(veduta_shared SHARED)
veduta_linked(linked ${VEDUTA_DOOR_LIBRARIES})
foreach(name IN LISTS linked)
  get_target_property(floor ${name} VEDUTA_FLOOR)
  get_target_property(type ${name} TYPE)
  if(floor STREQUAL "floor-NOTFOUND")
    target_link_libraries(veduta_shared PRIVATE ${name})
  elseif(type STREQUAL "STATIC_LIBRARY")
    target_sources(veduta_shared PRIVATE $<TARGET_OBJECTS:${name}>)
  endif()
endforeach()
if(NOT VEDUTA_SANITIZE) # the sanitizers' own functions come with the program
  target_link_options(veduta_shared PRIVATE -Wl,--no-undefined)
endif()
target_compile_features(veduta_shared INTERFACE cxx_std_20)
target_include_directories(veduta_shared INTERFACE
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/veduta>)
set_target_properties(veduta_shared PROPERTIES
  OUTPUT_NAME veduta
  EXPORT_NAME veduta
  LINKER_LANGUAGE CXX
  VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR})

install(TARGETS veduta COMPONENT program)
# Not for people: the daemon starts it (cli/decoders.cc).
install(TARGETS veduta-decoder DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/veduta COMPONENT program)
# For clients of the daemon: docs/rpc.md.
install(FILES ${CMAKE_SOURCE_DIR}/cli/rpc/veduta.capnp ${CMAKE_SOURCE_DIR}/cli/rpc/veduta_rpc.py
  DESTINATION ${CMAKE_INSTALL_DATADIR}/veduta COMPONENT program)
install(TARGETS veduta_shared EXPORT veduta-targets)
veduta_reached_headers(${VEDUTA_DOOR} door_headers)
foreach(header IN LISTS door_headers)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${CMAKE_SOURCE_DIR}/${header}
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/veduta/${folder})
endforeach()
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/veduta)
install(EXPORT veduta-targets
  FILE veduta-config.cmake
  NAMESPACE veduta::
  DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/veduta-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/veduta-config-version.cmake DESTINATION ${package})
