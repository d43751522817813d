// SPDX-License-Identifier: Apache-2.0
// The shading code with the vectors that CMakeLists.txt asks for in this file.
#define VEDUTA_SHADER_NAMESPACE shader_avx2
#define VEDUTA_SHADER_NAME "avx2"
#include "tools/render/street/shader_lanes.inc"
