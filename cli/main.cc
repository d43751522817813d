// SPDX-License-Identifier: Apache-2.0
// The one binary: reads the command line and runs one command.

#include <glog/logging.h>
#include <malloc.h>
#include <sys/resource.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <opencv2/core/utility.hpp>
#include <sstream>

#include "cli/command.h"

namespace veduta {
namespace {

// The C library keeps the pages of blocks of up to 16 MB that are freed instead of giving them back
// and faulting them in anew for each photo, and gives larger blocks back at once. When it kept all
// blocks, they left no room for the next photo of 100 Mpx where memory was limited to 1.5 GB;
// castle-P19 is added as fast with 1 GiB, 32, 16 and 8 MB. Each of the library's arenas, one for
// each thread, takes 64 MB of addresses, so there are few where addresses are limited (`ulimit
// -v`).
void SetUpMemory() {
  mallopt(M_MMAP_THRESHOLD, 16 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
  rlimit addresses{};
  if (getrlimit(RLIMIT_AS, &addresses) == 0 && addresses.rlim_cur != RLIM_INFINITY)
    mallopt(M_ARENA_MAX, 2);
}

void SetUpProcess() {
  KeepOutputForResults();
  SetUpMemory();
  // A file that reaches its limit is a failed write with a message, not the end of the process.
  std::signal(SIGXFSZ, SIG_IGN);
  // Ceres logs steps that fail and that it then mends by itself.
  FLAGS_minloglevel = google::GLOG_FATAL;
  // One photo on each thread serves better than many threads on one photo.
  cv::setNumThreads(1);
}

void RegisterCommands(CLI::App* app, int* exit_code) {
  RegisterInit(app, exit_code);
  RegisterCamera(app, exit_code);
  RegisterMarkers(app, exit_code);
  RegisterCalibrate(app, exit_code);
  RegisterAdd(app, exit_code);
  RegisterImport(app, exit_code);
  RegisterServe(app, exit_code);
  RegisterToken(app, exit_code);
  RegisterSettle(app, exit_code);
  RegisterRemove(app, exit_code);
  RegisterForbid(app, exit_code);
  RegisterHide(app, exit_code);
  RegisterReports(app, exit_code);
  RegisterStatus(app, exit_code);
  RegisterReconstruction(app, exit_code);
  RegisterShow(app, exit_code);
  RegisterNeighbors(app, exit_code);
  RegisterPose(app, exit_code);
  RegisterLocalize(app, exit_code);
  RegisterGeoreference(app, exit_code);
  RegisterExport(app, exit_code);
  RegisterDensify(app, exit_code);
  RegisterRender(app, exit_code);
  RegisterVerify(app, exit_code);
  RegisterDigest(app, exit_code);
  RegisterVocabulary(app, exit_code);
  RegisterJournal(app, exit_code);
  RegisterBackup(app, exit_code);
  RegisterRepair(app, exit_code);
  RegisterDevices(app, exit_code);
}

// Says what is wrong with the command line, or what was asked of it; the exit code.
int Complain(const CLI::App& app, const CLI::ParseError& error) {
  std::ostringstream help, complaint;
  const int code = app.exit(error, help, complaint) == 0 ? kDone : kBadUsage;
  PrintBytes(help.str());
  std::fprintf(stderr, "%s", PrintableLines(complaint.str()).c_str());
  return code;
}

bool IsCommand(CLI::App* app, const std::string& name) {
  const auto has_name = [&](const CLI::App* one) { return one->get_name() == name; };
  return !app->get_subcommands(has_name).empty();
}

int Run(int argc, char** argv) {
  CLI::App app(
      "Veduta: a database of a city's photographs that knows where each was taken and what the "
      "city looks like in 3D.");
  app.set_version_flag("--version", VEDUTA_VERSION);
  app.require_subcommand(1);
  int exit_code = kDone;
  RegisterCommands(&app, &exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::RequiredError& error) {
    if (argc < 2 || argv[1][0] == '-' || IsCommand(&app, argv[1])) {
      exit_code = Complain(app, error);
    } else {
      return FailUsage(Status::InvalidArgument(std::string("there is no command '") + argv[1] +
                                               "': 'veduta --help' names all"));
    }
  } catch (const CLI::ParseError& error) {
    exit_code = Complain(app, error);
  } catch (const std::exception& error) {  // out of memory, mostly
    return Fail(Status::IoError(error.what()));
  }
  return exit_code;
}

}  // namespace
}  // namespace veduta

int main(int argc, char** argv) {
  veduta::SetUpProcess();
  const int exit_code = veduta::Run(argc, argv);
  const veduta::Status written = veduta::OutputStatus();
  if (written.ok()) return exit_code;
  const int failed = veduta::Fail(written);
  return exit_code == veduta::kDone ? failed : exit_code;
}
