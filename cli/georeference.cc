// SPDX-License-Identifier: Apache-2.0
// veduta georeference DB [--gcp FILE] [--deviation M] [--forget] [--by WHO] [--json]
#include <algorithm>
#include <cmath>

#include "cli/beside_daemon.h"
#include "cli/command.h"
#include "cli/wire/earth_json.h"

namespace veduta {
namespace {

struct GeoreferenceArguments {
  std::string db;
  GeoreferenceRequest request;
  bool json = false;
};

std::string Agreeing(const FitTally& tally, const char* what) {
  if (tally.used == 0) return "";
  char text[128];
  std::snprintf(text, sizeof(text), "; %u of %u %s agree, to %.3g m", tally.agreeing, tally.used,
                what, tally.error_m);
  return text;
}

void PrintEarth(const EarthAnswer& earth) {
  if (!earth.is_known) {
    PrintLine("reconstruction %u, %u images: its place on the earth is not known",
              earth.reconstruction.value, earth.images);
    return;
  }
  PrintLine(
      "reconstruction %u, %u images: place %u, about latitude %.7f, longitude %.7f, height %.1f "
      "m%s%s",
      earth.reconstruction.value, earth.images, earth.version, earth.origin.latitude_deg,
      earth.origin.longitude_deg, earth.origin.height_m,
      Agreeing(earth.fixes, "GPS positions").c_str(),
      Agreeing(earth.ground_points, "surveyed points").c_str());
  PrintLine(
      "  standard deviation of the position %.3g m on the plan and %.3g m in height, of the "
      "heading %.3g degrees, of the tilt %.3g degrees, of the scale %.3g %%",
      earth.horizontal_stddev_m, earth.vertical_stddev_m, earth.heading_stddev_deg,
      earth.tilt_stddev_deg, 100 * earth.scale_stddev_share);
}

// Two photos with poses in one reconstruction show it from different sides.
bool IsSeen(const GroundPointAnswer& ground) {
  return ground.error_px > 0;
}

void PrintGroundPoint(const GroundPointAnswer& ground) {
  const std::string name = Printable(ground.point.name);
  const auto& [east, north, up] = ground.error_m;
  if (ground.reconstruction.valid()) {
    PrintLine(
        "point %s: in %zu photos of the city; off by %.3f m to the east, %.3f to the north, %.3f "
        "above; %.2f px",
        name.c_str(), ground.point.sightings.size(), east, north, up, ground.error_px);
    return;
  }
  PrintLine("point %s: in %zu photos of the city; %s", name.c_str(), ground.point.sightings.size(),
            IsSeen(ground)
                ? "photos see it, but the place of their reconstruction is not known"
                : "no two with poses in one reconstruction show it from different sides");
}

// PROJ says to some metres how exactly one datum is known in another; one metre is what surveyors
// of Europe live with (ETRS89). Whoever calls the points less exact than that knows.
void WarnOfDatum(const GroundCoordinates& coordinates, double deviation_m) {
  constexpr double kUsualM = 1;
  const auto& accuracy_m = coordinates.accuracy_m;
  if (accuracy_m && *accuracy_m <= std::max(kUsualM, deviation_m)) return;
  char text[64] = "how exactly, PROJ does not know";
  if (accuracy_m) std::snprintf(text, sizeof(text), "which is exact to %.3g m", *accuracy_m);
  std::fprintf(stderr,
               "veduta: warning: coordinates in %s are brought to WGS 84 by \"%s\", %s: the place "
               "may be off by as much as a whole; distances are not\n",
               Printable(coordinates.name).c_str(), Printable(coordinates.operation).c_str(), text);
}

// Where surveyed points were read and no reconstruction has a place after that: what to look at.
void TellWhyNowhere(const std::vector<GroundPointAnswer>& points) {
  constexpr long kPointsMin = 3;  // that must agree before a place is published
  const long seen = std::ranges::count_if(points, IsSeen);
  if (seen < kPointsMin) {
    std::fprintf(stderr,
                 "veduta: no reconstruction has a place on the earth: %ld surveyed points are seen "
                 "from different sides by photos with poses, and 3 are needed\n",
                 seen);
    return;
  }
  std::fprintf(stderr,
               "veduta: no reconstruction has a place on the earth, for the surveyed points do not "
               "agree with where photos see them: check that east comes before north (longitude "
               "before latitude), that the unit is that of the coordinates, that the first line "
               "names the right ones, and that the px are those of the photos upright\n");
}

// Of those that are seen, on the plan and in height.
void PrintErrors(const std::vector<GroundPointAnswer>& points) {
  double plan = 0, height = 0;
  size_t count = 0;
  for (const GroundPointAnswer& ground : points) {
    if (!ground.reconstruction.valid()) continue;
    const auto& [east, north, up] = ground.error_m;
    plan += east * east + north * north;
    height += up * up;
    ++count;
  }
  if (count == 0) return;
  const auto number = static_cast<double>(count);
  PrintLine("surveyed points, root mean square: %.3f m on the plan, %.3f m in height",
            std::sqrt(plan / number), std::sqrt(height / number));
}

// Takes surveyed points in where the request has some, through the daemon where there is one.
Result<GeoreferenceAnswer> Answer(const GeoreferenceArguments& arguments) {
  const GeoreferenceRequest& request = arguments.request;
  const bool writes = !request.ground_points_path.empty() || request.forget_ground_points;
  GeoreferenceAnswer brought;
  if (writes) {
    auto daemon = DaemonClient::Connect(arguments.db);
    if (!daemon) {
      VEDUTA_ASSIGN_OR_RETURN(const auto engine, OpenToWrite(arguments.db));
      return engine->Georeference(request);
    }
    VEDUTA_ASSIGN_OR_RETURN(brought, GeoreferenceBeside(&*daemon, request));
  }
  VEDUTA_ASSIGN_OR_RETURN(const auto engine, OpenToRead(arguments.db));
  VEDUTA_ASSIGN_OR_RETURN(GeoreferenceAnswer answer, engine->Ask().Georeference());
  answer.points_read = brought.points_read;
  answer.unknown_photos = std::move(brought.unknown_photos);
  answer.coordinates = std::move(brought.coordinates);
  return answer;
}

int Georeference(const GeoreferenceArguments& arguments) {
  const auto answer = Answer(arguments);
  if (!answer.ok()) return Fail(answer.status());
  for (const std::string& photo : answer->unknown_photos) {
    std::fprintf(
        stderr, "veduta: %s\n",
        ("the city has no photo '" + Printable(photo) + "': its lines are left out").c_str());
  }
  if (answer->coordinates) WarnOfDatum(*answer->coordinates, arguments.request.ground_deviation_m);
  const bool is_nowhere = answer->points_read > 0 &&
                          std::ranges::none_of(answer->reconstructions, &EarthAnswer::is_known);
  if (is_nowhere) TellWhyNowhere(answer->ground_points);
  // The file says what the city cannot be told: what else it says is taken in.
  const int exit_code = answer->unknown_photos.empty() && !is_nowhere ? kDone : kNotDone;
  if (arguments.json) {
    PrintJson(ToJson(*answer));
    return exit_code;
  }
  for (const EarthAnswer& earth : answer->reconstructions) PrintEarth(earth);
  for (const GroundPointAnswer& ground : answer->ground_points) PrintGroundPoint(ground);
  PrintErrors(answer->ground_points);
  return exit_code;
}

}  // namespace

void RegisterGeoreference(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<GeoreferenceArguments>();
  GeoreferenceRequest& request = arguments->request;
  CLI::App* command = app->add_subcommand(
      "georeference", "Where the city is on the earth; take surveyed points in");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("--gcp", request.ground_points_path,
                      "File of surveyed points, as ODM reads it (gcp_list.txt)");
  command
      ->add_option("--deviation", request.ground_deviation_m,
                   "Standard deviation of the surveyed points, metres")
      ->check(AboveZero())
      ->capture_default_str();
  command->add_flag("--forget", request.forget_ground_points,
                    "Forget the surveyed points that are stored, first");
  command->add_option("--by", request.actor, "Who says so, for the journal")->capture_default_str();
  command->add_flag("--json", arguments->json, "JSON");
  command->callback([=] { *exit_code = Georeference(*arguments); });
}

}  // namespace veduta
