// SPDX-License-Identifier: Apache-2.0
#include "engine/repair/repair_report.h"

#include <vector>

namespace veduta {
namespace {

void AppendPhotos(const std::string& heading, const std::vector<std::string>& names,
                  std::string* text) {
  if (names.empty()) return;
  *text += "\n" + heading + "\n";
  for (const std::string& name : names) *text += "  " + name + "\n";
}

}  // namespace

std::string RepairReport(const std::string& database, const RepairAnswer& answer) {
  std::string text = "Repair of the database " + database + "\n";
  text += "The damaged database is kept as " + answer.kept_path +
          " until you delete it. Nothing in it was changed.\n";
  if (answer.is_rebuilt) {
    text +=
        "The records contradicted each other, so the map was made anew from the photos. Images "
        "have new numbers.\n";
  }
  text += "\nWhat was damaged, and what was done:\n";
  for (const RepairFinding& finding : answer.findings)
    text += "  " + finding.damage + "; " + finding.remedy + "\n";
  AppendPhotos("Photos whose bytes are lost; add them again where you have them:", answer.lost,
               &text);
  AppendPhotos("Photos written to " + answer.photos_path + "; add them again with their camera:",
               answer.written_out, &text);
  AppendPhotos("Photos that lost their place and were tried again:", answer.retried, &text);
  return text;
}

}  // namespace veduta
