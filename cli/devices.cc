// SPDX-License-Identifier: Apache-2.0
// veduta devices [--device D] [--json]
#include "cli/command.h"
#include "kernels/device.h"

namespace veduta {
namespace {

int PrintDevices(const std::string& wanted, bool json) {
  const std::vector<DeviceInfo> devices = ListDevices();
  const bool by_default = wanted.empty();
  const Result<DeviceInfo> chosen = ChooseDevice(wanted, devices);
  // That there is none is an answer; that the one asked for is missing is not.
  if (!chosen.ok() && !by_default && !WantsNoDevice(wanted)) return Fail(chosen.status());
  const auto is_chosen = [&](const DeviceInfo& device) {
    return chosen.ok() && chosen->index == device.index;
  };
  if (json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const DeviceInfo& d : devices) {
      list.push_back({{"index", d.index},
                      {"name", d.name},
                      {"platform", d.platform},
                      {"driver", d.driver_version},
                      {"kind", DeviceKindName(d.kind)},
                      {"compute_units", d.compute_units},
                      {"memory_bytes", d.memory_bytes},
                      {"chosen", is_chosen(d)}});
    }
    std::printf("%s\n", nlohmann::ordered_json{{"devices", list}}.dump().c_str());
    return kDone;
  }
  for (const DeviceInfo& d : devices) {
    std::printf("%c %u: %s (%s, %u compute units, %.1f GB; %s, driver %s)\n",
                is_chosen(d) ? '*' : ' ', d.index, d.name.c_str(), DeviceKindName(d.kind),
                d.compute_units, static_cast<double>(d.memory_bytes) / 1e9, d.platform.c_str(),
                d.driver_version.c_str());
  }
  if (!chosen.ok()) std::printf("%s: C++ does the work\n", chosen.status().message().c_str());
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
