// SPDX-License-Identifier: Apache-2.0
// The shading code with the vectors that CMakeLists.txt asks for in this file.
#include "tools/street/shader.h"

#define VEDUTA_SHADER_NAMESPACE shader_portable
#include "tools/street/shader_kernels.inc"

namespace veduta::street {
const ShaderKernels* const kShaderKernelsPortable = &shader_portable::kKernels;
}  // namespace veduta::street
