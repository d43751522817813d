// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/files/calibration_figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "engine/camera/calibration/calibration_advice.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

constexpr double kWidth = 640;  // of a figure, CSS px
constexpr const char* kInk = "#1f2933";
constexpr const char* kBlue = "#2166ac";
constexpr const char* kRed = "#c0392b";
constexpr const char* kGray = "#9aa5b1";

std::string Attribute(const char* name, const std::string& value) {
  return std::string(" ") + name + "=\"" + value + "\"";
}

std::string Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const char* color,
                 double width) {
  return "<line" + Attribute("x1", Fixed(a.x(), 1)) + Attribute("y1", Fixed(a.y(), 1)) +
         Attribute("x2", Fixed(b.x(), 1)) + Attribute("y2", Fixed(b.y(), 1)) +
         Attribute("stroke", color) + Attribute("stroke-width", Fixed(width, 1)) + "/>";
}

std::string Circle(const Eigen::Vector2d& at, double radius, const char* fill, const char* stroke) {
  return "<circle" + Attribute("cx", Fixed(at.x(), 1)) + Attribute("cy", Fixed(at.y(), 1)) +
         Attribute("r", Fixed(radius, 1)) + Attribute("fill", fill) + Attribute("stroke", stroke) +
         "/>";
}

std::string Rectangle(double x, double y, double width, double height, const char* fill,
                      const char* stroke) {
  return "<rect" + Attribute("x", Fixed(x, 1)) + Attribute("y", Fixed(y, 1)) +
         Attribute("width", Fixed(width, 1)) + Attribute("height", Fixed(height, 1)) +
         Attribute("fill", fill) + Attribute("stroke", stroke) + "/>";
}

std::string Words(double x, double y, const std::string& text, const char* anchor) {
  return "<text" + Attribute("x", Fixed(x, 1)) + Attribute("y", Fixed(y, 1)) +
         Attribute("text-anchor", anchor) + Attribute("font-size", "12") + Attribute("fill", kInk) +
         ">" + Escaped(text) + "</text>";
}

std::string Svg(double width, double height, const std::string& content) {
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" font-family=\"sans-serif\"" +
         Attribute("width", Fixed(width, 0)) + Attribute("height", Fixed(height, 0)) +
         Attribute("viewBox", "0 0 " + Fixed(width, 0) + " " + Fixed(height, 0)) + ">" + content +
         "</svg>\n";
}

// A figure with the photo's shape. At() maps the photo's px to the figure's.
struct PhotoFrame {
  explicit PhotoFrame(const CameraModel& model)
      : scale(kWidth / model.width_px), height(std::max(scale * model.height_px, 1.0)) {}

  Eigen::Vector2d At(const Eigen::Vector2d& px) const {
    return scale * (px + Eigen::Vector2d(0.5, 0.5));
  }
  std::string Draw(const std::string& content) const {
    return Svg(kWidth, height,
               Rectangle(0.5, 0.5, kWidth - 1, height - 1, "#ffffff", kGray) + content);
  }

  double scale, height;
};

// 1, 2 or 5 times a power of ten, near `value`.
double RoundNumber(double value) {
  const double power = std::pow(10, std::floor(std::log10(std::max(value, 1e-9))));
  const double lead = value / power;
  return power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
}

}  // namespace

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return escaped;
}

std::string Fixed(double value, int digits) {
  std::array<char, 400> text;
  std::snprintf(text.data(), text.size(), "%.*f", digits, std::isfinite(value) ? value : 0);
  return text.data();
}

std::string CoverageFigure(const Calibration& c) {
  const PhotoFrame frame(c.model);
  std::string cells, dots;
  const std::vector<bool> covered = CoveredCells(c);
  for (int i = 0; i < kCoverageAcross * kCoverageDown; ++i) {
    if (covered[static_cast<size_t>(i)]) continue;
    const double width = kWidth / kCoverageAcross, height = frame.height / kCoverageDown;
    cells += Rectangle(width * (i % kCoverageAcross), height * (i / kCoverageAcross), width, height,
                       "#fde8e4", "none");
  }
  for (const CalibrationResidual& r : c.residuals) {
    const Eigen::Vector2d at = frame.At(r.px);
    if (r.is_used) {
      dots += Circle(at, 2, kBlue, "none");
    } else {
      dots += Line(at + Eigen::Vector2d(-3, -3), at + Eigen::Vector2d(3, 3), kRed, 1.5) +
              Line(at + Eigen::Vector2d(-3, 3), at + Eigen::Vector2d(3, -3), kRed, 1.5);
    }
  }
  return frame.Draw(cells + dots);
}

std::string ResidualFigure(const Calibration& c, double* magnification) {
  const PhotoFrame frame(c.model);
  // The usual residual becomes 1.5 % of the figure's width. Chosen by hand.
  *magnification = RoundNumber(0.015 * kWidth / frame.scale / std::max(c.error_px_rms, 1e-6));
  std::string arrows;
  for (const CalibrationResidual& r : c.residuals) {
    if (!r.is_used) continue;
    const Eigen::Vector2d at = frame.At(r.px);
    arrows += Line(at, at + frame.scale * *magnification * r.residual_px, kBlue, 1) +
              Circle(at, 1.2, kInk, "none");
  }
  return frame.Draw(arrows);
}

std::string DistortionFigure(const Calibration& c, double* magnification) {
  const PhotoFrame frame(c.model);
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> moves;  // photo, undistorted
  double largest = 0;
  for (int row = 0; row <= 12; ++row) {
    for (int column = 0; column <= 16; ++column) {
      const Eigen::Vector2d px(column * (c.model.width_px - 1.0) / 16,
                               row * (c.model.height_px - 1.0) / 12);
      const auto undistorted = UndistortPixel(c.model, px);
      if (!undistorted) continue;
      moves.emplace_back(px, *undistorted);
      largest = std::max(largest, (*undistorted - px).norm());
    }
  }
  const double cell = c.model.width_px / 16.0;
  *magnification = largest > 1.5 * cell ? 1 : RoundNumber(1.5 * cell / std::max(largest, 1e-3));
  std::string arrows;
  for (const auto& [px, undistorted] : moves) {
    const Eigen::Vector2d at = frame.At(px);
    arrows += Line(at, at + frame.scale * *magnification * (px - undistorted), kBlue, 1.2) +
              Circle(at, 1.5, kInk, "none");
  }
  const Eigen::Vector2d principal = frame.At({c.model.cx, c.model.cy}),
                        center = frame.At({c.model.u0, c.model.v0});
  arrows += Line(principal + Eigen::Vector2d(-7, 0), principal + Eigen::Vector2d(7, 0), kRed, 2) +
            Line(principal + Eigen::Vector2d(0, -7), principal + Eigen::Vector2d(0, 7), kRed, 2) +
            Circle(center, 6, "none", kRed);
  return frame.Draw(arrows);
}

std::string PhotoErrorFigure(const Calibration& c) {
  constexpr double kRow = 20, kNames = 170, kBars = 250;  // CSS px: height, and two widths
  double largest = 1e-6;
  for (const CalibrationPhoto& photo : c.photos) largest = std::max(largest, photo.error_px_rms);
  std::string rows;
  double y = 0;
  for (const CalibrationPhoto& photo : c.photos) {
    const bool is_used = photo.why_left_out.empty();
    rows += Words(kNames - 8, y + 14, photo.name.substr(0, 24), "end");
    if (is_used) {
      rows +=
          Rectangle(kNames, y + 3, kBars * photo.error_px_rms / largest, kRow - 6, kBlue, "none");
      rows += Words(kNames + kBars + 8, y + 14,
                    Fixed(photo.error_px_rms, 3) + " px, " + std::to_string(photo.used_count) +
                        " points, " + Fixed(photo.tilt_deg, 0) + " deg",
                    "start");
    } else {
      rows += Rectangle(kNames, y + 3, 4, kRow - 6, kGray, "none") +
              Words(kNames + 12, y + 14, "left out", "start");
    }
    y += kRow;
  }
  return Svg(kWidth, std::max(y, kRow), rows);
}

}  // namespace veduta
