// SPDX-License-Identifier: Apache-2.0
#include "kernels/opencl.h"

#include <algorithm>
#include <vector>

#include "kernels/kernel_sources.h"

namespace veduta {
namespace {

constexpr size_t kLogBytesMax = 4000;  // of a compiler's log in an error; chosen by hand

// Makes the program from its kept binary; false if there is none or the driver refuses it.
bool LoadProgram(OpenClDevice& parts, const std::string& key, const std::string& options,
                 cl::Program* program) {
  const auto binary = parts.cache.Find(key);
  if (!binary) return false;
  try {
    *program = cl::Program(parts.context, {parts.device}, {*binary});
    program->build({parts.device}, options.c_str());
    return true;
  } catch (const cl::Error&) {
    return false;
  }
}

void KeepProgram(OpenClDevice& parts, const std::string& key, const cl::Program& program) {
  try {
    const std::vector<std::vector<unsigned char>> binaries = program.getInfo<CL_PROGRAM_BINARIES>();
    if (binaries.size() == 1) parts.cache.Keep(key, binaries[0]);
  } catch (const cl::Error&) {
    // This driver does not give out its binaries, so programs are built anew each time.
  }
}

Status BuildFailure(const DeviceInfo& info, const char* name, const std::string& options,
                    std::string log) {
  if (log.size() > kLogBytesMax) log = log.substr(0, kLogBytesMax) + "...";
  return Status::IoError(info.name + ": the program of kernel " + name + " does not build with \"" +
                         options + "\": " + log);
}

Result<cl::Program> GetProgram(OpenClDevice& parts, const std::string& source, const char* name,
                               const std::string& options) {
  const std::string key = parts.driver_key + options + "\n" + source;
  const std::lock_guard lock(parts.mutex);
  if (const auto known = parts.programs.find(key); known != parts.programs.end())
    return known->second;
  cl::Program program;
  if (LoadProgram(parts, key, options, &program)) {
    ++parts.programs_loaded;
  } else {
    try {
      program = cl::Program(parts.context, source);
      program.build({parts.device}, options.c_str());
    } catch (const cl::BuildError& error) {
      std::string log;
      for (const auto& [device, text] : error.getBuildLog()) log += text;
      return BuildFailure(parts.info, name, options, log);
    } catch (const cl::Error& error) {
      return OpenClFailure(parts.info, std::string("building kernel ") + name, error);
    }
    ++parts.programs_built;
    KeepProgram(parts, key, program);
  }
  parts.programs.emplace(key, program);
  return program;
}

}  // namespace

Result<cl::Kernel> MakeKernelFromSource(Device& device, std::string_view source, const char* name,
                                        const std::string& options) {
  OpenClDevice& parts = device.parts();
  const std::string all_options =
      "-cl-std=CL1.2" + parts.exact_float_options + (options.empty() ? "" : " ") + options;
  VEDUTA_ASSIGN_OR_RETURN(
      const cl::Program program,
      GetProgram(parts, "#pragma OPENCL FP_CONTRACT OFF\n" + std::string(source), name,
                 all_options));
  try {
    return cl::Kernel(program, name);
  } catch (const cl::Error& error) {
    return OpenClFailure(parts.info, std::string("making kernel ") + name, error);
  }
}

Result<cl::Kernel> MakeKernel(Device& device, std::string_view file, const char* name,
                              const std::string& options) {
  const std::span<const KernelSource> sources = KernelSources();
  const auto found =
      std::find_if(sources.begin(), sources.end(), [&](const auto& s) { return s.file == file; });
  VEDUTA_CHECK(found != sources.end(), "no embedded file is " + std::string(file));
  return MakeKernelFromSource(device, found->text, name, options);
}

}  // namespace veduta
