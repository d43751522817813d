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

// "WGS84 UTM 33N" in the words of PROJ; other texts as they are.
std::string DefinitionOf(std::string_view text) {
  constexpr std::string_view kUtm = "WGS84 UTM ";
  if (!text.starts_with(kUtm) || text.size() < kUtm.size() + 2) return std::string(text);
  const char side = text.back();
  const std::string zone(text.substr(kUtm.size(), text.size() - kUtm.size() - 1));
  return "+proj=utm +zone=" + zone + (side == 'S' ? " +south" : "") +
         " +datum=WGS84 +units=m +no_defs";
}

// From the coordinates of the file to latitude, longitude and height.
class ToWgs84 final {
 public:
  static Result<std::unique_ptr<ToWgs84>> Make(std::string_view named) {
    std::unique_ptr<ToWgs84> made(new ToWgs84);
    const std::string definition = DefinitionOf(named);
    proj_log_level(made->context_.get(), PJ_LOG_NONE);
    proj_context_set_enable_network(made->context_.get(), 0);
    std::unique_ptr<PJ, decltype(&proj_destroy)> as_given(
        proj_create_crs_to_crs(made->context_.get(), definition.c_str(), "EPSG:4979", nullptr),
        &proj_destroy);
    if (as_given != nullptr) {
      made->transform_.reset(
          proj_normalize_for_visualization(made->context_.get(), as_given.get()));
    }
    if (made->transform_ == nullptr) {
      return Wrong(1, "'" + std::string(named) +
                          "' names no coordinates; write their code (EPSG:25833), or a "
                          "definition of PROJ (+proj=utm +zone=33 +datum=WGS84)");
    }
    return made;
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
  std::unique_ptr<PJ, decltype(&proj_destroy)> transform_;
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
