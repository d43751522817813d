// SPDX-License-Identifier: Apache-2.0
#include "engine/earth/ground_file.h"

#include <proj.h>

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

// The fields of a line: between tabulators where there are some, or else between spaces. What
// comes after the sixth is one field.
std::vector<std::string_view> FieldsOf(std::string_view line) {
  const std::string_view between = line.find('\t') != std::string_view::npos ? "\t" : " ";
  std::vector<std::string_view> fields;
  while (!line.empty() && fields.size() < 6) {
    const size_t end = std::min(line.find_first_of(between), line.size());
    fields.push_back(Trimmed(line.substr(0, end)));
    line = Trimmed(line.substr(end));
  }
  if (!line.empty()) fields.push_back(line);
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

// From the coordinates that `definition` names to WGS 84; null where PROJ knows none. Without
// `allow_guesses` also where a grid is missing, so that heights would stay what they are.
Projection TransformOf(PJ_CONTEXT* context, const std::string& definition, bool allow_guesses) {
  const Projection from(proj_create(context, definition.c_str()), &proj_destroy);
  const Projection to(proj_create(context, "EPSG:4979"), &proj_destroy);
  if (from == nullptr || to == nullptr) return {nullptr, &proj_destroy};
  const char* const strictly[] = {"ALLOW_BALLPARK=NO", nullptr};
  const Projection as_given(proj_create_crs_to_crs_from_pj(context, from.get(), to.get(), nullptr,
                                                           allow_guesses ? nullptr : strictly),
                            &proj_destroy);
  if (as_given == nullptr) return {nullptr, &proj_destroy};
  return {proj_normalize_for_visualization(context, as_given.get()), &proj_destroy};
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
    made->transform_ = TransformOf(context, definition, false);
    if (made->transform_ != nullptr) return made;
    if (TransformOf(context, definition, true) != nullptr) {
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
    const PJ_COORD to = proj_trans(transform_.get(), PJ_FWD, proj_coord(east, north, height, 0));
    const GeoPosition position{to.lpz.phi, to.lpz.lam, to.lpz.z};
    const bool is_on_earth = proj_errno(transform_.get()) == 0 && std::abs(to.lpz.phi) <= 90 &&
                             std::abs(to.lpz.lam) <= 180 && std::isfinite(to.lpz.z);
    return is_on_earth ? std::optional(position) : std::nullopt;
  }

 private:
  ToWgs84()
      : context_(proj_context_create(), &proj_context_destroy),
        transform_(nullptr, &proj_destroy) {}
  std::unique_ptr<PJ_CONTEXT, decltype(&proj_context_destroy)> context_;
  Projection transform_;
};

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

Result<std::vector<GroundLine>> ParseGroundPoints(std::string_view text) {
  std::vector<GroundLine> lines;
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
      continue;
    }
    if (lines.size() == kLinesMax)
      return Wrong(number, "is one of more than " + std::to_string(kLinesMax));
    VEDUTA_ASSIGN_OR_RETURN(GroundLine parsed, ParseLine(line, number, *to_wgs84));
    const auto [known, is_new] = points.try_emplace(parsed.point, parsed.position);
    if (!is_new && !(known->second == parsed.position))
      return Wrong(number, "point '" + parsed.point + "' was elsewhere in an earlier line");
    lines.push_back(std::move(parsed));
  }
  if (to_wgs84 == nullptr)
    return Status::InvalidArgument("the file is empty; its first line names the coordinates");
  return lines;
}

}  // namespace veduta
