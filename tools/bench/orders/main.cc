// SPDX-License-Identifier: Apache-2.0
// veduta-bench-orders: adds a set of photos with truth in many orders, each to a database of its
// own, and says how many orders come out wrong.
// Exit codes: 0 no order is wrong; 1 an order is wrong, or it could not be done; 2 bad usage.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "engine/engine.h"
#include "tools/bench/orders/order_report.h"
#include "tools/bench/orders/side_by_side.h"

namespace veduta::orders {
namespace {

struct Arguments {
  std::string photos, truth, size, params;
  std::vector<std::string> lists;
  uint64_t first = 1, last = 0;
  uint32_t threads = 1, contributors = 0;
  double error_m = 0, error_share = 0;
  Limits limits;
  SideBySideOptions side_by_side;
  bool json = false;
};

void AddCommandLine(CLI::App& app, Arguments& a) {
  app.add_option("PHOTOS", a.photos, "a folder of photos")->required();
  app.add_option("TRUTH", a.truth, "a folder of files NAME.camera in Strecha's layout")->required();
  CLI::Option* const size =
      app.add_option("--size", a.size,
                     "WIDTHxHEIGHT in px of the camera that took all of them; without it the "
                     "photos tell their cameras");
  app.add_option("--params", a.params, "fx,fy,cx,cy[,k1,k2[,u0,v0]], as veduta-street prints them")
      ->needs(size);
  app.add_option("--first", a.first, "the first seed (1); 0 is the order of names");
  app.add_option("--last", a.last,
                 "the last seed (20, or none with --list); the order of a seed is "
                 "ls PHOTOS | shuf --random-source=<(yes SEED)");
  app.add_option("--list", a.lists, "also the order of a file as veduta add --list takes it");
  app.add_option("--jobs", a.side_by_side.jobs, "orders at the same time (1)")
      ->check(CLI::Range(1, 1024));
  app.add_option("--threads", a.threads, "threads of each order (1)")->check(CLI::Range(1, 1024));
  app.add_option("--contributors", a.contributors,
                 "so many people submit the photos at the same time, and the time until each is "
                 "answered is told; without it they are added as one list")
      ->check(CLI::Range(1, 1024));
  app.add_option("--error-m", a.error_m, "limit for a photo's centre in m")
      ->check(CLI::Range(1e-9, 1e9));
  app.add_option("--error-share", a.error_share,
                 "limit for a photo's centre as a share of the extent of the truth; of both limits "
                 "the larger one holds (0.5 m and 0.005 where neither is given)")
      ->check(CLI::Range(1e-9, 1e9));
  app.add_option("--error-deg", a.limits.rotation_deg, "limit for a photo's rotation (2)")
      ->check(CLI::Range(1e-9, 180.0));
  app.add_flag("--keep", a.side_by_side.keep, "keep the databases, and say where they are");
  app.add_flag("--json", a.json, "one JSON object per order, then one for all");
}

Result<std::vector<PhotoOrder>> ReadOrders(const Arguments& arguments) {
  std::vector<PhotoOrder> orders;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<OrderedPhoto> photos, ListFolder(arguments.photos));
  for (uint64_t seed = arguments.first; seed <= arguments.last; ++seed) {
    VEDUTA_ASSIGN_OR_RETURN(PhotoOrder order, ShuffledOrder(photos, seed));
    orders.push_back(std::move(order));
  }
  for (const std::string& list : arguments.lists) {
    VEDUTA_ASSIGN_OR_RETURN(PhotoOrder order, ListedOrder(list));
    orders.push_back(std::move(order));
  }
  if (orders.empty()) return Status::InvalidArgument("no order: --last is below --first");
  return orders;
}

// The exit code.
Result<int> Measure(const Arguments& arguments, const std::optional<CameraModel>& camera,
                    const Truth& truth) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PhotoOrder> orders, ReadOrders(arguments));
  std::vector<ScoredRun> runs(orders.size());
  const auto run = [&](const PhotoOrder& order, const std::string& folder) {
    return RunOrder(order, camera, arguments.threads, arguments.contributors, folder);
  };
  const Status status =
      RunSideBySide(orders, arguments.side_by_side, run, [&](size_t i, const OrderRun& ended) {
        runs[i] = {ended, ScoreRun(ended, truth, arguments.limits)};
        const std::string text =
            arguments.json ? RunJson(runs[i]).dump() + "\n" : RunReport(runs[i]);
        std::fputs(text.c_str(), stdout);
        std::fflush(stdout);
      });
  VEDUTA_RETURN_IF_ERROR(status);
  const OrdersSummary summary = Summarize(runs, arguments.limits);
  const std::string text = arguments.json ? SummaryJson(summary, arguments.limits).dump() + "\n"
                                          : SummaryReport(summary, arguments.limits);
  std::fputs(text.c_str(), stdout);
  return summary.wrong == 0 ? 0 : 1;
}

int ExitCodeOf(const Status& status) {
  return status.code() == StatusCode::kInvalidArgument ? 2 : 1;
}

int Fail(const Status& status, int exit_code) {
  std::fprintf(stderr, "veduta-bench-orders: %s\n", status.message().c_str());
  return exit_code;
}

int Run(int argc, char** argv) {
  CLI::App app("How many orders of a set of photos come out wrong");
  Arguments arguments;
  AddCommandLine(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (app.count("--last") == 0 && arguments.lists.empty())
    arguments.last = std::max<uint64_t>(arguments.first, 20);
  std::optional<CameraModel> camera;
  if (!arguments.size.empty()) {
    const Result<CameraModel> parsed = ParseCamera(arguments.size, arguments.params);
    if (!parsed.ok()) return Fail(parsed.status(), 2);
    camera = *parsed;
  }
  const Result<Truth> truth = ReadTruth(arguments.truth);
  if (!truth.ok()) return Fail(truth.status(), 1);
  const auto given = [&](const char* name, double value) {
    return app.count(name) > 0 ? std::optional<double>(value) : std::nullopt;
  };
  arguments.limits.center_m =
      CenterLimit(given("--error-m", arguments.error_m),
                  given("--error-share", arguments.error_share), ExtentOf(*truth));
  const Result<int> exit_code = Measure(arguments, camera, *truth);
  return exit_code.ok() ? *exit_code : Fail(exit_code.status(), ExitCodeOf(exit_code.status()));
}

}  // namespace
}  // namespace veduta::orders

int main(int argc, char** argv) {
  return veduta::orders::Run(argc, argv);
}
