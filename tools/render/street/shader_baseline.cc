// SPDX-License-Identifier: Apache-2.0
// The shading code with the vectors that CMakeLists.txt asks for in this file.
#define VEDUTA_SHADER_NAMESPACE shader_baseline
#define VEDUTA_SHADER_NAME "baseline"
#include "tools/render/street/shader_lanes.inc"
