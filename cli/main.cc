// SPDX-License-Identifier: Apache-2.0
// The one binary: reads the command line and runs one command.

#include <glog/logging.h>
#include <malloc.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <opencv2/core/utility.hpp>

#include "cli/command.h"

int main(int argc, char** argv) {
  // Photos come and go by the tens of megabytes: keep their pages rather than fault them in anew
  // each time.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  std::signal(SIGXFSZ,
              SIG_IGN);  // a file at its limit is a failed write with a message, not the end
  FLAGS_minloglevel = google::GLOG_FATAL;  // Ceres tells of steps that it then mends by itself
  cv::setNumThreads(1);  // one photo a thread serves better than many threads a photo

  CLI::App app(
      "Veduta: a database of a city's photographs that knows where each was taken and what the "
      "city looks like in 3D.");
  app.set_version_flag("--version", VEDUTA_VERSION);
  app.require_subcommand(1);
  int exit_code = veduta::kDone;
  veduta::RegisterInit(&app, &exit_code);
  veduta::RegisterCamera(&app, &exit_code);
  veduta::RegisterMarkers(&app, &exit_code);
  veduta::RegisterCalibrate(&app, &exit_code);
  veduta::RegisterAdd(&app, &exit_code);
  veduta::RegisterStatus(&app, &exit_code);
  veduta::RegisterShow(&app, &exit_code);
  veduta::RegisterNeighbors(&app, &exit_code);
  veduta::RegisterPose(&app, &exit_code);
  veduta::RegisterExport(&app, &exit_code);
  veduta::RegisterDensify(&app, &exit_code);
  veduta::RegisterRender(&app, &exit_code);
  veduta::RegisterVerify(&app, &exit_code);
  veduta::RegisterDigest(&app, &exit_code);
  veduta::RegisterVocabulary(&app, &exit_code);
  veduta::RegisterJournal(&app, &exit_code);
  veduta::RegisterBackup(&app, &exit_code);
  veduta::RegisterDevices(&app, &exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? veduta::kDone : veduta::kBadUsage;
  } catch (const std::exception& error) {  // out of memory, mostly
    std::fprintf(stderr, "veduta: %s\n", error.what());
    return veduta::kNotDone;
  }
  std::fflush(stdout);
  return exit_code;
}
