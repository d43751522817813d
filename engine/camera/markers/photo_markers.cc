// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/photo_markers.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <sstream>
#include <string>

#include "engine/camera/orientation.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"
#include "storage/base/whole_file.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

std::span<const uint8_t> BytesOf(const std::string& text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

std::vector<PhotoNote> MakeNotes(const std::vector<std::string>& paths) {
  std::vector<PhotoNote> notes;
  std::set<std::string> seen;
  std::map<std::string, int> name_counts;
  for (const std::string& path : paths) {
    if (!seen.insert(path).second) continue;
    PhotoNote note;
    note.path = path;
    note.name = fs::path(path).filename().string();
    ++name_counts[note.name];
    notes.push_back(std::move(note));
  }
  for (PhotoNote& note : notes) {
    if (name_counts[note.name] > 1) note.name = note.path;
  }
  return notes;
}

// The two sizes of one photo: by its EXIF orientation, and as stored.
struct Sizes {
  ImageSize upright, stored;
};

// The size that most photos have, upright or as stored. Of sizes that equally many photos have, the
// larger one.
ImageSize CommonSize(const std::vector<Sizes>& sizes) {
  ImageSize best;
  size_t best_count = 0;
  for (const bool is_upright : {true, false}) {
    for (const Sizes& candidate : sizes) {
      const ImageSize size = is_upright ? candidate.upright : candidate.stored;
      if (size.empty()) continue;
      const size_t count =
          static_cast<size_t>(std::count_if(sizes.begin(), sizes.end(), [&](const Sizes& s) {
            return s.upright == size || s.stored == size;
          }));
      const bool is_larger = size.pixel_count() > best.pixel_count();
      if (count > best_count || (count == best_count && is_larger)) {
        best = size;
        best_count = count;
      }
    }
  }
  return best;
}

std::string TooFewText(size_t count, const PhotoMarkersOptions& options) {
  std::ostringstream text;
  text
      << (count == 0   ? "no marker"
          : count == 1 ? "only 1 marker"
                       : "only " + std::to_string(count) + " markers")
      << " found, " << options.marker_count_min
      << " are needed: photograph more of the sheets, in focus, with markers at least 25 px across";
  return text.str();
}

// Markers are lost where edges are wider than this share of the marker's diameter. On rendered
// photos of markers 55 and 80 px across all are found at 0.027, 88 to 97 % at 0.037, 60 % at 0.045
// and 25 % at 0.055 (veduta-bench-markers).
constexpr double kBlurShareMax = 1.0 / 30;

std::string AdviceFor(const PhotoNote& note) {
  std::ostringstream text;
  if (note.blur_share > kBlurShareMax) {
    text << "it is out of focus or moved (edges have a sigma of " << std::fixed
         << std::setprecision(1) << note.blur_px << " px): focus on the sheets, hold still";
  }
  for (size_t i = 0; i < note.ambiguous.size(); ++i) {
    text << (i > 0              ? ", "
             : text.tellp() > 0 ? "; markers seen twice: "
                                : "markers seen twice: ")
         << note.ambiguous[i];
  }
  if (!note.ambiguous.empty()) text << "; lay out one copy of each sheet";
  return text.str();
}

// Reads one photo of the common size: fills its view, or says in its note why there is none.
void DetectInPhoto(ImageSize size, const PhotoMarkersOptions& options, PhotoNote* note,
                   ViewObservations* view) {
  const Result<std::string> bytes = ReadWholeFile(note->path, options.decode.size_bytes_max);
  if (!bytes.ok()) {
    note->detail = bytes.status().message();
    return;
  }
  const DecodedPhoto photo = DecodePhoto(BytesOf(*bytes), options.decode, {size});
  if (photo.outcome != DecodeOutcome::kDecoded) {
    note->use =
        photo.outcome == DecodeOutcome::kWrongSize ? PhotoUse::kOtherSize : PhotoUse::kUnreadable;
    note->detail = photo.outcome == DecodeOutcome::kWrongSize
                       ? "it has " + photo.upright_size.Text() + " px, most photos " + size.Text() +
                             ": another camera, or it was cropped or made smaller"
                       : photo.detail;
    return;
  }
  const Result<MarkerSearch> search = DetectMarkers(photo.gray, options.markers);
  // Cannot fail: the options have been checked, and the photo is grey.
  VEDUTA_CHECK(search.ok(), search.status().message());
  note->ambiguous = search->ambiguous;
  note->marker_count = static_cast<uint32_t>(search->markers.size());
  std::vector<double> blurs_px, blur_shares;
  for (const MarkerDetection& marker : search->markers) {
    blurs_px.push_back(marker.blur_px);
    blur_shares.push_back(marker.blur_px /
                          (2 * std::sqrt(marker.outline.major * marker.outline.minor)));
  }
  note->blur_px = MedianOf(std::move(blurs_px));
  note->blur_share = MedianOf(std::move(blur_shares));
  const std::string advice = AdviceFor(*note);
  if (note->marker_count < options.marker_count_min) {
    note->use = PhotoUse::kTooFewMarkers;
    note->detail = TooFewText(note->marker_count, options) + (advice.empty() ? "" : "; " + advice);
    return;
  }
  note->use = PhotoUse::kUsed;
  note->advice = advice;
  view->name = note->name;
  view->size = size;
  for (const MarkerDetection& marker : search->markers) {
    view->points.push_back({marker.id, marker.center_px, marker.SigmaPx()});
  }
}

}  // namespace

Status PhotoMarkersOptions::Check() const {
  return OptionBounds()
      .Part("markers", markers.Check())
      .Part("decode", decode.Check())
      .AtLeast("marker_count_min", marker_count_min, 1)
      .status();
}

Result<PhotoMarkers> DetectInPhotos(const std::vector<std::string>& paths,
                                    const PhotoMarkersOptions& options, ThreadPool* pool,
                                    const std::function<void(size_t)>& progress) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  if (paths.empty()) return Status::InvalidArgument("no photos are given");
  PhotoMarkers result;
  result.notes = MakeNotes(paths);
  const size_t count = result.notes.size();
  // The common size decides which way round a photo is decoded, so it comes first, from the
  // headers.
  std::vector<Sizes> sizes(count);
  pool->ParallelFor(count, [&](size_t i) {
    const auto bytes = ReadWholeFile(result.notes[i].path, options.decode.size_bytes_max);
    if (!bytes.ok()) return;
    const PhotoHeader header = ReadPhotoHeader(BytesOf(*bytes));
    if (header.outcome != HeaderOutcome::kRead) return;
    sizes[i] = {UprightSize(header.stored_size, header.orientation), header.stored_size};
  });
  result.size = CommonSize(sizes);
  std::vector<ViewObservations> views(count);
  std::mutex mutex;
  size_t done = 0;
  pool->ParallelFor(count, [&](size_t i) {
    DetectInPhoto(result.size, options, &result.notes[i], &views[i]);
    const std::lock_guard lock(mutex);
    ++done;
    if (progress) progress(done);
  });
  for (size_t i = 0; i < count; ++i) {
    if (result.notes[i].use == PhotoUse::kUsed) result.input.views.push_back(std::move(views[i]));
  }
  return result;
}

}  // namespace veduta
