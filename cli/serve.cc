// SPDX-License-Identifier: Apache-2.0
// veduta serve DB [--http HOST:PORT] [--listen unix:PATH|HOST:PORT] [--threads N] [--waiting N]
// [--waiting-bytes N] [--parts-kept S] [--trust-proxy ADDRESS] [--dense] [--dense-size PX]
// [--device D] [--decoders sandboxed|in-process] [--doubles keep|refuse|better] [--blur PROGRAM]
// [--memory BYTES] [--log none|text|json] [--json]

#include <chrono>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "cli/blur.h"
#include "cli/command.h"
#include "cli/decoders.h"
#include "cli/doubles.h"
#include "cli/follow_ups.h"
#include "cli/rpc/rpc_door.h"
#include "cli/service/http_door.h"
#include "cli/service/memory_division.h"
#include "cli/service/niceness.h"
#include "cli/service_log.h"
#include "cli/stop_on_signal.h"
#include "cli/supervisor.h"
#include "cli/wire/added_json.h"
#include "storage/base/memory_shortage.h"

namespace veduta {
namespace {

struct ServeArguments {
  std::string db;
  HttpDoorOptions door;
  RpcDoorOptions rpc;  // without an address there is no RPC
  ServiceOptions service;
  EngineOptions engine;
  uint64_t memory_bytes = 0;  // 0: each bound is what it is by itself
  uint32_t threads = 0;
  std::string decoders = kDecodersSandboxed;
  Doubles doubles = Doubles::kKeep;
  std::string blur_command;
  bool json = false;
  std::string log_name = "none";
  LogFormat log = LogFormat::kNone;
};

// What became of a photo: a line of the log, or what `veduta add` prints.
void Tell(uint64_t upload, const std::string& name, const Result<AddOutcome>& outcome,
          const ServeArguments& arguments) {
  const bool json = arguments.json;
  if (arguments.log != LogFormat::kNone) {
    WriteLog(PhotoLogJson(upload, name, outcome), arguments.log);
  } else if (!outcome.ok()) {
    std::fprintf(stderr, "veduta: %s: %s\n", Printable(name).c_str(),
                 Printable(outcome.status().message()).c_str());
  } else if (json) {
    PrintJson(ToJson(*outcome));
  } else {
    PrintLine("%-10s %s: %s", OutcomeWord(*outcome).c_str(), Printable(name).c_str(),
              Printable(OutcomeReason(*outcome)).c_str());
  }
}

// Tells what becomes of photos once it has been told where the daemon listens: photos that waited
// may have had their turn before. Thread-safe.
class PhotoTeller final {
 public:
  explicit PhotoTeller(const ServeArguments& arguments) : arguments_(arguments) {}
  ~PhotoTeller() { Begin(); }
  PhotoTeller(const PhotoTeller&) = delete;
  PhotoTeller& operator=(const PhotoTeller&) = delete;

  void operator()(uint64_t upload, const std::string& name, const Result<AddOutcome>& outcome) {
    const std::lock_guard lock(mutex_);
    if (has_begun_) return Tell(upload, name, outcome, arguments_);
    early_.push_back({upload, name, outcome});
  }
  void Begin() {
    const std::lock_guard lock(mutex_);
    has_begun_ = true;
    for (const Photo& photo : std::exchange(early_, {}))
      Tell(photo.upload, photo.name, photo.outcome, arguments_);
  }

 private:
  struct Photo {
    uint64_t upload;
    std::string name;
    Result<AddOutcome> outcome;
  };
  const ServeArguments& arguments_;
  std::mutex mutex_;
  bool has_begun_ = false;
  std::vector<Photo> early_;
};

// Those who ask should not wait while photos are placed, so all threads of the engine are nicer to
// others than those that answer: threads have the niceness of the thread that starts them. On two
// cores the slowest hundredth of answers beside ingest takes 7 ms with it, 9 to 12 without.
constexpr int kEngineNiceness = 10;

// From the first signal on; a follow-up of a large city may take longer. Requests at work have five
// seconds of it.
constexpr std::chrono::seconds kClosingTime(9);

Result<std::unique_ptr<Engine>> OpenNicely(const std::string& db, const EngineOptions& options) {
  Result<std::unique_ptr<Engine>> engine = Status::Cancelled("not opened");
  std::thread([&] {
    BeNicer(kEngineNiceness);
    engine = CatchShortage("open the database", [&] { return OpenToWrite(db, options); });
  }).join();
  return engine;
}

// Divides the memory that the arguments name, if they do.
Status DivideMemoryOf(ServeArguments* arguments) {
  if (arguments->memory_bytes == 0) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const MemoryDivision division, DivideMemory(arguments->memory_bytes));
  arguments->engine.prepare_memory_bytes = division.prepare_memory_bytes;
  arguments->engine.block_cache_bytes = division.block_cache_bytes;
  arguments->engine.feature_cache_bytes = division.feature_cache_bytes;
  arguments->engine.undistort_cache_bytes = division.undistort_cache_bytes;
  arguments->engine.surface_cache_bytes = division.surface_cache_bytes;
  arguments->door.bodies_bytes_max = division.bodies_bytes_max;
  arguments->door.answers_bytes_max = division.answers_bytes_max;
  arguments->rpc.bytes_max = division.rpc_bytes_max;
  return Status::Ok();
}

// Says where the daemon listens; `rpc` is null where there is none.
void TellAddresses(const ServeArguments& arguments, const std::string& http, const RpcDoor* rpc) {
  if (arguments.json) {
    Json told = {{"database", arguments.db}, {"http", "http://" + http}};
    if (rpc != nullptr) told["rpc"] = rpc->address();
    return PrintJson(told);
  }
  PrintLine("serving %s at http://%s", Printable(arguments.db).c_str(), http.c_str());
  if (rpc != nullptr) PrintLine("and by Cap'n Proto RPC at %s", Printable(rpc->address()).c_str());
}

// Serves over HTTP and RPC; either ends with the other.
int ServeBoth(CityService* service, const HttpDoorOptions& http, const ServeArguments& arguments,
              PhotoTeller* teller, const std::stop_token& stop) {
  std::stop_source ending;
  Status rpc_failure;  // written once, before the stop that it requests
  std::once_flag failed;
  std::unique_ptr<RpcDoor> rpc;
  if (!arguments.rpc.address.empty()) {
    RpcDoorOptions options = arguments.rpc;
    options.asks_for_tokens = service->asks_for_tokens();
    const Status checked = options.Check();
    if (!checked.ok()) return FailUsage(checked);
    auto opened = RpcDoor::Open(service, options, [&](const Status& failure) {
      std::call_once(failed, [&] { rpc_failure = failure; });
      ending.request_stop();
    });
    if (!opened.ok()) return Fail(opened.status());
    rpc = *std::move(opened);
  }
  const std::stop_callback on_stop(stop, [&] { ending.request_stop(); });
  Status served;
  {
    const std::stop_callback on_end(ending.get_token(), [&] {
      NotifySupervisor("STOPPING=1");
      if (rpc) rpc->Stop();
    });
    served = ServeHttp(service, http, ending.get_token(), [&](const std::string& address) {
      TellAddresses(arguments, address, rpc.get());
      teller->Begin();
      NotifySupervisor("READY=1");
    });
  }
  rpc.reset();
  if (!served.ok()) return Fail(served);
  return rpc_failure.ok() ? kDone : Fail(rpc_failure);
}

int Serve(const ServeArguments& arguments) {
  const StopOnSignal stop(kClosingTime);
  HttpDoorOptions door = arguments.door;
  door.database = arguments.db;
  EngineOptions options = arguments.engine;
  options.thread_count = arguments.threads;
  ServiceOptions service_options = arguments.service;
  service_options.dense.request.cache_folder = ProgramCacheFolder();
  const Status usable = service_options.Check();
  if (!usable.ok()) return FailUsage(usable);
  // Looking for devices may take as long as loading their drivers does.
  const std::string& device = service_options.dense.request.device;
  const bool is_any = device == DensifyRequest().device;
  const Result<DeviceList> devices = is_any ? DeviceList() : ListDevices(device);
  if (!devices.ok()) return Fail(devices.status());
  options.settle_each = true;  // the order of the photos alone decides what becomes of them
  options.decoder_program = DecoderProgram(arguments.decoders);
  options.doubles = arguments.doubles;
  options.blur_command = arguments.blur_command;
  auto engine = OpenNicely(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  PhotoTeller teller(arguments);
  CityService service(
      *std::move(engine), arguments.db, service_options,
      {.ended = [&](uint64_t upload, const std::string& name,
                    const Result<AddOutcome>& outcome) { teller(upload, name, outcome); },
       .followed =
           [&](const FollowUp& step, const Questions& ask) {
             if (step.status.ok()) return;
             std::fprintf(stderr, "%s\n", FollowUpFailure(step, ask, arguments.db).c_str());
           },
       .dense_failed =
           [](const Status& failure) {
             std::fprintf(stderr, "veduta: the dense pass failed, and is tried again: %s\n",
                          Printable(failure.message()).c_str());
           },
       .damage_met =
           [](const std::string& damage) {
             std::fprintf(stderr, "veduta: the database is damaged, see 'veduta verify': %s\n",
                          Printable(damage).c_str());
           },
       .asked = RequestLog(arguments.log)});
  door.asks_for_tokens = service.asks_for_tokens();
  const Status checked = door.Check();
  if (!checked.ok()) return FailUsage(checked);
  const Status resumed = service.Resume();
  if (!resumed.ok()) {
    std::fprintf(stderr, "veduta: photos that wait for their turn cannot be read: %s\n",
                 Printable(resumed.message()).c_str());
  }
  return ServeBoth(&service, door, arguments, &teller, stop.token());
}

void AddDenseOptions(CLI::App* command, DenseKeeping* dense) {
  command->add_flag("--dense", dense->is_wanted,
                    "Keep depth maps and surfaces up to date while photos come");
  command->add_option("--dense-size", dense->request.options.depth_side_px,
                      "Longer side of depth maps in px, as of `veduta densify --size`");
  command->add_option("--device", dense->request.device,
                      "The device of the dense pass, as of `veduta densify`");
}

}  // namespace

void RegisterServe(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ServeArguments>();
  CLI::App* command = app->add_subcommand(
      "serve", "Answer questions and take photos over HTTP and RPC, until it is told to stop");
  command->add_option("DB", arguments->db, "Database")->required();
  command
      ->add_option(
          "--http", arguments->door.address,
          "HOST:PORT to listen at; the host must be this machine until there is a token, port 0 is "
          "any free one")
      ->capture_default_str();
  command->add_option(
      "--trust-proxy", arguments->door.proxies,
      "Address of a proxy before the daemon that is believed where requests come from "
      "(X-Forwarded-For); may be given again");
  command->add_option(
      "--listen", arguments->rpc.address,
      "unix:PATH or HOST:PORT to listen at for Cap'n Proto RPC as well; the host must be this "
      "machine until there is a token");
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--waiting", arguments->service.intake.photos_max,
                   "Photos that may wait for their turn; more are told to come again later")
      ->capture_default_str()
      ->check(CLI::Range(1, 1'000'000));
  command
      ->add_option("--waiting-bytes", arguments->service.intake.bytes_max,
                   "Bytes on the disk that these photos may have in all")
      ->transform(SizeInBytes())
      ->capture_default_str();
  command
      ->add_option("--parts-kept", arguments->service.tus.keep_s,
                   "Seconds after which a photo that arrives in parts, and comes no further, is "
                   "given up")
      ->capture_default_str();
  command
      ->add_option("--memory", arguments->memory_bytes,
                   "Memory that preparing photos, caches, bodies and answers share, at least 1 GiB "
                   "(default: each has its own bound)")
      ->transform(SizeInBytes())
      ->check(AboveZero());
  AddDenseOptions(command, &arguments->service.dense);
  AddDecodersOption(command, &arguments->decoders);
  AddDoublesOption(command, &arguments->doubles);
  AddBlurOption(command, &arguments->blur_command);
  command
      ->add_option("--log", arguments->log_name,
                   "Lines on standard error for each request and each photo, or none")
      ->check(CLI::IsMember({"none", "text", "json"}))
      ->capture_default_str();
  command->add_flag("--json", arguments->json,
                    "JSON: one object that says where it listens, then one for each photo");
  command->callback([=] {
    arguments->log = LogFormats().at(arguments->log_name);
    const Status divided = DivideMemoryOf(arguments.get());
    *exit_code = divided.ok() ? Serve(*arguments) : FailUsage(divided);
  });
}

}  // namespace veduta
