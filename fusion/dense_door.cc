// SPDX-License-Identifier: Apache-2.0
#include "fusion/dense_door.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "engine/query/find_image.h"
#include "engine/query/living.h"
#include "fusion/export/reconstruction_picture.h"
#include "fusion/export/surface_model.h"
#include "fusion/pass/dense_pass.h"
#include "fusion/surface/model_writer.h"
#include "kernels/device.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// The size of a picture that no photo gives a size. Chosen by hand; not measured.
constexpr uint32_t kPictureWidthPx = 1600, kPictureHeightPx = 1200;
constexpr uint32_t kPictureSideMin = 16, kPictureSideMax = 16384;

// A word of a request and what it means.
template <typename Meaning>
struct Word {
  std::string_view word;
  Meaning meaning;
};
constexpr std::array kSides = {Word<size_t>{"front", 0}, Word<size_t>{"left", 1},
                               Word<size_t>{"right", 2}};  // the order of ThreeSides
constexpr std::array kShadings = {Word<Shading>{"color", Shading::kColor},
                                  Word<Shading>{"clay", Shading::kClay},
                                  Word<Shading>{"normal", Shading::kNormal}};

template <typename Words>
Status CheckWord(const char* field, const std::string& word, const Words& words) {
  std::string known;
  for (const auto& one : words) {
    if (one.word == word) return Status::Ok();
    known += (known.empty() ? "" : ", ") + std::string(one.word);
  }
  return Status::InvalidArgument(std::string(field) + " is '" + word + "', but must be one of " +
                                 known);
}

// The meaning of a word that CheckWord has let pass.
template <typename Words>
auto MeaningOf(const std::string& word, const Words& words) {
  return std::ranges::find_if(words, [&](const auto& one) { return one.word == word; })->meaning;
}

// Null where the C++ paths are to work; `why_cpp` says why, unless they were asked for.
Result<std::unique_ptr<Device>> OpenDevice(const DensifyRequest& request, ThreadPool& pool,
                                           std::string* why_cpp) {
  if (WantsNoDevice(request.device)) return std::unique_ptr<Device>();
  Result<std::unique_ptr<Device>> device =
      Device::Open({.wanted = request.device,
                    .cache_folder = request.cache_folder,
                    .thread_count = static_cast<uint32_t>(pool.thread_count() + 1)});
  const bool may_do_without = request.device.empty() || request.device == "auto";
  if (device.ok() || !may_do_without) return device;
  *why_cpp = device.status().message();
  return std::unique_ptr<Device>();
}

Result<std::vector<ReconstructionId>> WantedReconstructions(const Snapshot& snapshot,
                                                            ReconstructionId wanted) {
  if (wanted.valid()) return std::vector{wanted};
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> records,
                          ListSomeLiving(snapshot));
  std::vector<ReconstructionId> ids;
  for (const ReconstructionRecord& record : records) ids.push_back(record.id);
  return ids;
}

// A pass over one reconstruction; a report that says so where it was merged away before its turn
// came.
Result<DensifyReport> DensifyOne(const DensePassTools& tools, ReconstructionId id,
                                 const DensifyRequest& request) {
  if (!request.reconstruction.valid()) {
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                            tools.writer.GetSnapshot()->GetReconstruction(id));
    if (!record.is_living()) {
      DensifyReport report;
      report.reconstruction = id;
      report.merged_into = record.merged_into;
      report.dissolved = record.is_dissolved;
      return report;
    }
  }
  return RunDensePass(tools, id, request.options);
}

// Whether the next reconstruction would fail as well.
bool EndsAll(const Status& failure) {
  return failure.code() == StatusCode::kCancelled || failure.code() == StatusCode::kIoError ||
         failure.code() == StatusCode::kNoMemory;
}

RenderOptions RenderOptionsOf(const RenderRequest& request) {
  RenderOptions options;
  options.shading = MeaningOf(request.shading, kShadings);
  return options;
}

Drawn WhatToDraw(const RenderRequest& request) {
  return request.points ? Drawn::kPoints : Drawn::kSurfaceOrPoints;
}

Result<RenderReport> RenderFromPhoto(std::shared_ptr<const Snapshot> snapshot, ThreadPool& pool,
                                     const RenderRequest& request, ImageId image) {
  VEDUTA_ASSIGN_OR_RETURN(const ViewGeometry view,
                          PhotoGeometry(*snapshot, image, request.side_px));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot->FindPose(image));
  VEDUTA_ASSIGN_OR_RETURN(Picture picture,
                          DrawReconstruction(*snapshot, pose->reconstruction, WhatToDraw(request),
                                             view, RenderOptionsOf(request), pool));
  RenderReport report;
  if (request.compare) {
    VEDUTA_ASSIGN_OR_RETURN(const BalancedPhoto photo,
                            LoadBalancedPhoto(snapshot, image, request.side_px));
    VEDUTA_ASSIGN_OR_RETURN(const ReprojectedColor error,
                            CompareWithPhoto(picture, photo.view, photo.gain));
    report = {error.covered_share, error.median_error, error.median_error_balanced};
    VEDUTA_ASSIGN_OR_RETURN(picture, SideBySide(picture, photo.view, photo.gain));
  }
  VEDUTA_RETURN_IF_ERROR(WritePng(request.path, picture.width_px, picture.height_px, picture.rgb));
  return report;
}

// From outside, where most photos of the reconstruction look at it from.
Result<ViewGeometry> SideView(const Snapshot& snapshot, ReconstructionId id,
                              const RenderRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Eigen::AlignedBox3d box, BoxOf(snapshot, id));
  std::vector<Rigid3> upright_cams;
  Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  Status inner;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    if (pose.reconstruction != id) return true;
    const Result<ImageRecord> image = snapshot.GetImage(pose.image);
    inner = image.status();
    if (!inner.ok()) return false;
    upright_cams.push_back(UprightCam(*image, pose.cam_from_world));
    forward += pose.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(inner);
  const uint32_t width = request.side_px ? request.side_px : kPictureWidthPx;
  VEDUTA_ASSIGN_OR_RETURN(const auto views, ThreeSides(box, MeanUp(upright_cams), forward, width,
                                                       width * kPictureHeightPx / kPictureWidthPx));
  return views[MeaningOf(request.side, kSides)];
}

Status RenderFromSide(const Snapshot& snapshot, ThreadPool& pool, const RenderRequest& request) {
  ReconstructionId id = request.reconstruction;
  if (!id.valid()) {
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord largest, LargestLiving(snapshot));
    id = largest.id;
  }
  VEDUTA_ASSIGN_OR_RETURN(const ViewGeometry view, SideView(snapshot, id, request));
  RenderOptions options = RenderOptionsOf(request);
  options.back_faces = BackFaces::kCull;  // so that one looks into a courtyard from outside
  VEDUTA_ASSIGN_OR_RETURN(
      const Picture picture,
      DrawReconstruction(snapshot, id, WhatToDraw(request), view, options, pool));
  return WritePng(request.path, picture.width_px, picture.height_px, picture.rgb);
}

}  // namespace

Status RenderRequest::Check() const {
  if (path.empty()) return Status::InvalidArgument("path is empty, but must name a file to write");
  VEDUTA_RETURN_IF_ERROR(CheckWord("side", side, kSides));
  VEDUTA_RETURN_IF_ERROR(CheckWord("shading", shading, kShadings));
  if (compare && from.empty())
    return Status::InvalidArgument("compare is set, but needs `from`, the photo to compare with");
  if (!from.empty() && reconstruction.valid()) {
    return Status::InvalidArgument(
        "reconstruction is set, but must not be together with `from`: the photo tells it");
  }
  if (side_px != 0 && (side_px < kPictureSideMin || side_px > kPictureSideMax)) {
    return Status::InvalidArgument("side_px is " + std::to_string(side_px) +
                                   ", but must be 0 or in [16, 16384]");
  }
  return Status::Ok();
}

Status DensifyRequest::Check() const {
  return OptionBounds().Part("options", options.Check()).status();
}

Result<std::vector<DensifyReport>> DensifyAll(Writer& writer, ThreadPool& pool, Claimable& one_pass,
                                              const DensifyRequest& request, std::stop_token stop,
                                              const ViewTools& views,
                                              std::optional<uint64_t> cache_bytes) {
  VEDUTA_RETURN_IF_ERROR(OptionBounds().Part("DensifyRequest", request.Check()).status());
  const std::optional<Claimable::Claim> alone = one_pass.TryClaim();
  if (!alone) {
    return Status::Busy("another dense pass runs on this database: wait for its end, or stop it");
  }
  std::string why_cpp;
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Device> device,
                          OpenDevice(request, pool, &why_cpp));
  VEDUTA_RETURN_IF_ERROR(SweepMerged(writer).status());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionId> wanted,
                          WantedReconstructions(*writer.GetSnapshot(), request.reconstruction));
  DensePassTools tools{writer, pool, device.get(), request.progress, stop, views};
  if (cache_bytes) tools.cache_bytes = *cache_bytes;
  std::vector<DensifyReport> reports;
  Status failure;
  bool some_gone = false;
  for (const ReconstructionId id : wanted) {
    Result<DensifyReport> report = DensifyOne(tools, id, request);
    if (!report.ok()) {
      // What is wrong with one reconstruction keeps no other from its surface.
      if (failure.ok()) failure = report.status();
      if (EndsAll(report.status())) break;
      continue;
    }
    report->why_cpp = why_cpp;
    some_gone |= report->merged_into.valid() || report->dissolved;
    if (request.report) request.report(*report);
    reports.push_back(*std::move(report));
  }
  if (some_gone) VEDUTA_RETURN_IF_ERROR(SweepMerged(writer).status());
  VEDUTA_RETURN_IF_ERROR(failure);
  return reports;
}

Result<RenderReport> RenderToFile(std::shared_ptr<const Snapshot> snapshot, ThreadPool& pool,
                                  const RenderRequest& request) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  if (request.from.empty()) {
    VEDUTA_RETURN_IF_ERROR(RenderFromSide(*snapshot, pool, request));
    return RenderReport();
  }
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(*snapshot, request.from));
  return RenderFromPhoto(std::move(snapshot), pool, request, image.id);
}

Result<DeviceList> ListDevicesFor(const std::string& wanted) {
  DeviceList list;
  list.devices = ListDevices();
  if (WantsNoDevice(wanted)) {
    list.why_none = "'" + wanted + "' asks for no device: C++ does the work";
    return list;
  }
  const Result<DeviceInfo> chosen = ChooseDevice(wanted, list.devices);
  if (chosen.ok()) {
    list.chosen = chosen->index;
  } else if (wanted.empty() || wanted == "auto") {
    list.why_none = chosen.status().message();
  } else {
    return chosen.status();
  }
  return list;
}

}  // namespace veduta
