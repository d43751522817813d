// SPDX-License-Identifier: Apache-2.0
// The shading code with the vectors that CMakeLists.txt asks for in this file.
#include "tools/street/shader.h"

#if defined(__AVX2__)
#define VEDUTA_SHADER_NAMESPACE shader_avx2
#include "tools/street/shader_kernels.inc"

namespace veduta::street {
const ShaderKernels* const kShaderKernelsAvx2 = &shader_avx2::kKernels;
}  // namespace veduta::street
#else
namespace veduta::street {
const ShaderKernels* const kShaderKernelsAvx2 = nullptr;
}  // namespace veduta::street
#endif
