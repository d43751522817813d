// SPDX-License-Identifier: Apache-2.0
#include "kernels/device.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <utility>

#include "kernels/opencl_device.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr uint32_t kThreadCountMax = 4096;  // more than any processor has; chosen by hand

DeviceKind KindOf(cl_device_type type) {
  if (type & CL_DEVICE_TYPE_GPU) return DeviceKind::kGpu;
  return type & CL_DEVICE_TYPE_CPU ? DeviceKind::kCpu : DeviceKind::kOther;
}

DeviceInfo Describe(const cl::Platform& platform, const cl::Device& device) {
  DeviceInfo info;
  info.name = device.getInfo<CL_DEVICE_NAME>();
  info.platform = platform.getInfo<CL_PLATFORM_NAME>();
  info.driver_version = device.getInfo<CL_DRIVER_VERSION>();
  info.kind = KindOf(device.getInfo<CL_DEVICE_TYPE>());
  info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  info.memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.allocation_bytes_max = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  return info;
}

struct FoundDevice {
  DeviceInfo info;
  cl::Platform platform;
  cl::Device device;
};

// "No platform" and "no device" are errors to OpenCL; to us they are an empty list.
std::vector<FoundDevice> FindDevices() {
  std::vector<FoundDevice> found;
  std::vector<cl::Platform> platforms;
  try {
    cl::Platform::get(&platforms);
  } catch (const cl::Error&) {
    return found;
  }
  for (const cl::Platform& platform : platforms) {
    try {
      std::vector<cl::Device> devices;
      platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
      for (const cl::Device& device : devices) {
        if (device.getInfo<CL_DEVICE_AVAILABLE>() == CL_FALSE) continue;
        found.push_back({Describe(platform, device), platform, device});
      }
    } catch (const cl::Error&) {
      continue;
    }
  }
  for (size_t i = 0; i < found.size(); ++i) found[i].info.index = static_cast<uint32_t>(i);
  return found;
}

std::vector<DeviceInfo> InfosOf(const std::vector<FoundDevice>& found) {
  std::vector<DeviceInfo> infos;
  for (const FoundDevice& one : found) infos.push_back(one.info);
  return infos;
}

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

// A processor's device with fewer threads: a part of it.
cl::Device LimitThreads(const cl::Device& device, DeviceInfo* info, uint32_t thread_count) {
  if (thread_count == 0 || thread_count >= info->compute_units || info->kind != DeviceKind::kCpu)
    return device;
  const cl_device_partition_property properties[] = {
      CL_DEVICE_PARTITION_BY_COUNTS, static_cast<cl_device_partition_property>(thread_count),
      CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0};
  std::vector<cl::Device> parts;
  cl::Device whole = device;
  whole.createSubDevices(properties, &parts);
  info->compute_units = thread_count;
  return parts.at(0);
}

std::string ExactFloatOptions(const cl::Device& device) {
  const cl_device_fp_config config = device.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>();
  return config & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT ? " -cl-fp32-correctly-rounded-divide-sqrt"
                                                      : "";
}

}  // namespace

const char* DeviceKindName(DeviceKind kind) {
  switch (kind) {
    case DeviceKind::kCpu:
      return "cpu";
    case DeviceKind::kGpu:
      return "gpu";
    case DeviceKind::kOther:
      return "other";
  }
  return "other";
}

bool WantsNoDevice(std::string_view wanted) {
  return wanted == "cpp" || wanted == "none";
}

std::vector<DeviceInfo> ListDevices() {
  return InfosOf(FindDevices());
}

Result<DeviceInfo> ChooseDevice(std::string_view wanted, const std::vector<DeviceInfo>& devices) {
  if (WantsNoDevice(wanted))
    return Status::NotFound("\"" + std::string(wanted) + "\" asks for no OpenCL device");
  if (devices.empty()) {
    return Status::NotFound(
        "there is no OpenCL device; install a driver (for the processor: pocl-opencl-icd), or ask "
        "for \"cpp\"");
  }
  const auto first = [&](const auto& is_wanted) -> const DeviceInfo* {
    const auto found = std::find_if(devices.begin(), devices.end(), is_wanted);
    return found == devices.end() ? nullptr : &*found;
  };
  const std::string text = LowerCase(wanted);
  const bool automatic = text.empty() || text == "auto";
  const DeviceInfo* device = nullptr;
  if (automatic || text == "gpu")
    device = first([](const DeviceInfo& d) { return d.kind == DeviceKind::kGpu; });
  if ((automatic && !device) || text == "cpu") {
    device = first([](const DeviceInfo& d) { return d.kind == DeviceKind::kCpu; });
  }
  if (automatic && !device) device = &devices.front();
  if (automatic || text == "gpu" || text == "cpu") {
    if (device) return *device;
  } else if (text.find_first_not_of("0123456789") == std::string::npos) {
    device = first([&](const DeviceInfo& d) { return std::to_string(d.index) == text; });
  } else {
    device = first([&](const DeviceInfo& d) {
      return LowerCase(d.name).find(text) != std::string::npos ||
             LowerCase(d.platform).find(text) != std::string::npos;
    });
  }
  if (device) return *device;
  std::string message = "no OpenCL device is \"" + std::string(wanted) + "\"; there is";
  for (const DeviceInfo& d : devices)
    message += " " + std::to_string(d.index) + ": " + d.name + ";";
  return Status::NotFound(message + " \"cpp\" asks for none");
}

Status DeviceOptions::Check() const {
  return OptionBounds().Between("thread_count", thread_count, 0, kThreadCountMax).status();
}

Device::Device(std::unique_ptr<OpenClDevice> parts) : parts_(std::move(parts)) {}
Device::~Device() = default;

Result<std::unique_ptr<Device>> Device::Open(const DeviceOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  std::vector<FoundDevice> found = FindDevices();
  VEDUTA_ASSIGN_OR_RETURN(const DeviceInfo chosen, ChooseDevice(options.wanted, InfosOf(found)));
  const FoundDevice& one = found[chosen.index];
  auto parts = std::make_unique<OpenClDevice>();
  parts->info = chosen;
  parts->cache = ProgramCache(options.cache_folder);
  try {
    parts->device = LimitThreads(one.device, &parts->info, options.thread_count);
    parts->context = cl::Context(parts->device);
    parts->queue = cl::CommandQueue(parts->context, parts->device);
    parts->exact_float_options = ExactFloatOptions(parts->device);
    parts->driver_key = chosen.platform + "\n" + one.platform.getInfo<CL_PLATFORM_VERSION>() +
                        "\n" + chosen.name + "\n" + chosen.driver_version + "\n";
  } catch (const cl::Error& error) {
    return OpenClFailure(chosen, "opening", error);
  }
  return std::unique_ptr<Device>(new Device(std::move(parts)));
}

const DeviceInfo& Device::info() const {
  return parts_->info;
}

uint32_t Device::programs_built() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->programs_built;
}

uint32_t Device::programs_loaded() const {
  const std::lock_guard lock(parts_->mutex);
  return parts_->programs_loaded;
}

}  // namespace veduta
