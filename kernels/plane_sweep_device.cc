// SPDX-License-Identifier: Apache-2.0
#include "kernels/plane_sweep_device.h"

#include <algorithm>
#include <iterator>

#include "kernels/opencl.h"
#include "kernels/scan_direction.h"

namespace veduta {
namespace {

constexpr uint32_t kPad = 16;         // PAD of plane_sweep.cl
constexpr uint32_t kPixelBlock = 16;  // pixels that one work item of cost_block serves
// Group sizes are stated throughout: PoCL compiles a kernel anew for each size that it chooses
// itself.

cl::Buffer Upload(OpenClDevice& parts, const void* data, size_t bytes) {
  cl::Buffer buffer(parts.context, CL_MEM_READ_ONLY, bytes);
  parts.queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, data);
  return buffer;
}

template <typename... Arguments>
void SetArguments(cl::Kernel& kernel, const Arguments&... arguments) {
  cl_uint index = 0;
  (kernel.setArg(index++, arguments), ...);
}

// The key view with the ends of its rows repeated: PAD columns more on either side, and on the
// right up to a multiple of the block.
std::vector<uint8_t> PadRows(const GrayView& view, uint32_t stride) {
  std::vector<uint8_t> padded(static_cast<size_t>(stride) * view.height_px);
  for (uint32_t y = 0; y < view.height_px; ++y) {
    const uint8_t* row = view.pixels + static_cast<size_t>(y) * view.width_px;
    uint8_t* out = padded.data() + static_cast<size_t>(y) * stride;
    std::fill_n(out, kPad, row[0]);
    std::copy_n(row, view.width_px, out + kPad);
    std::fill(out + kPad + view.width_px, out + stride, row[view.width_px - 1]);
  }
  return padded;
}

// Waits for what was launched where somebody may ask to stop: otherwise all would be launched
// before it is looked whether somebody did.
bool IsStopped(OpenClDevice& parts, const std::stop_token& stop) {
  if (stop.stop_possible()) parts.queue.finish();
  return stop.stop_requested();
}

// Of work on the device that has ended, with what it says, or was stopped.
Status EndOf(const Status& done, const std::stop_token& stop) {
  if (done.ok() && stop.stop_requested())
    return Status::Cancelled("the work on the device was stopped on request");
  return done;
}

struct Kernels {
  cl::Kernel warp, cost, scan, choose;
};

Status MakeSweepKernels(Device& device, Kernels* kernels) {
  const std::string options =
      "-D COST_MAX=" + std::to_string(kCostMax) + " -D UNSEEN_COST=" + std::to_string(kUnseenCost);
  VEDUTA_ASSIGN_OR_RETURN(kernels->warp,
                          MakeKernel(device, "plane_sweep.cl", "warp_block", options));
  VEDUTA_ASSIGN_OR_RETURN(kernels->cost,
                          MakeKernel(device, "plane_sweep.cl", "cost_block", options));
  return Status::Ok();
}

Status MakeScanKernels(Device& device, Kernels* kernels) {
  VEDUTA_ASSIGN_OR_RETURN(kernels->scan, MakeKernel(device, "scanline.cl", "run_scanlines"));
  VEDUTA_ASSIGN_OR_RETURN(kernels->choose, MakeKernel(device, "scanline.cl", "choose_planes"));
  return Status::Ok();
}

// What a sweep reads and writes on the device besides the costs.
struct SweepBuffers {
  uint32_t stride = 0;     // of a padded row
  size_t block_bytes = 0;  // of one sensor view on a block of planes
  cl::Buffer key, base, planes, warped, seen;
  std::vector<cl::Buffer> images, geometries;  // of each sensor view
};

SweepBuffers UploadSweep(OpenClDevice& parts, const SweepProblem& problem) {
  SweepBuffers buffers;
  buffers.stride = static_cast<uint32_t>(RoundUp(problem.key.width_px, kPixelBlock)) + 2 * kPad;
  buffers.block_bytes = static_cast<size_t>(buffers.stride) * problem.key.height_px * kPlaneBlock;
  const std::vector<uint8_t> padded = PadRows(problem.key, buffers.stride);
  buffers.key = Upload(parts, padded.data(), padded.size());
  buffers.base = problem.base.empty()
                     ? cl::Buffer(parts.context, CL_MEM_READ_ONLY, sizeof(float))
                     : Upload(parts, problem.base.data(), problem.base.size() * sizeof(float));
  std::vector<SweepPlane> planes = problem.planes;
  planes.resize(PlaneStride(static_cast<uint32_t>(planes.size())), SweepPlane::Gap());
  static_assert(sizeof(SweepPlane) == 3 * sizeof(float));
  buffers.planes = Upload(parts, planes.data(), planes.size() * sizeof(SweepPlane));
  for (const SweepSensor& sensor : problem.sensors) {
    float geometry[12];
    std::copy(sensor.translation.begin(), sensor.translation.end(),
              std::copy(sensor.rotation.begin(), sensor.rotation.end(), geometry));
    buffers.geometries.push_back(Upload(parts, geometry, sizeof(geometry)));
    buffers.images.push_back(
        Upload(parts, sensor.image.pixels,
               static_cast<size_t>(sensor.image.width_px) * sensor.image.height_px));
  }
  const size_t all_bytes = buffers.block_bytes * problem.sensors.size();
  buffers.warped = cl::Buffer(parts.context, CL_MEM_READ_WRITE, all_bytes);
  buffers.seen = cl::Buffer(parts.context, CL_MEM_READ_WRITE, all_bytes);
  return buffers;
}

void EnqueueSweep(OpenClDevice& parts, const SweepProblem& problem, Kernels& kernels,
                  const std::stop_token& stop, const cl::Buffer& costs) {
  const SweepBuffers buffers = UploadSweep(parts, problem);
  const cl_int width = static_cast<cl_int>(problem.key.width_px),
               height = static_cast<cl_int>(problem.key.height_px),
               stride = static_cast<cl_int>(buffers.stride),
               sensor_count = static_cast<cl_int>(problem.sensors.size()),
               has_base = problem.base.empty() ? 0 : 1;
  const uint32_t plane_stride = PlaneStride(static_cast<uint32_t>(problem.planes.size()));
  for (uint32_t first = 0; first < plane_stride; first += kPlaneBlock) {
    if (IsStopped(parts, stop)) return;
    const cl_int first_plane = static_cast<cl_int>(first);
    for (size_t s = 0; s < problem.sensors.size(); ++s) {
      const GrayView& image = problem.sensors[s].image;
      SetArguments(kernels.warp, buffers.images[s], static_cast<cl_int>(image.width_px),
                   static_cast<cl_int>(image.height_px), buffers.geometries[s], buffers.base,
                   has_base, buffers.planes, first_plane, width, height, stride,
                   static_cast<cl_ulong>(s * buffers.block_bytes), buffers.warped, buffers.seen);
      parts.queue.enqueueNDRangeKernel(
          kernels.warp, cl::NullRange,
          cl::NDRange(buffers.stride, problem.key.height_px, kPlaneBlock),
          cl::NDRange(kPixelBlock, 1, 1));
    }
    SetArguments(kernels.cost, buffers.key, buffers.warped, buffers.seen, width, height, stride,
                 sensor_count, buffers.planes, first_plane, static_cast<cl_int>(plane_stride),
                 costs);
    parts.queue.enqueueNDRangeKernel(
        kernels.cost, cl::NullRange,
        cl::NDRange((problem.key.width_px + kPixelBlock - 1) / kPixelBlock, problem.key.height_px));
  }
}

void ScanAndRead(OpenClDevice& parts, const GrayView& key, uint32_t plane_count,
                 const ScanlineOptions& options, Kernels& kernels, const cl::Buffer& costs,
                 const std::stop_token& stop, PlaneChoice* choice) {
  const uint32_t width = key.width_px, height = key.height_px;
  const size_t pixels = static_cast<size_t>(width) * height;
  const cl_int blocks = static_cast<cl_int>(PlaneStride(plane_count) / kPlaneBlock);
  const cl::Buffer gray = Upload(parts, key.pixels, pixels);
  const cl::Buffer penalty_large =
      Upload(parts, options.penalty_large.data(), options.penalty_large.size());
  const cl::Buffer sums(parts.context, CL_MEM_READ_WRITE,
                        pixels * PlaneStride(plane_count) * sizeof(uint16_t));
  for (const ScanDirection& direction : kScanDirectionTable) {
    if (IsStopped(parts, stop)) return;
    const cl_int is_first = &direction == std::begin(kScanDirectionTable) ? 1 : 0;
    SetArguments(kernels.scan, costs, gray, penalty_large,
                 static_cast<cl_uchar>(options.penalty_small), static_cast<cl_int>(width),
                 static_cast<cl_int>(height), blocks, static_cast<cl_int>(direction.dx),
                 static_cast<cl_int>(direction.dy), is_first, sums);
    // One line for each group: neighboring lines share nothing, and a processor's threads take one
    // group at a time.
    parts.queue.enqueueNDRangeKernel(kernels.scan, cl::NullRange,
                                     cl::NDRange(direction.LineCount(width, height)),
                                     cl::NDRange(1));
  }
  const cl::Buffer chosen(parts.context, CL_MEM_WRITE_ONLY, 5 * pixels * sizeof(uint16_t));
  SetArguments(kernels.choose, sums, static_cast<cl_int>(plane_count), blocks,
               static_cast<cl_uint>(pixels), chosen);
  parts.queue.enqueueNDRangeKernel(kernels.choose, cl::NullRange,
                                   cl::NDRange(RoundUp(pixels, kPixelBlock)),
                                   cl::NDRange(kPixelBlock));
  size_t offset = 0;
  for (auto* values : {&choice->plane, &choice->cost_before, &choice->cost, &choice->cost_after,
                       &choice->cost_second}) {
    const size_t bytes = pixels * sizeof(uint16_t);
    parts.queue.enqueueReadBuffer(chosen, CL_TRUE, offset, bytes, values->data());
    offset += bytes;
  }
}

size_t VolumeBytes(const GrayView& key, uint32_t plane_count) {
  return static_cast<size_t>(key.width_px) * key.height_px * PlaneStride(plane_count);
}

}  // namespace

Status SweepPlanesOnDevice(const SweepProblem& problem, Device& device, const std::stop_token& stop,
                           CostVolume* volume) {
  Kernels kernels;
  VEDUTA_RETURN_IF_ERROR(MakeSweepKernels(device, &kernels));
  const Status done = WithOpenCl(device, "plane sweep", [&](OpenClDevice& parts) {
    const cl::Buffer costs(parts.context, CL_MEM_READ_WRITE, volume->costs.size());
    EnqueueSweep(parts, problem, kernels, stop, costs);
    parts.queue.enqueueReadBuffer(costs, CL_TRUE, 0, volume->costs.size(), volume->costs.data());
  });
  return EndOf(done, stop);
}

Status ChoosePlanesOnDevice(const CostVolume& volume, const GrayView& key,
                            const ScanlineOptions& options, Device& device,
                            const std::stop_token& stop, PlaneChoice* choice) {
  Kernels kernels;
  VEDUTA_RETURN_IF_ERROR(MakeScanKernels(device, &kernels));
  const Status done = WithOpenCl(device, "scanline optimisation", [&](OpenClDevice& parts) {
    const cl::Buffer costs = Upload(parts, volume.costs.data(), volume.costs.size());
    ScanAndRead(parts, key, volume.plane_count, options, kernels, costs, stop, choice);
  });
  return EndOf(done, stop);
}

Status SweepAndChooseOnDevice(const SweepProblem& problem, const ScanlineOptions& options,
                              Device& device, const std::stop_token& stop, PlaneChoice* choice) {
  Kernels kernels;
  VEDUTA_RETURN_IF_ERROR(MakeSweepKernels(device, &kernels));
  VEDUTA_RETURN_IF_ERROR(MakeScanKernels(device, &kernels));
  const auto plane_count = static_cast<uint32_t>(problem.planes.size());
  const auto sweep_and_choose = [&](OpenClDevice& parts) {
    const cl::Buffer costs(parts.context, CL_MEM_READ_WRITE, VolumeBytes(problem.key, plane_count));
    EnqueueSweep(parts, problem, kernels, stop, costs);
    ScanAndRead(parts, problem.key, plane_count, options, kernels, costs, stop, choice);
  };
  return EndOf(WithOpenCl(device, "plane sweep and scanline optimisation", sweep_and_choose), stop);
}

}  // namespace veduta
