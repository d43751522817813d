// SPDX-License-Identifier: Apache-2.0
// veduta-floor: renders photos of markers on a floor, to calibrate by, with the truth about each.
// Exit codes: 0 done; 1 it could not be done; 2 bad usage.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <string>

#include "engine/camera/camera_text.h"
#include "engine/camera/number_text.h"
#include "tools/render/floor/session.h"

namespace veduta::floor {
namespace {

struct Arguments {
  std::string folder, size = "2048x1536", params, flooring = "wood", paper = "a4",
                      arrangement = "scattered";
  double focal_widths = 0.9, k1 = -0.1, k2 = 0.02;
  bool quiet = false;
  SessionOptions session;
};

Result<SessionOptions> MakeOptions(const Arguments& arguments) {
  static const std::map<std::string_view, Flooring> floorings = {{"plain", Flooring::kPlain},
                                                                 {"wood", Flooring::kWood},
                                                                 {"tile", Flooring::kTile},
                                                                 {"terrazzo", Flooring::kTerrazzo}};
  SessionOptions options = arguments.session;
  VEDUTA_ASSIGN_OR_RETURN(const ImageSize size, ParseSize(arguments.size));
  std::string params = arguments.params;
  if (params.empty()) {
    const std::string focal = NumberText(arguments.focal_widths * size.width_px);
    params = focal + "," + focal + "," + NumberText((size.width_px - 1.0) / 2) + "," +
             NumberText((size.height_px - 1.0) / 2) + "," + NumberText(arguments.k1) + "," +
             NumberText(arguments.k2);
  }
  VEDUTA_ASSIGN_OR_RETURN(options.model, ParseCameraParams(params, size));
  options.floor.flooring = floorings.at(arguments.flooring);
  options.floor.paper = *PaperFromName(arguments.paper);
  options.floor.is_scattered = arguments.arrangement == "scattered";
  options.floor.seed = options.photo.seed = options.seed;
  VEDUTA_RETURN_IF_ERROR(options.Check());
  return options;
}

void AddCommandLine(CLI::App& app, Arguments& a) {
  SessionOptions& s = a.session;
  app.add_option("OUT", a.folder, "a new or empty folder")->required();
  app.add_option("--photos", s.photos, "how many (12)")->check(CLI::Range(1, 1000));
  app.add_option("--size", a.size, "WIDTHxHEIGHT in px (2048x1536)");
  app.add_option("--params", a.params, "fx,fy,cx,cy[,k1,k2[,u0,v0]]; instead of the next three");
  app.add_option("--focal", a.focal_widths, "focal length in widths (0.9)")
      ->check(CLI::Range(0.1, 10.0));
  app.add_option("--k1", a.k1, "radial distortion x_d = c + (x - c)(1 + k1 r^2 + k2 r^4) (-0.1)");
  app.add_option("--k2", a.k2, "see --k1 (0.02)");
  app.add_option("--markers", s.floor.marker_count, "how many different ones, 6 a sheet (96)")
      ->check(CLI::Range(1u, kMarkerIdCount));
  app.add_option("--paper", a.paper, "a4 or letter")->check(CLI::IsMember({"a4", "letter"}));
  app.add_option("--arrangement", a.arrangement, "scattered or grid")
      ->check(CLI::IsMember({"scattered", "grid"}));
  app.add_option("--floor", a.flooring, "plain, wood, tile or terrazzo (wood)")
      ->check(CLI::IsMember({"plain", "wood", "tile", "terrazzo"}));
  app.add_option("--bend", s.floor.bend_mm, "mm that a sheet's corner may rise (2)")
      ->check(CLI::Range(0.0, 50.0));
  app.add_option("--things", s.floor.cover_count, "lying about, some on the sheets (0)")
      ->check(CLI::Range(0, 1000));
  app.add_option("--tilt", s.tilt_deg_max, "of the most slanted photo, degrees (55)")
      ->check(CLI::Range(0.0, 75.0));
  app.add_option("--coverage", s.coverage, "floor seen, in diameters of the sheets (0.8)")
      ->check(CLI::Range(0.1, 5.0));
  app.add_option("--noise", s.photo.noise_sigma, "grey levels (2)")->check(CLI::Range(0.0, 64.0));
  app.add_option("--blur", s.photo.blur_sigma_px, "sigma in px (0.7)")
      ->check(CLI::Range(0.0, 20.0));
  app.add_option("--blur-more", s.blur_sigma_px_max, "each photo up to this more (0)")
      ->check(CLI::Range(0.0, 20.0));
  app.add_option("--motion", s.motion_px_max, "each photo smeared by up to this, px (0)")
      ->check(CLI::Range(0., 100.));
  app.add_option("--vignetting", s.photo.vignetting, "light lost in the corner (0.3)")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--unevenness", s.photo.unevenness, "of the light (0.4)")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--exposure", s.photo.exposure, "1: paper nearly white (1)")
      ->check(CLI::Range(0.05, 20.0));
  app.add_option("--jpeg-quality", s.jpeg_quality, "1 to 100 (90)")->check(CLI::Range(1, 100));
  app.add_option("--seed", s.seed, "of everything (1)");
  app.add_option("--threads", s.threads, "one photo per thread (1)")->check(CLI::Range(1, 256));
  app.add_flag("--quiet", a.quiet, "no progress on standard error");
}

int Run(int argc, char** argv) {
  CLI::App app("Photos of markers on a floor, to calibrate a camera by, with their truth");
  Arguments arguments;
  AddCommandLine(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  Result<SessionOptions> options = MakeOptions(arguments);
  if (!options.ok()) {
    std::fprintf(stderr, "veduta-floor: %s\n", options.status().message().c_str());
    return 2;
  }
  for (int i = 1; i < argc; ++i) {
    if (argv[i] != arguments.folder)
      options->command += std::string(options->command.empty() ? "" : " ") + argv[i];
  }
  const auto progress = [&](size_t done) {
    if (!arguments.quiet) std::fprintf(stderr, "%zu/%u photos\n", done, options->photos);
  };
  const Status status = RenderSession(*options, arguments.folder, progress);
  if (!status.ok()) {
    std::fprintf(stderr, "veduta-floor: %s\n", status.message().c_str());
    return status.code() == StatusCode::kInvalidArgument ? 2 : 1;
  }
  std::printf("%s: %u photos; --size %s --params %s\n", arguments.folder.c_str(), options->photos,
              arguments.size.c_str(), CameraParamsText(options->model).c_str());
  return 0;
}

}  // namespace
}  // namespace veduta::floor

int main(int argc, char** argv) {
  return veduta::floor::Run(argc, argv);
}
