// SPDX-License-Identifier: Apache-2.0
#pragma once
// Within kernels/: OpenCL itself, what stands behind a Device, and errors as Status.

// Every driver has at least OpenCL 1.2.
#define CL_HPP_ENABLE_EXCEPTIONS
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#include <CL/opencl.hpp>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "kernels/device_info.h"
#include "kernels/program_cache.h"
#include "storage/base/status.h"

namespace veduta {

struct OpenClDevice {
  DeviceInfo info;
  std::string driver_key;  // what a built program depends on besides source and options
  std::string exact_float_options;
  cl::Device device;
  cl::Context context;
  cl::CommandQueue queue;  // in order
  ProgramCache cache;
  std::mutex mutex;  // guards what follows
  std::map<std::string, cl::Program> programs;
  uint32_t programs_built = 0, programs_loaded = 0;
};

// "CL_OUT_OF_RESOURCES" for -5, and so on; "error -1234" for one that the standard does not name.
std::string OpenClErrorName(int code);
// kIoError: "DEVICE: TASK: CALL failed with CODE".
Status OpenClFailure(const DeviceInfo& info, std::string_view task, const cl::Error& error);

}  // namespace veduta
