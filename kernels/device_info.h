// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is known of an OpenCL device before it is opened. Standard library only.

#include <cstdint>
#include <string>

namespace veduta {

enum class DeviceKind : uint8_t { kCpu = 0, kGpu = 1, kOther = 2 };

struct DeviceInfo {
  uint32_t index = 0;  // in the drivers' order
  std::string name, platform, driver_version;
  DeviceKind kind = DeviceKind::kOther;
  uint32_t compute_units = 0;  // of a CPU: how many threads work
  uint64_t memory_bytes = 0;
  uint64_t allocation_bytes_max = 0;  // of one buffer
};

const char* DeviceKindName(DeviceKind kind);

}  // namespace veduta
