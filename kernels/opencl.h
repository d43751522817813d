// SPDX-License-Identifier: Apache-2.0
#pragma once
// OpenCL for the host wrappers of kernels/, and for nobody else: the device's parts, kernels from
// embedded files, errors as Status.
//
// A wrapper looks like this:
//   Status Scale(Device& device, float factor, std::span<float> values) {
//     VEDUTA_ASSIGN_OR_RETURN(cl::Kernel kernel, MakeKernel(device, "scale.cl", "scale"));
//     return WithOpenCl(device, "scaling", [&](OpenClDevice& parts) {
//       cl::Buffer buffer(parts.context, CL_MEM_READ_WRITE, values.size_bytes());
//       parts.queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, values.size_bytes(), values.data());
//       ...
//     });
//   }

#include <new>
#include <string>
#include <string_view>

#include "kernels/device.h"
#include "kernels/opencl_device.h"

namespace veduta {

// A new kernel object, by the kernel's name, from an embedded file of kernels/ ("scale.cl").
// `options` go to the compiler (-D DIM=128); those that keep floats exact, and FP_CONTRACT OFF, are
// added. The first call for a file with these options builds or loads the program, which takes up
// to a second on PoCL. Thread-safe, but only one thread may use the kernel. kIoError with the
// compiler's log if the program does not build.
Result<cl::Kernel> MakeKernel(Device& device, std::string_view file, const char* name,
                              const std::string& options = {});
// The same as MakeKernel, from source text.
Result<cl::Kernel> MakeKernelFromSource(Device& device, std::string_view source, const char* name,
                                        const std::string& options = {});

// Runs body(parts), which may throw cl::Error; that, and what the queue says at its end, becomes a
// Status naming the device and `task`.
template <typename Body>
Status WithOpenCl(Device& device, std::string_view task, Body&& body) {
  try {
    body(device.parts());
    return Status::Ok();
  } catch (const cl::Error& error) {
    return OpenClFailure(device.info(), task, error);
  } catch (const std::bad_alloc&) {
    return Status::IoError(device.info().name + ": " + std::string(task) +
                           ": out of memory on the host");
  }
}

// The least multiple of `unit` that is not less than `count`; for global sizes.
inline size_t RoundUp(size_t count, size_t unit) {
  return (count + unit - 1) / unit * unit;
}

}  // namespace veduta
