# SPDX-License-Identifier: Apache-2.0
# Writes what each target declares into declarations.json, which tests/tidy/includes_test.py reads:
# {"targets": {NAME: {"type", "floor", "folder", "header_folder", "sources", "links", "interface"}}}

# Sets OUT to all targets that FOLDER and the folders below it made.
function(veduta_targets_below folder out)
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  get_property(folders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(below IN LISTS folders)
    veduta_targets_below(${below} more)
    list(APPEND targets ${more})
  endforeach()
  set(${out} ${targets} PARENT_SCOPE)
endfunction()

# Sets OUT to a JSON list of strings.
function(veduta_json_list out)
  set(texts "")
  foreach(item IN LISTS ARGN)
    string(REPLACE "\\" "\\\\" item "${item}")
    string(REPLACE "\"" "\\\"" item "${item}")
    list(APPEND texts "\"${item}\"")
  endforeach()
  list(JOIN texts ", " joined)
  set(${out} "[${joined}]" PARENT_SCOPE)
endfunction()

# A property that is not set counts as an empty list.
function(veduta_property out target property)
  get_target_property(value ${target} ${property})
  if(value STREQUAL "value-NOTFOUND")
    set(value "")
  endif()
  set(${out} ${value} PARENT_SCOPE)
endfunction()

function(veduta_write_declarations file)
  veduta_targets_below(${CMAKE_SOURCE_DIR} targets)
  set(entries "")
  foreach(target IN LISTS targets)
    veduta_property(type ${target} TYPE)
    veduta_property(folder ${target} SOURCE_DIR)
    veduta_property(floor ${target} VEDUTA_FLOOR)
    veduta_property(header_folder ${target} VEDUTA_HEADER_FOLDER)
    veduta_property(sources ${target} SOURCES)
    veduta_property(links ${target} LINK_LIBRARIES)
    veduta_property(interface ${target} INTERFACE_LINK_LIBRARIES)
    veduta_json_list(sources ${sources})
    veduta_json_list(links ${links})
    veduta_json_list(interface ${interface})
    string(CONCAT entry "\"${target}\": {\"type\": \"${type}\", \"folder\": \"${folder}\",\n"
      "  \"floor\": \"${floor}\", \"header_folder\": \"${header_folder}\",\n"
      "  \"sources\": ${sources},\n  \"links\": ${links},\n  \"interface\": ${interface}}")
    list(APPEND entries "${entry}")
  endforeach()
  list(JOIN entries ",\n" joined)
  file(WRITE ${file} "{\"root\": \"${CMAKE_SOURCE_DIR}\", \"targets\": {\n${joined}\n}}\n")
endfunction()
