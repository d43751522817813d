// SPDX-License-Identifier: Apache-2.0
// veduta markers --out sheets.pdf [--paper a4|letter] [--count 96]
#include <cerrno>
#include <cstring>
#include <fstream>

#include "cli/command.h"
#include "engine/calibration_door.h"

namespace veduta {
namespace {

struct MarkersArguments {
  std::string out, paper = "a4";
  uint32_t count = 96;
};

int WriteMarkers(const MarkersArguments& arguments) {
  const Result<MarkerSheets> sheets = MakeMarkerSheets(arguments.paper, arguments.count);
  if (!sheets.ok()) return Fail(sheets.status());
  std::ofstream file(arguments.out, std::ios::binary);
  file.write(reinterpret_cast<const char*>(sheets->pdf.data()),
             static_cast<std::streamsize>(sheets->pdf.size()));
  file.close();
  if (!file)
    return Fail(Status::IoError("cannot write " + arguments.out + ": " + std::strerror(errno)));
  std::printf("%s: %u markers on %u sheets of %s\n", arguments.out.c_str(), arguments.count,
              sheets->sheet_count, arguments.paper.c_str());
  return kDone;
}

}  // namespace

void RegisterMarkers(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<MarkersArguments>();
  CLI::App* markers =
      app->add_subcommand("markers", "Sheets of markers to print, lay on a floor and calibrate by");
  markers->add_option("--out", arguments->out, "The PDF to write")->required();
  markers->add_option("--paper", arguments->paper, "a4 or letter (a4)")
      ->check(CLI::IsMember({"a4", "letter"}));
  markers->add_option("--count", arguments->count, "How many different markers, 6 to a sheet (96)")
      ->check(CLI::Range(1u, 178u));  // as MakeMarkerSheets
  markers->callback([=] { *exit_code = WriteMarkers(*arguments); });
}

}  // namespace veduta
