// SPDX-License-Identifier: Apache-2.0
#include "engine/earth/ground_file.h"

#include <proj.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "storage/base/whole_file.h"

namespace veduta {
namespace {

constexpr size_t kLinesMax = 1'000'000;

Status Wrong(int number, const std::string& what) {
  return Status::InvalidArgument("line " + std::to_string(number) + ": " + what);
}

std::string_view Trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  const size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

constexpr size_t kFieldsMax = 7;  // what follows are ODM's extras

// The fields of a line: between tabulators where there are some, or else between spaces.
std::vector<std::string_view> FieldsOf(std::string_view line) {
  const std::string_view between = line.find('\t') != std::string_view::npos ? "\t" : " ";
  std::vector<std::string_view> fields;
  while (!line.empty() && fields.size() < kFieldsMax) {
    const size_t end = std::min(line.find_first_of(between), line.size());
    fields.push_back(Trimmed(line.substr(0, end)));
    line = Trimmed(line.substr(end));
  }
  return fields;
}

std::optional<double> NumberOf(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(number))
    return std::nullopt;
  return number;
}

// "WGS84 UTM 33N" in the words of PROJ; other texts as they are. Empty where the zone or its side
// are missing.
std::string DefinitionOf(std::string_view text) {
  constexpr std::string_view kUtm = "WGS84 UTM ";
  if (text.starts_with("+proj=")) return std::string(text) + " +type=crs";
  if (!text.starts_with(kUtm)) return std::string(text);
  text.remove_prefix(kUtm.size());
  int zone = 0;
  const auto [side, error] = std::from_chars(text.data(), text.data() + text.size(), zone);
  const std::string_view named(side, text.data() + text.size());
  const bool is_south = named == "S" || named == "s";
  if (error != std::errc() || zone < 1 || zone > 60 || !(is_south || named == "N" || named == "n"))
    return "";
  return "+proj=utm +zone=" + std::to_string(zone) + (is_south ? " +south" : "") +
         " +datum=WGS84 +units=m +no_defs +type=crs";
}

using Projection = std::unique_ptr<PJ, decltype(&proj_destroy)>;

// From coordinates to WGS 84; null where PROJ knows no way. Without `allow_guesses` also where it
// would have to take a datum for WGS 84 or a height above a geoid for one above the ellipsoid.
Projection TransformOf(PJ_CONTEXT* context, const PJ* from, bool allow_guesses) {
  const Projection to(proj_create(context, "EPSG:4979"), &proj_destroy);
  if (from == nullptr || to == nullptr) return {nullptr, &proj_destroy};
  const char* const strictly[] = {"ALLOW_BALLPARK=NO", nullptr};
  const Projection as_given(proj_create_crs_to_crs_from_pj(context, from, to.get(), nullptr,
                                                           allow_guesses ? nullptr : strictly),
                            &proj_destroy);
  if (as_given == nullptr) return {nullptr, &proj_destroy};
  return {proj_normalize_for_visualization(context, as_given.get()), &proj_destroy};
}

// The coordinates on the plan alone, without a height and without a way to WGS 84 of their own.
Projection PlanOf(PJ_CONTEXT* context, Projection crs) {
  while (crs != nullptr) {
    const PJ_TYPE type = proj_get_type(crs.get());
    if (type == PJ_TYPE_BOUND_CRS) {
      crs.reset(proj_get_source_crs(context, crs.get()));
    } else if (type == PJ_TYPE_COMPOUND_CRS) {
      crs.reset(proj_crs_get_sub_crs(context, crs.get(), 0));
    } else {
      break;
    }
  }
  return crs;
}

// Whether all that is known of the datum is an ellipsoid. PROJ calls such a datum so.
bool LacksDatum(PJ_CONTEXT* context, const PJ* plan) {
  const Projection datum(proj_crs_get_datum(context, plan), &proj_destroy);
  if (datum == nullptr) return false;
  const char* const name = proj_get_name(datum.get());
  return name != nullptr && std::string_view(name).starts_with("Unknown based on ");
}

// Of heights: PROJ converts east and north alone where the coordinates have no third axis, while
// who surveys in feet writes all three in feet.
double HeightUnitM(PJ_CONTEXT* context, const PJ* crs) {
  const Projection plan = PlanOf(context, {proj_clone(context, crs), &proj_destroy});
  if (plan == nullptr || proj_get_type(plan.get()) != PJ_TYPE_PROJECTED_CRS) return 1;
  const Projection axes(proj_crs_get_coordinate_system(context, plan.get()), &proj_destroy);
  double unit_m = 1;
  const bool has_plan_alone =
      axes != nullptr && proj_cs_get_axis_count(context, axes.get()) == 2 &&
      proj_cs_get_axis_info(context, axes.get(), 0, nullptr, nullptr, nullptr, &unit_m, nullptr,
                            nullptr, nullptr) != 0;
  return has_plan_alone ? unit_m : 1;
}

// Those steps of an operation that go from one datum to another. PROJ's name of the whole has also
// how the plan is unrolled and which axis comes first.
std::string StepsBetweenDatums(std::string_view operation) {
  constexpr std::string_view kPlus = " + ";
  std::string steps;
  for (std::string_view rest = operation; !rest.empty();) {
    const size_t end = std::min(rest.find(kPlus), rest.size());
    const std::string_view step = rest.substr(0, end);
    rest.remove_prefix(std::min(end + kPlus.size(), rest.size()));
    if (step.find(" to ") == std::string_view::npos || step.starts_with("Null ")) continue;
    steps += (steps.empty() ? "" : std::string(kPlus)) + std::string(step);
  }
  return steps.empty() ? std::string(operation) : steps;
}

// From the coordinates of the file to latitude, longitude and height.
class ToWgs84 final {
 public:
  static Result<std::unique_ptr<ToWgs84>> Make(std::string_view named) {
    std::unique_ptr<ToWgs84> made(new ToWgs84);
    const std::string definition = DefinitionOf(named);
    proj_log_level(made->context_.get(), PJ_LOG_NONE);
    proj_context_set_enable_network(made->context_.get(), 0);
    PJ_CONTEXT* const context = made->context_.get();
    Projection crs(proj_create(context, definition.c_str()), &proj_destroy);
    made->named_ = named;
    made->transform_ = TransformOf(context, crs.get(), false);
    if (made->transform_ != nullptr) {
      made->height_unit_m_ = HeightUnitM(context, crs.get());
      return made;
    }
    if (TransformOf(context, crs.get(), true) != nullptr) {
      const Projection plan = PlanOf(context, std::move(crs));
      if (plan != nullptr && LacksDatum(context, plan.get())) {
        return Wrong(1, "'" + std::string(named) +
                            "' has no datum, so that nobody knows where on the earth it is; add "
                            "one (+datum=WGS84) or its way to WGS 84 (+towgs84=...), or write the "
                            "code of the coordinates (EPSG:25833)");
      }
      return Wrong(1,
                   "'" + std::string(named) +
                       "' needs a grid, as of a geoid, that PROJ does not have here (projsync of "
                       "proj-bin fetches it); or write heights above the ellipsoid, and the code "
                       "of the plan alone");
    }
    return Wrong(1, "'" + std::string(named) +
                        "' names no coordinates; write their code (EPSG:25833), their zone (WGS84 "
                        "UTM 33N), or a definition of PROJ (+proj=utm +zone=33 +datum=WGS84)");
  }

  std::optional<GeoPosition> Transform(double east, double north, double height) const {
    proj_errno_reset(transform_.get());
    const PJ_COORD to =
        proj_trans(transform_.get(), PJ_FWD, proj_coord(east, north, height * height_unit_m_, 0));
    const GeoPosition position{to.lpz.phi, to.lpz.lam, to.lpz.z};
    const bool is_on_earth = proj_errno(transform_.get()) == 0 && std::abs(to.lpz.phi) <= 90 &&
                             std::abs(to.lpz.lam) <= 180 && std::isfinite(to.lpz.z);
    return is_on_earth ? std::optional(position) : std::nullopt;
  }

  // What brought the last position here.
  GroundCoordinates LastOperation() const {
    const PJ_PROJ_INFO info = proj_pj_info(transform_.get());
    GroundCoordinates last;
    last.name = named_;
    last.operation = StepsBetweenDatums(info.description != nullptr ? info.description : "");
    if (info.accuracy >= 0) last.accuracy_m = info.accuracy;
    return last;
  }

 private:
  ToWgs84()
      : context_(proj_context_create(), &proj_context_destroy),
        transform_(nullptr, &proj_destroy) {}
  std::unique_ptr<PJ_CONTEXT, decltype(&proj_context_destroy)> context_;
  Projection transform_;
  std::string named_;
  double height_unit_m_ = 1;
};

bool IsLessExact(const GroundCoordinates& a, const GroundCoordinates& b) {
  return b.accuracy_m && (!a.accuracy_m || *a.accuracy_m > *b.accuracy_m);
}

bool IsNan(std::string_view text) {
  return text.size() == 3 && std::ranges::equal(text, std::string_view("nan"), {}, [](char c) {
           return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
         });
}

Result<GroundLine> ParseLine(std::string_view text, int number, const ToWgs84& to_wgs84) {
  const std::vector<std::string_view> fields = FieldsOf(text);
  if (fields.size() < 6) {
    return Wrong(number, "has " + std::to_string(fields.size()) +
                             " fields; wanted are east, north, height, x, y, photo and, if the "
                             "point has one, its name");
  }
  double numbers[5];
  for (int i = 0; i < 5; ++i) {
    const std::optional<double> parsed = NumberOf(fields[i]);
    if (!parsed && i == 2 && IsNan(fields[i])) {
      return Wrong(number, "the point has no height ('" + std::string(fields[i]) +
                               "'): a point without one is not used here; write its height, or "
                               "leave its lines out");
    }
    if (!parsed) return Wrong(number, "'" + std::string(fields[i]) + "' is no number");
    numbers[i] = *parsed;
  }
  GroundLine line;
  const auto position = to_wgs84.Transform(numbers[0], numbers[1], numbers[2]);
  if (!position) return Wrong(number, "its coordinates lie nowhere on the earth");
  line.position = *position;
  line.x_px = numbers[3];
  line.y_px = numbers[4];
  line.photo = fields[5];
  line.point = fields.size() > 6 ? std::string(fields[6])
                                 : std::string(fields[0]) + " " + std::string(fields[1]) + " " +
                                       std::string(fields[2]);
  line.number = number;
  return line;
}

}  // namespace

Result<GroundFile> ParseGroundPoints(std::string_view text) {
  GroundFile file;
  std::unique_ptr<ToWgs84> to_wgs84;
  std::map<std::string, GeoPosition> points;
  text = WithoutByteOrderMark(text);
  for (int number = 1; !text.empty(); ++number) {
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = Trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.starts_with('#')) continue;
    if (to_wgs84 == nullptr) {
      VEDUTA_ASSIGN_OR_RETURN(to_wgs84, ToWgs84::Make(line));
      file.coordinates = to_wgs84->LastOperation();
      continue;
    }
    if (file.lines.size() == kLinesMax)
      return Wrong(number, "is one of more than " + std::to_string(kLinesMax));
    VEDUTA_ASSIGN_OR_RETURN(GroundLine parsed, ParseLine(line, number, *to_wgs84));
    GroundCoordinates used = to_wgs84->LastOperation();
    if (file.lines.empty() || IsLessExact(used, file.coordinates))
      file.coordinates = std::move(used);
    const auto [known, is_new] = points.try_emplace(parsed.point, parsed.position);
    if (!is_new && !(known->second == parsed.position))
      return Wrong(number, "point '" + parsed.point + "' was elsewhere in an earlier line");
    file.lines.push_back(std::move(parsed));
  }
  if (to_wgs84 == nullptr)
    return Status::InvalidArgument("the file is empty; its first line names the coordinates");
  return file;
}

}  // namespace veduta
