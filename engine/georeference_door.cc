// SPDX-License-Identifier: Apache-2.0
// Engine::Georeference.
#include <algorithm>
#include <map>
#include <set>

#include "engine/earth/ground_file.h"
#include "engine/engine.h"
#include "engine/ingest/georeferencing.h"
#include "engine/parts.h"
#include "engine/query/earth_answers.h"
#include "engine/query/find_image.h"
#include "storage/base/option_bounds.h"
#include "storage/base/whole_file.h"

namespace veduta {
namespace {

constexpr size_t kFileBytesMax = 64 << 20;  // a line has some 100 bytes

Status AtLine(const Status& status, const std::string& path, int number) {
  return Status(status.code(), path + ": line " + std::to_string(number) + ": " + status.message());
}

// What messages call the file.
std::string FileOf(const GeoreferenceRequest& request) {
  return request.ground_points_path.empty() ? "the surveyed points" : request.ground_points_path;
}

// Nothing where no file is given.
Result<std::optional<GroundFile>> ReadFileOf(const GeoreferenceRequest& request) {
  std::string text;
  if (request.ground_points) {
    text = *request.ground_points;
  } else if (!request.ground_points_path.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(text, ReadWholeFile(request.ground_points_path, kFileBytesMax));
  } else {
    return std::optional<GroundFile>();
  }
  Result<GroundFile> file = ParseGroundPoints(text);
  if (file.ok()) return std::optional(std::move(*file));
  return Status(file.status().code(), FileOf(request) + ": " + file.status().message());
}

// Whether the place is in the photo, whichever way round it stands: the image may be as stored.
bool IsInside(const GroundLine& line, const ImageRecord& image) {
  const auto is_below = [](double px, uint32_t side_px) {
    return px >= -0.5 && px <= side_px - 0.5;
  };
  return (is_below(line.x_px, image.width_px) && is_below(line.y_px, image.height_px)) ||
         (is_below(line.x_px, image.height_px) && is_below(line.y_px, image.width_px));
}

// Those of the file that photos of the city show, by their names. What it names besides goes to
// `unknown_photos`.
Result<std::map<std::string, GroundPoint>> PointsOf(const GeoreferenceRequest& request,
                                                    const std::vector<GroundLine>& lines,
                                                    const Snapshot& snapshot,
                                                    std::vector<std::string>* unknown_photos) {
  std::map<std::string, GroundPoint> points;
  std::set<std::string> unknown;
  for (const GroundLine& line : lines) {
    const Result<ImageRecord> image = FindImage(snapshot, line.photo);
    if (image.status().code() == StatusCode::kNotFound) {
      unknown.insert(line.photo);
      continue;
    }
    if (!image.ok()) return AtLine(image.status(), FileOf(request), line.number);
    if (image->verdict != Verdict::kRejected && !IsInside(line, *image)) {
      return AtLine(
          Status::InvalidArgument("the place lies outside of photo '" + image->name + "'"),
          FileOf(request), line.number);
    }
    GroundPoint& point = points[line.point];
    point.name = line.point;
    point.position = line.position;
    point.deviation_m = request.ground_deviation_m;
    point.sightings.push_back({image->id, line.x_px, line.y_px});
  }
  unknown_photos->assign(unknown.begin(), unknown.end());
  for (auto& [name, point] : points) {
    std::ranges::sort(point.sightings, {}, &GroundSighting::image);
    const auto twice = std::ranges::adjacent_find(point.sightings, {}, &GroundSighting::image);
    if (twice == point.sightings.end()) continue;
    return Status::InvalidArgument(FileOf(request) + ": point '" + name +
                                   "' is at two places of image " +
                                   std::to_string(twice->image.value));
  }
  if (!points.empty() || lines.empty()) return points;
  return Status::NotFound(FileOf(request) +
                          ": the city has none of the photos that it names, as '" +
                          unknown_photos->front() + "'");
}

}  // namespace

Status GeoreferenceRequest::Check() const {
  return OptionBounds().FiniteAbove("ground_deviation_m", ground_deviation_m, 0).status();
}

Result<GeoreferenceAnswer> Engine::Georeference(const GeoreferenceRequest& request) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<GroundFile> file, ReadFileOf(request));
  const std::vector<GroundLine> lines = file ? file->lines : std::vector<GroundLine>();
  std::vector<std::string> unknown_photos;
  size_t read = 0;
  {
    Writer::Turn turn = parts_->writer->Take();
    WriteScope scope = BeginWrite(&turn.database());
    VEDUTA_ASSIGN_OR_RETURN(auto points, PointsOf(request, lines, *scope.base, &unknown_photos));
    read = points.size();
    if (!request.forget_ground_points) {
      VEDUTA_ASSIGN_OR_RETURN(std::vector<GroundPoint> stored, scope.base->ListGroundPoints());
      for (GroundPoint& point : stored) points.try_emplace(point.name, std::move(point));
    }
    std::vector<GroundPoint> all;
    for (auto& [name, point] : points) all.push_back(std::move(point));
    VEDUTA_RETURN_IF_ERROR(SetGroundPoints(all, request.actor, std::move(scope)));
  }
  VEDUTA_ASSIGN_OR_RETURN(GeoreferenceAnswer answer,
                          GeoreferenceOf(*parts_->database->GetSnapshot()));
  answer.points_read = static_cast<uint32_t>(read);
  answer.unknown_photos = std::move(unknown_photos);
  if (file) answer.coordinates = file->coordinates;
  return answer;
}

}  // namespace veduta
