# SPDX-License-Identifier: Apache-2.0
# What every library of the project is made by, and what its programs are.

# The floors of docs/architecture.md. A library states its floor, and may depend on lower ones only.
#   SOURCES  its .cc files      DEPENDS  libraries of ours, for whoever uses it as well
#   PUBLIC   libraries of others that its headers show      PRIVATE  those that its sources use
# INTERFACE: a library of headers alone, those in FOLDER (default: the one that makes the library).
function(veduta_library name)
  cmake_parse_arguments(ARG "INTERFACE" "FLOOR;FOLDER" "SOURCES;DEPENDS;PUBLIC;PRIVATE" ${ARGN})
  if(ARG_UNPARSED_ARGUMENTS OR NOT DEFINED ARG_FLOOR)
    message(FATAL_ERROR "${name}: no FLOOR, or arguments not known: ${ARG_UNPARSED_ARGUMENTS}")
  endif()
  foreach(dependency IN LISTS ARG_DEPENDS)
    if(NOT TARGET ${dependency})
      message(FATAL_ERROR "${name} depends on ${dependency}, and there is no such target yet")
    endif()
    get_target_property(below ${dependency} VEDUTA_FLOOR)
    if(NOT below LESS ARG_FLOOR)
      message(FATAL_ERROR
        "${name} (floor ${ARG_FLOOR}) must not depend on ${dependency} (floor ${below})")
    endif()
  endforeach()
  foreach(dependency IN LISTS ARG_PUBLIC ARG_PRIVATE)
    veduta_refuse_path(${name} ${dependency})
  endforeach()
  if(ARG_INTERFACE)
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE ${ARG_DEPENDS} ${ARG_PUBLIC})
    cmake_path(SET folder NORMALIZE "${CMAKE_CURRENT_SOURCE_DIR}/${ARG_FOLDER}")
    string(REGEX REPLACE "/$" "" folder ${folder})
    set_target_properties(${name} PROPERTIES VEDUTA_HEADER_FOLDER ${folder})
  else()
    add_library(${name} STATIC ${ARG_SOURCES})
    target_link_libraries(${name} PRIVATE veduta_flags
      PUBLIC ${ARG_DEPENDS} ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  endif()
  set_target_properties(${name} PROPERTIES VEDUTA_FLOOR ${ARG_FLOOR})
endfunction()

# A program. DEPENDS: libraries of ours; PRIVATE: those of others.
# ON_DEMAND: built when it is asked for by name, not by default.
function(veduta_program name)
  cmake_parse_arguments(ARG "ON_DEMAND" "" "SOURCES;DEPENDS;PRIVATE" ${ARGN})
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "${name}: arguments not known: ${ARG_UNPARSED_ARGUMENTS}")
  endif()
  foreach(dependency IN LISTS ARG_DEPENDS)
    if(NOT TARGET ${dependency})
      message(FATAL_ERROR "${name} depends on ${dependency}, and there is no such target yet")
    endif()
  endforeach()
  foreach(dependency IN LISTS ARG_PRIVATE)
    veduta_refuse_path(${name} ${dependency})
  endforeach()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE veduta_flags ${ARG_DEPENDS} ${ARG_PRIVATE})
  if(ARG_ON_DEMAND)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
endfunction()

# Other libraries are named by a target that exists, so that a typing error is no -lNAME, and none
# of ours slips in past its floor.
function(veduta_refuse_path name dependency)
  if(NOT TARGET ${dependency})
    message(FATAL_ERROR "${name} uses ${dependency}, and there is no such target")
  endif()
  get_target_property(floor ${dependency} VEDUTA_FLOOR)
  if(NOT floor STREQUAL "floor-NOTFOUND")
    message(FATAL_ERROR "${name}: ${dependency} is a library of ours; name it in DEPENDS")
  endif()
endfunction()
