// SPDX-License-Identifier: Apache-2.0
#include "engine/journal/camera_entry.h"

#include <charconv>
#include <string_view>

#include "engine/camera/camera_text.h"
#include "engine/journal/journal.h"

namespace veduta {
namespace {

constexpr std::string_view kBeforeId = " (camera ", kAfterId = "): ", kFrom = " from ",
                           kRefinable = " refinable";

}  // namespace

std::string CameraEntry(const CameraRecord& camera) {
  const CameraModel& model = camera.model;
  return camera.name + std::string(kBeforeId) + std::to_string(camera.id.value) +
         std::string(kAfterId) + std::to_string(model.width_px) + "x" +
         std::to_string(model.height_px) + " " + CameraParamsText(model) +
         (camera.refined_from ? std::string(kFrom) + CameraParamsText(*camera.refined_from) : "") +
         std::string(camera.is_refinable ? kRefinable : "");
}

void PutNewCamera(const CameraRecord& camera, DatabaseState* state, Transaction* transaction) {
  transaction->PutCamera(camera);
  JournalRecord entry;
  entry.actor = "veduta";
  entry.action = "camera";
  entry.detail = CameraEntry(camera);
  AppendJournal(std::move(entry), state, transaction);
}

std::optional<CameraRecord> ParseCameraEntry(const std::string& entry) {
  const bool is_refinable = entry.ends_with(kRefinable);
  std::string detail = entry.substr(0, entry.size() - (is_refinable ? kRefinable.size() : 0));
  // No parameters have spaces; a name may.
  const size_t from = detail.rfind(kFrom);
  std::string refined_from;
  if (from != std::string::npos && from > detail.rfind(kAfterId)) {
    refined_from = detail.substr(from + kFrom.size());
    detail.resize(from);
  }
  const size_t before = detail.rfind(kBeforeId), after = detail.rfind(kAfterId);
  const size_t params = detail.rfind(' ');
  if (before == std::string::npos || after == std::string::npos || before == 0 || after < before ||
      params < after + kAfterId.size()) {
    return std::nullopt;
  }
  CameraRecord camera;
  camera.name = detail.substr(0, before);
  const char* const id_end = detail.data() + after;
  const auto [end, error] =
      std::from_chars(detail.data() + before + kBeforeId.size(), id_end, camera.id.value);
  if (error != std::errc() || end != id_end || !camera.id.valid()) return std::nullopt;
  const size_t size = after + kAfterId.size();
  const Result<ImageSize> parsed = ParseSize(detail.substr(size, params - size));
  if (!parsed.ok()) return std::nullopt;
  const Result<CameraModel> model = ParseCameraParams(detail.substr(params + 1), *parsed);
  if (!model.ok()) return std::nullopt;
  camera.model = *model;
  if (!refined_from.empty()) {
    const Result<CameraModel> extraction = ParseCameraParams(refined_from, *parsed);
    if (!extraction.ok()) return std::nullopt;
    camera.refined_from = *extraction;
  }
  camera.is_refinable = is_refinable;
  return camera;
}

}  // namespace veduta
