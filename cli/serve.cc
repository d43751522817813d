// SPDX-License-Identifier: Apache-2.0
// veduta serve DB [--http HOST:PORT] [--threads N] [--waiting N] [--json]
#include "cli/command.h"
#include "cli/service/http_door.h"
#include "cli/stop_on_signal.h"

namespace veduta {
namespace {

struct ServeArguments {
  std::string db;
  HttpDoorOptions door;
  ServiceOptions service;
  uint32_t threads = 0;
  bool json = false;
};

int Serve(const ServeArguments& arguments) {
  const StopOnSignal stop;
  const Status checked = arguments.door.Check();
  if (!checked.ok()) return FailUsage(checked);
  EngineOptions options;
  options.thread_count = arguments.threads;
  options.settle_each = true;  // the order of the photos alone decides what becomes of them
  auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  CityService service(*std::move(engine), arguments.service);
  const Status served =
      ServeHttp(&service, arguments.door, stop.token(), [&](const std::string& address) {
        if (arguments.json) {
          PrintJson({{"database", arguments.db}, {"http", "http://" + address}});
        } else {
          PrintLine("serving %s at http://%s", Printable(arguments.db).c_str(), address.c_str());
        }
      });
  return served.ok() ? kDone : Fail(served);
}

}  // namespace

void RegisterServe(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ServeArguments>();
  CLI::App* command = app->add_subcommand(
      "serve", "Answer questions and take photos over HTTP, until it is told to stop");
  command->add_option("DB", arguments->db, "Database")->required();
  command
      ->add_option("--http", arguments->door.address,
                   "HOST:PORT to listen at; the host must be this machine, port 0 is any free one")
      ->capture_default_str();
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--waiting", arguments->service.waiting_photos_max,
                   "Photos that may wait for their turn; more are told to come again later")
      ->capture_default_str()
      ->check(CLI::Range(1, 100'000));
  command->add_flag("--json", arguments->json, "The line that says where it listens as JSON");
  command->callback([=] { *exit_code = Serve(*arguments); });
}

}  // namespace veduta
