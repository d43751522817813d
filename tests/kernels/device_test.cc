// SPDX-License-Identifier: Apache-2.0
// Goal: devices are chosen as asked; programs are built once, kept, and built again where what
//   was kept is damaged or of another; floats are exact; errors name the device.
// Method: made-up lists of devices; small programs from source on this machine's device
//   (skipped without one), with caches in a folder of their own that the test damages.
#include "kernels/device.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <vector>

#include "kernels/opencl.h"
#include "storage/base/content_hash.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

DeviceInfo Made(uint32_t index, const char* name, DeviceKind kind) {
  DeviceInfo info;
  info.index = index;
  info.name = name;
  info.platform = kind == DeviceKind::kGpu ? "Vendor CUDA" : "Portable Computing Language";
  info.kind = kind;
  return info;
}

const std::vector<DeviceInfo>& MadeDevices() {
  static const std::vector<DeviceInfo> devices = {Made(0, "pthread-x", DeviceKind::kCpu),
                                                  Made(1, "Accelerator", DeviceKind::kOther),
                                                  Made(2, "Fast 9000", DeviceKind::kGpu)};
  return devices;
}

TEST(ChooseDevice, TakesWhatIsWanted) {
  const auto index = [](std::string_view wanted) {
    return ChooseDevice(wanted, MadeDevices()).value().index;
  };
  EXPECT_EQ(index(""), 2u);
  EXPECT_EQ(index("auto"), 2u);
  EXPECT_EQ(index("cpu"), 0u);
  EXPECT_EQ(index("1"), 1u);
  EXPECT_EQ(index("fast"), 2u);
  EXPECT_EQ(index("portable"), 0u);
  EXPECT_EQ(ChooseDevice("auto", {Made(0, "a", DeviceKind::kOther), Made(1, "b", DeviceKind::kCpu)})
                ->index,
            1u);
  EXPECT_EQ(ChooseDevice("auto", {Made(0, "a", DeviceKind::kOther)})->index, 0u);
}

TEST(ChooseDevice, NamesWhatIsMissing) {
  for (const char* wanted : {"7", "voodoo", "cpp", "none"}) {
    const Result<DeviceInfo> chosen = ChooseDevice(wanted, MadeDevices());
    ASSERT_EQ(chosen.status().code(), StatusCode::kNotFound) << wanted;
    EXPECT_NE(chosen.status().message().find(wanted), std::string::npos)
        << chosen.status().message();
  }
  EXPECT_NE(ChooseDevice("voodoo", MadeDevices()).status().message().find("Fast 9000"),
            std::string::npos);
  EXPECT_NE(ChooseDevice("", {}).status().message().find("install"), std::string::npos);
  EXPECT_EQ(ChooseDevice("gpu", {Made(0, "a", DeviceKind::kCpu)}).status().code(),
            StatusCode::kNotFound);
}

TEST(DeviceOptions, EveryBoundIsNoticed) {
  ExpectBounds<DeviceOptions, uint32_t>(&DeviceOptions::thread_count, "thread_count",
                                        {4097, UINT32_MAX}, {0, 4096});
}

TEST(DeviceOpen, RefusesBadOptions) {
  EXPECT_EQ(Device::Open({.thread_count = 4097}).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Device::Open({.wanted = "cpp"}).status().code(), StatusCode::kNotFound);
}

class DeviceTest : public testing::Test {
 protected:
  void SetUp() override {
    if (ListDevices().empty()) GTEST_SKIP() << "no OpenCL device";
    char folder[] = "/tmp/veduta_device_XXXXXX";
    ASSERT_NE(mkdtemp(folder), nullptr);
    folder_ = folder;
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  std::unique_ptr<Device> Open() {
    return Device::Open({.cache_folder = folder_ + "/programs"}).value();
  }

  std::vector<std::string> Kept() const {
    std::vector<std::string> paths;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ + "/programs")) {
      paths.push_back(entry.path().string());
    }
    return paths;
  }

  std::string folder_;
};

const char kFloats[] = R"(
kernel void floats(global const float* a, global const float* b, global const float* c,
                   global float* out) {
  const size_t i = get_global_id(0);
  out[3 * i] = a[i] * b[i] + c[i];
  out[3 * i + 1] = a[i] / b[i];
  out[3 * i + 2] = sqrt(fabs(c[i]));
})";

std::vector<float> RunFloats(Device& device, const std::vector<float>& a,
                             const std::vector<float>& b, const std::vector<float>& c) {
  std::vector<float> out(3 * a.size());
  cl::Kernel kernel = MakeKernelFromSource(device, kFloats, "floats").value();
  const Status status = WithOpenCl(device, "floats", [&](OpenClDevice& parts) {
    const auto upload = [&](const std::vector<float>& values) {
      const size_t bytes = values.size() * sizeof(float);
      cl::Buffer buffer(parts.context, CL_MEM_READ_ONLY, bytes);
      parts.queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, values.data());
      return buffer;
    };
    const cl::Buffer buffers[] = {upload(a), upload(b), upload(c)};
    const cl::Buffer result(parts.context, CL_MEM_WRITE_ONLY, out.size() * sizeof(float));
    for (cl_uint i = 0; i < 3; ++i) kernel.setArg(i, buffers[i]);
    kernel.setArg(3, result);
    parts.queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(a.size()), cl::NullRange);
    parts.queue.enqueueReadBuffer(result, CL_TRUE, 0, out.size() * sizeof(float), out.data());
  });
  EXPECT_TRUE(status.ok()) << status.message();
  return out;
}

TEST_F(DeviceTest, FloatsAreExact) {
  const std::unique_ptr<Device> device = Open();
  SeededRandom random(1);
  std::vector<float> a(1000), b(1000), c(1000);
  for (size_t i = 0; i < a.size(); ++i) {
    a[i] = static_cast<float>(random.Unit() * 3 - 1);
    b[i] = static_cast<float>(random.Unit() * 5 + 0.1);
    c[i] = -a[i] * b[i] *
           (1 + static_cast<float>(random.Unit()) * 1e-6f);  // where contraction would show
  }
  const std::vector<float> out = RunFloats(*device, a, b, c);
  for (size_t i = 0; i < a.size(); ++i) {
    const volatile float product = a[i] * b[i];
    EXPECT_EQ(out[3 * i], product + c[i]);
    EXPECT_EQ(out[3 * i + 1], a[i] / b[i]);
    EXPECT_EQ(out[3 * i + 2], std::sqrt(std::fabs(c[i])));
  }
}

TEST_F(DeviceTest, ProgramsAreBuiltOnce) {
  const std::vector<float> one = {1}, two = {2};
  {
    const std::unique_ptr<Device> device = Open();
    RunFloats(*device, one, two, one);
    RunFloats(*device, one, two, one);
    EXPECT_EQ(device->programs_built(), 1u);
    ASSERT_TRUE(MakeKernelFromSource(*device, kFloats, "floats", "-DANOTHER").ok());
    EXPECT_EQ(device->programs_built(), 2u);
  }
  EXPECT_EQ(Kept().size(), 2u);
  const std::unique_ptr<Device> device = Open();
  EXPECT_EQ(RunFloats(*device, one, two, one), (std::vector<float>{3, 0.5f, 1}));
  EXPECT_EQ(device->programs_built(), 0u);
  EXPECT_EQ(device->programs_loaded(), 1u);
}

TEST_F(DeviceTest, ADamagedProgramIsBuiltAgain) {
  const std::vector<float> one = {1}, two = {2};
  RunFloats(*Open(), one, two, one);
  ASSERT_EQ(Kept().size(), 1u);
  const std::string path = Kept()[0];
  const auto size = std::filesystem::file_size(path);
  const auto damage = [&](int kind) {
    if (kind == 0) std::filesystem::resize_file(path, 0);
    if (kind == 1) std::filesystem::resize_file(path, size / 2);
    if (kind == 2) {
      std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(static_cast<std::streamoff>(size - 10));
      file.put('\x5a').put('\x5a');
    }
    // Whole, but nothing that the driver knows: written by a program cache with other contents.
    if (kind == 3) {
      std::filesystem::remove(path);
      const std::vector<unsigned char> foreign = {'f', 'o', 'r', 'e', 'i', 'g', 'n'};
      ProgramCache(folder_ + "/foreign").Keep("key", foreign);
      std::filesystem::copy_file(ProgramCache(folder_ + "/foreign").PathOf("key"), path);
    }
  };
  for (int kind = 0; kind < 4; ++kind) {
    damage(kind);
    const std::unique_ptr<Device> device = Open();
    EXPECT_EQ(RunFloats(*device, one, two, one), (std::vector<float>{3, 0.5f, 1})) << kind;
    EXPECT_EQ(device->programs_built(), 1u) << kind;
    EXPECT_EQ(device->programs_loaded(), 0u) << kind;
    EXPECT_EQ(Kept(), std::vector<std::string>{path}) << kind;
  }
}

TEST_F(DeviceTest, AFolderThatCannotBeWrittenIsNoError) {
  const std::string file = folder_ + "/file";
  std::ofstream(file) << "not a folder";
  const std::unique_ptr<Device> device = Device::Open({.cache_folder = file}).value();
  EXPECT_EQ(RunFloats(*device, {1}, {2}, {1}), (std::vector<float>{3, 0.5f, 1}));
  EXPECT_EQ(device->programs_built(), 1u);
}

TEST_F(DeviceTest, ErrorsNameDeviceAndCall) {
  const std::unique_ptr<Device> device = Open();
  const Status broken =
      MakeKernelFromSource(*device, "kernel void broken() { oops; }", "broken").status();
  EXPECT_EQ(broken.code(), StatusCode::kIoError);
  for (const std::string& word :
       {device->info().name, std::string("broken"), std::string("oops")}) {
    EXPECT_NE(broken.message().find(word), std::string::npos) << broken.message();
  }
  const Status missing = MakeKernelFromSource(*device, kFloats, "absent").status();
  EXPECT_NE(missing.message().find("CL_INVALID_KERNEL_NAME"), std::string::npos)
      << missing.message();
  const Status empty = WithOpenCl(*device, "making nothing", [](OpenClDevice& parts) {
    cl::Buffer(parts.context, CL_MEM_READ_WRITE, 0);
  });
  EXPECT_NE(empty.message().find("making nothing: clCreateBuffer"), std::string::npos)
      << empty.message();
}

TEST(OpenClErrorName, IsThatOfTheStandardOrTheNumber) {
  EXPECT_EQ(OpenClErrorName(CL_OUT_OF_RESOURCES), "CL_OUT_OF_RESOURCES");
  EXPECT_EQ(OpenClErrorName(-1234), "error -1234");
}

TEST_F(DeviceTest, ThreadsAreLimited) {
  const std::vector<DeviceInfo> devices = ListDevices();
  if (!ChooseDevice("cpu", devices).ok()) GTEST_SKIP() << "no CPU device";
  const std::unique_ptr<Device> device = Device::Open({.wanted = "cpu", .thread_count = 1}).value();
  EXPECT_EQ(device->info().compute_units, 1u);
  EXPECT_EQ(RunFloats(*device, {1}, {2}, {1}), (std::vector<float>{3, 0.5f, 1}));
}

}  // namespace
}  // namespace veduta
