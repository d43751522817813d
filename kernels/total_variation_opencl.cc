// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <string>

#include "kernels/opencl.h"
#include "kernels/total_variation.h"
#include "kernels/total_variation_kernels.h"
#include "kernels/total_variation_rows.h"

namespace veduta {
namespace {

constexpr size_t kPaddingBytes = kTvRow * sizeof(float);
constexpr size_t kGroup = 64;  // rows

// A float as the compiler reads it back exactly.
std::string ExactFloat(float value) {
  char text[40];
  std::snprintf(text, sizeof(text), "%af", static_cast<double>(value));
  return text;
}

class OpenClTotalVariation final : public TotalVariation {
 public:
  OpenClTotalVariation(Device& device, uint32_t block_count, cl::Kernel dual, cl::Kernel primal,
                       cl::Kernel energy)
      : device_(device),
        rows_(block_count * kTvRowsOfBlock),
        dual_(std::move(dual)),
        primal_(std::move(primal)),
        energy_(std::move(energy)) {}

  Status Load(const TvProblem& problem, std::span<const float> u, std::span<const float> p) {
    return WithOpenCl(device_, "total variation", [&](OpenClDevice& parts) {
      if (rows_ == 0) return;
      neighbors_ = MakeBuffer(parts, problem.neighbors);
      weights_ = MakeBuffer(parts, problem.weights);
      centers_ = MakeBuffer(parts, problem.centers);
      const std::vector<uint32_t> bits = BitsOfRows(problem);
      bits_ = MakeBuffer(parts, bits);
      std::vector<float> padded(u.size() + 2 * kTvRow, 0.f);
      const std::vector<float> fitted =
          p.empty() ? std::vector<float>(3 * u.size(), 0.f) : FitDual(problem, bits, p);
      for (size_t axis = 0; axis < 3; ++axis) {
        std::copy_n(fitted.begin() + static_cast<std::ptrdiff_t>(axis * u.size()), u.size(),
                    padded.begin() + kTvRow);
        p_[axis] = MakeBuffer(parts, padded);
      }
      std::copy(u.begin(), u.end(), padded.begin() + kTvRow);
      u_ = MakeBuffer(parts, padded);
      u_bar_ = MakeBuffer(parts, padded);
      energies_ = cl::Buffer(parts.context, CL_MEM_READ_WRITE, 2 * sizeof(cl_long) * rows_);
      const auto rows = static_cast<cl_int>(rows_);
      SetArguments(dual_, u_bar_, p_[0], p_[1], p_[2], neighbors_, bits_, rows);
      SetArguments(primal_, u_, u_bar_, p_[0], p_[1], p_[2], neighbors_, weights_, centers_, bits_,
                   problem.lambda, rows);
      SetArguments(energy_, u_, p_[0], p_[1], p_[2], neighbors_, weights_, centers_, bits_,
                   problem.lambda, energies_, rows);
    });
  }

  Status Iterate(uint32_t count) override {
    return WithOpenCl(device_, "total variation", [&](OpenClDevice& parts) {
      for (uint32_t i = 0; i < count && rows_ > 0; ++i) {
        Enqueue(parts, dual_);
        Enqueue(parts, primal_);
      }
      parts.queue.finish();
    });
  }

  Result<TvEnergy> Energy() override {
    std::vector<cl_long> energies(2 * static_cast<size_t>(rows_));
    VEDUTA_RETURN_IF_ERROR(
        WithOpenCl(device_, "energy of total variation", [&](OpenClDevice& parts) {
          if (rows_ == 0) return;
          Enqueue(parts, energy_);
          parts.queue.enqueueReadBuffer(energies_, CL_TRUE, 0, energies.size() * sizeof(cl_long),
                                        energies.data());
        }));
    cl_long primal = 0, dual = 0;
    for (size_t i = 0; i < energies.size(); i += 2) {
      primal += energies[i];
      dual += energies[i + 1];
    }
    return TvEnergy{static_cast<double>(primal) / kTvEnergyOne,
                    static_cast<double>(dual) / kTvEnergyOne};
  }

  Result<std::vector<float>> Read() override {
    std::vector<float> u(static_cast<size_t>(rows_) * kTvRow);
    VEDUTA_RETURN_IF_ERROR(WithOpenCl(device_, "reading total variation", [&](OpenClDevice& parts) {
      if (rows_ == 0) return;
      parts.queue.enqueueReadBuffer(u_, CL_TRUE, kPaddingBytes, u.size() * sizeof(float), u.data());
    }));
    return u;
  }

  Result<std::vector<float>> ReadDual() override {
    const size_t voxels = static_cast<size_t>(rows_) * kTvRow;
    std::vector<float> p(3 * voxels);
    VEDUTA_RETURN_IF_ERROR(WithOpenCl(device_, "reading total variation", [&](OpenClDevice& parts) {
      for (size_t axis = 0; axis < 3 && rows_ > 0; ++axis) {
        parts.queue.enqueueReadBuffer(p_[axis], CL_TRUE, kPaddingBytes, voxels * sizeof(float),
                                      p.data() + axis * voxels);
      }
    }));
    return p;
  }

 private:
  template <typename T>
  static cl::Buffer MakeBuffer(OpenClDevice& parts, const std::vector<T>& values) {
    const size_t bytes = values.size() * sizeof(T);
    cl::Buffer buffer(parts.context, CL_MEM_READ_WRITE, bytes);
    parts.queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, bytes, values.data());
    return buffer;
  }
  template <typename... Arguments>
  static void SetArguments(cl::Kernel& kernel, const Arguments&... arguments) {
    cl_uint index = 0;
    (kernel.setArg(index++, arguments), ...);
  }
  void Enqueue(OpenClDevice& parts, const cl::Kernel& kernel) {
    parts.queue.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(RoundUp(rows_, kGroup)),
                                     cl::NDRange(kGroup));
  }

  Device& device_;
  const uint32_t rows_;
  cl::Kernel dual_, primal_, energy_;
  cl::Buffer u_, u_bar_, p_[3], neighbors_, weights_, centers_, bits_, energies_;
};

}  // namespace

Result<std::unique_ptr<TotalVariation>> StartTotalVariationOn(Device& device,
                                                              const TvProblem& problem,
                                                              std::span<const float> u,
                                                              std::span<const float> p) {
  const std::string options = "-D TAU=" + ExactFloat(kTvTau) + " -D SIGMA=" + ExactFloat(kTvSigma);
  const auto make = [&](const char* name) {
    return MakeKernel(device, "total_variation.cl", name, options);
  };
  VEDUTA_ASSIGN_OR_RETURN(cl::Kernel dual, make("DualStep"));
  VEDUTA_ASSIGN_OR_RETURN(cl::Kernel primal, make("PrimalStep"));
  VEDUTA_ASSIGN_OR_RETURN(cl::Kernel energy, make("RowEnergies"));
  auto minimisation =
      std::make_unique<OpenClTotalVariation>(device, problem.block_count, dual, primal, energy);
  VEDUTA_RETURN_IF_ERROR(minimisation->Load(problem, u, p));
  return std::unique_ptr<TotalVariation>(std::move(minimisation));
}

}  // namespace veduta
