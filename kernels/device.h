// SPDX-License-Identifier: Apache-2.0
#pragma once
// An OpenCL device to compute on: a graphics card, or the processor through PoCL. Without a device
// the same is computed in C++.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/device_info.h"
#include "storage/base/status.h"

namespace veduta {

struct OpenClDevice;  // kernels/opencl_device.h

// Every device of every driver. Empty where there is no driver or no device; a driver that fails is
// left out. Thread-safe.
std::vector<DeviceInfo> ListDevices();

// The device that `wanted` names among `devices`:
//   "" or "auto"  the first GPU, else the first CPU, else the first of all;
//   "gpu", "cpu"  the first of that kind;
//   a number      the device of that index;
//   other text    the first device whose name or platform contains it, whatever the case.
// kNotFound naming what there is and what to install where there is no such device.
Result<DeviceInfo> ChooseDevice(std::string_view wanted, const std::vector<DeviceInfo>& devices);

// True for the words that ask for no device at all: "cpp" and "none".
bool WantsNoDevice(std::string_view wanted);

struct DeviceOptions {
  std::string wanted = "auto";  // as ChooseDevice takes it
  // Built programs are kept in this folder, which is made if it is missing. Empty: they are kept in
  // memory only.
  std::string cache_folder = {};
  // [0, 4096] threads of a CPU device; 0: all that it has. Other devices ignore it.
  uint32_t thread_count = 0;

  Status Check() const;  // the first violated bound, named with its value
};

// A device with its queue and its built programs. The programs' results do not depend on the
// device: they compute in integers, or in floats without contraction and with correctly rounded
// division where the driver can.
//
// Thread-safe: each operation makes its own kernel and buffers, and the queue works in order.
class Device final {
 public:
  // kNotFound if there is no such device, or if `wanted` asks for none; kInvalidArgument on bad
  // options; kIoError with the device's name if its driver fails. Where the cache folder cannot be
  // written, programs are built anew each time.
  static Result<std::unique_ptr<Device>> Open(const DeviceOptions& options);

  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const DeviceInfo& info() const;
  // Programs compiled, and programs taken from the folder, since opening.
  uint32_t programs_built() const;
  uint32_t programs_loaded() const;

  // What host wrappers inside kernels/ work with.
  OpenClDevice& parts() { return *parts_; }

 private:
  explicit Device(std::unique_ptr<OpenClDevice> parts);
  std::unique_ptr<OpenClDevice> parts_;
};

}  // namespace veduta
