// SPDX-License-Identifier: Apache-2.0
#include "kernels/opencl_device.h"

namespace veduta {

std::string OpenClErrorName(int code) {
  switch (code) {
#define VEDUTA_NAME(name) \
  case name:              \
    return #name;
    VEDUTA_NAME(CL_DEVICE_NOT_FOUND)
    VEDUTA_NAME(CL_DEVICE_NOT_AVAILABLE)
    VEDUTA_NAME(CL_COMPILER_NOT_AVAILABLE)
    VEDUTA_NAME(CL_MEM_OBJECT_ALLOCATION_FAILURE)
    VEDUTA_NAME(CL_OUT_OF_RESOURCES)
    VEDUTA_NAME(CL_OUT_OF_HOST_MEMORY)
    VEDUTA_NAME(CL_BUILD_PROGRAM_FAILURE)
    VEDUTA_NAME(CL_INVALID_VALUE)
    VEDUTA_NAME(CL_INVALID_BINARY)
    VEDUTA_NAME(CL_INVALID_BUFFER_SIZE)
    VEDUTA_NAME(CL_INVALID_KERNEL_NAME)
    VEDUTA_NAME(CL_INVALID_KERNEL_ARGS)
    VEDUTA_NAME(CL_INVALID_ARG_INDEX)
    VEDUTA_NAME(CL_INVALID_ARG_SIZE)
    VEDUTA_NAME(CL_INVALID_WORK_GROUP_SIZE)
    VEDUTA_NAME(CL_INVALID_GLOBAL_WORK_SIZE)
    VEDUTA_NAME(CL_INVALID_WORK_ITEM_SIZE)
#undef VEDUTA_NAME
    default:
      return "error " + std::to_string(code);
  }
}

Status OpenClFailure(const DeviceInfo& info, std::string_view task, const cl::Error& error) {
  return Status::IoError(info.name + ": " + std::string(task) + ": " + error.what() +
                         " failed with " + OpenClErrorName(error.err()) +
                         "; \"cpp\" works without the device");
}

}  // namespace veduta
