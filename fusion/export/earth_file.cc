// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/earth_file.h"

#include <nlohmann/json.hpp>

#include "fusion/export/output_file.h"

namespace veduta {

bool IsOnEarth(const ReconstructionRecord& record, const ExportRequest& request) {
  return request.on_earth && record.georeference.place.has_value();
}

Sim3 ModelFromWorld(const ReconstructionRecord& record, const ExportRequest& request) {
  return IsOnEarth(record, request) ? record.georeference.place->enu_from_world : Sim3();
}

Status WriteEarthFile(const ReconstructionRecord& record, const ExportRequest& request,
                      const std::string& path) {
  if (!record.georeference.place) return Status::Ok();
  const EarthPlace& place = *record.georeference.place;
  const Sim3 s = IsOnEarth(record, request) ? Sim3() : place.enu_from_world;
  const Eigen::Quaterniond& q = s.rotation;
  const nlohmann::ordered_json json = {
      {"origin",
       {{"latitude", place.origin.latitude_deg},
        {"longitude", place.origin.longitude_deg},
        {"height", place.origin.height_m}}},
      {"scale", s.scale},
      {"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
      {"translation", {s.translation.x(), s.translation.y(), s.translation.z()}},
      {"version", record.georeference.version}};
  OutputFile file(path);
  file.stream() << json.dump(2) << '\n';
  return file.Close();
}

}  // namespace veduta
