// SPDX-License-Identifier: Apache-2.0
// veduta-bench-markers: what the detection of markers is worth, measured.
// Exit codes: 0 done; 1 it could not be done; 2 bad usage.

#include <CLI/CLI.hpp>

#include "tools/bench/markers/bench.h"

int main(int argc, char** argv) {
  CLI::App app("Measures the detection of markers");
  app.require_subcommand(1);
  std::string path, out, only;
  std::vector<std::string> paths;
  uint32_t photos = 4, count = 10'000;
  bool is_inverted = false;
  int exit_code = 0;
  CLI::App* session =
      app.add_subcommand("session", "Detections against the truth of a folder by veduta-floor");
  session->add_option("FOLDER", path)->required();
  session->callback([&] { exit_code = veduta::floor::RunSession(path); });
  CLI::App* sweep =
      app.add_subcommand("sweep", "Rate and error against size, tilt, blur, cover and light");
  sweep->add_option("--photos", photos, "a setting (4)");
  sweep->add_option("--only", only, "settings whose names begin so");
  sweep->callback([&] { exit_code = veduta::floor::RunSweep(photos, only); });
  CLI::App* wrong = app.add_subcommand("false", "Ids found in photos that show no marker");
  wrong->add_option("PATH", paths, "photos or folders")->required();
  wrong->callback([&] { exit_code = veduta::floor::RunFalse(paths); });
  CLI::App* draw = app.add_subcommand("draw", "Draws what is found in a photo");
  draw->add_option("PHOTO", path)->required();
  draw->add_option("OUT", out, "a PNG")->required();
  draw->add_flag("--inverted", is_inverted, "of bright targets on dark ground");
  draw->callback([&] { exit_code = veduta::floor::RunDraw(path, out, is_inverted); });
  CLI::App* mutate = app.add_subcommand("mutate", "Damaged files into decoder and detector");
  mutate->add_option("PATH", paths, "photos or folders to damage")->required();
  mutate->add_option("--count", count, "how many (10000)");
  mutate->callback([&] { exit_code = veduta::floor::RunMutations(paths, count); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return exit_code;
}
