# SPDX-License-Identifier: Apache-2.0
# Writes the C++ file OUT that holds the text of each of FILES (separated by |):
#   cmake -D OUT=... -D FILES=... -P embed_sources.cmake
if(FILES STREQUAL "")
  message(FATAL_ERROR "embed_sources.cmake: there is no file to embed")
endif()
string(REPLACE "|" ";" files "${FILES}")
set(entries "")
foreach(file IN LISTS files)
  get_filename_component(name ${file} NAME)
  file(READ ${file} text)
  # A compiler need not take a literal longer than 65536 bytes; the pieces join.
  set(literals "")
  string(LENGTH "${text}" length)
  set(begin 0)
  while(begin LESS length)
    string(SUBSTRING "${text}" ${begin} 8000 piece)
    string(APPEND literals "R\"cl(${piece})cl\"\n")
    math(EXPR begin "${begin} + 8000")
  endwhile()
  string(APPEND entries "    {\"${name}\",\n${literals}},\n")
endforeach()
file(WRITE ${OUT} "// Made by kernels/embed_sources.cmake; do not edit.
#include \"kernels/kernel_sources.h\"

namespace veduta {
namespace {

constexpr KernelSource kSources[] = {
${entries}};

}  // namespace

std::span<const KernelSource> KernelSources() {
  return kSources;
}

}  // namespace veduta
")
