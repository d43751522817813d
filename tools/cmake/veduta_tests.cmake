# SPDX-License-Identifier: Apache-2.0
# One executable per test file: tests/FOLDER/NAME_test.cc becomes test_FOLDER_NAME.
# Makes the tests of FOLDER, which link the libraries of ours that follow, and those of others that
# follow PRIVATE.
function(veduta_tests folder)
  cmake_parse_arguments(ARG "" "" "PRIVATE" ${ARGN})
  file(GLOB files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*_test.cc)
  if(NOT files)
    message(FATAL_ERROR "tests/${folder}: there is no test there")
  endif()
  string(REPLACE "/" "_" prefix ${folder})
  foreach(file IN LISTS files)
    get_filename_component(name ${file} NAME_WE)
    set(target test_${prefix}_${name})
    veduta_program(${target}
      SOURCES ${file}
      DEPENDS ${ARG_UNPARSED_ARGUMENTS}
      PRIVATE ${ARG_PRIVATE} GTest::gtest_main)
    # Only for tests that name it, as cmake finds when it runs: the compiler cache does not know a
    # source again in another checkout whose definitions have paths.
    file(STRINGS ${file} wants_data REGEX VEDUTA_TEST_DATA)
    if(wants_data)
      target_compile_definitions(${target} PRIVATE VEDUTA_TEST_DATA="${VEDUTA_TEST_DATA}")
    endif()
    # What takes time are the libraries; the tests' own code compiles twice as fast like this.
    if(VEDUTA_SANITIZE)
      target_compile_options(${target} PRIVATE -O0)
    endif()
    # The preset nightly runs all of these, and not a sample.
    set(timeout_s 600)
    if(name MATCHES "^(fault_sweep|bad_days)_test$")
      set(timeout_s 14400)
    endif()
    gtest_discover_tests(${target}
      TEST_PREFIX ${prefix}. DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT ${timeout_s})
  endforeach()
  set_property(GLOBAL APPEND PROPERTY VEDUTA_TEST_FILES ${files})
endfunction()

# Called last: a test file in a folder that no veduta_tests names would never run.
function(veduta_refuse_unmade_tests)
  file(GLOB_RECURSE files CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*_test.cc)
  get_property(made GLOBAL PROPERTY VEDUTA_TEST_FILES)
  list(REMOVE_ITEM files ${made})
  if(files)
    message(FATAL_ERROR "No veduta_tests line in tests/CMakeLists.txt makes these: ${files}")
  endif()
endfunction()
