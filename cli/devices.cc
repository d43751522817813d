// SPDX-License-Identifier: Apache-2.0
// veduta devices [--device D] [--json]
#include "cli/command.h"
#include "cli/wire/dense_json.h"

namespace veduta {
namespace {

int PrintDevices(const std::string& wanted, bool json) {
  const Result<DeviceList> list = ListDevices(wanted);
  if (!list.ok()) return Fail(list.status());
  if (json) {
    PrintJson(ToJson(*list));
    return kDone;
  }
  for (const DeviceInfo& d : list->devices) {
    PrintLine("%c %u: %s (%s, %u compute units, %.1f GB; %s, driver %s)",
              list->chosen == d.index ? '*' : ' ', d.index, Printable(d.name).c_str(),
              DeviceKindName(d.kind), d.compute_units, static_cast<double>(d.memory_bytes) / 1e9,
              Printable(d.platform).c_str(), Printable(d.driver_version).c_str());
  }
  if (!list->chosen) PrintLine("%s: C++ does the work", Printable(list->why_none).c_str());
  return kDone;
}

}  // namespace

void RegisterDevices(CLI::App* app, int* exit_code) {
  auto wanted = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app->add_subcommand("devices", "OpenCL devices; * marks the one that works");
  command->add_option("--device", *wanted,
                      "auto, gpu, cpu, an index, a part of the name, or cpp for none");
  command->add_flag("--json", *json, "JSON");
  command->callback([=] { *exit_code = PrintDevices(*wanted, *json); });
}

}  // namespace veduta
