// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the commands share: exit codes, how a failure is said, opening the database.

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "cli/output.h"
#include "cli/photos/photo_list.h"
#include "cli/printable.h"
#include "engine/engine.h"

namespace veduta {

// What an argument that means a stored photo may be.
inline constexpr const char* kPhotoHelp =
    "A stored photo: its name, CONTRIBUTOR/NAME, # and its number, or 8 or more digits of its "
    "SHA-256";

enum ExitCode : int { kDone = 0, kNotDone = 1, kBadUsage = 2, kDatabaseUnusable = 3 };

// The exit code that goes with a failure: 3 where the database is locked or damaged, otherwise 1.
int ExitCodeOf(const Status& status);
// Prints the sentence to standard error; ExitCodeOf.
int Fail(const Status& status);
// Prints the sentence to standard error; kBadUsage.
int FailUsage(const Status& status);

// ListPhotos; says on standard error what is passed over.
Result<std::vector<ListedPhoto>> ListPhotosAndWarn(const std::vector<std::string>& paths);

// The photos that a command's arguments mean: those of a list file where one is given, relative to
// the first path where there is one; otherwise ListPhotosAndWarn.
Result<std::vector<ListedPhoto>> ListPhotosOf(const std::string& list,
                                              const std::vector<std::string>& paths);
// What is wrong with a list file and paths given together: exceptions of the command line.
void CheckPhotoArguments(const std::string& list, const std::vector<std::string>& paths);
// Bytes, as "20MB"; no negative ones.
CLI::Validator SizeInBytes();
// A number above 0.
CLI::Validator AboveZero();
// Of an option --camera that may be left out: why its name is none; empty where it is one.
std::string CheckCameraName(const std::string& name);

// For commands that only ask: takes no lock, so it works while another process adds.
Result<std::unique_ptr<Engine>> OpenToRead(const std::string& path, uint32_t thread_count = 0);
Result<std::unique_ptr<Engine>> OpenToWrite(const std::string& path,
                                            const EngineOptions& options = {});

// Where built OpenCL programs are kept (XDG Base Directory Specification). Empty where the user has
// no such folder: then they are built each time.
std::string ProgramCacheFolder();

// Each adds its command to the app; running it sets *exit_code.
void RegisterInit(CLI::App* app, int* exit_code);
void RegisterCamera(CLI::App* app, int* exit_code);
void RegisterMarkers(CLI::App* app, int* exit_code);
void RegisterCalibrate(CLI::App* app, int* exit_code);
void RegisterAdd(CLI::App* app, int* exit_code);
void RegisterImport(CLI::App* app, int* exit_code);
void RegisterRemove(CLI::App* app, int* exit_code);
void RegisterServe(CLI::App* app, int* exit_code);
void RegisterSettle(CLI::App* app, int* exit_code);
void RegisterStatus(CLI::App* app, int* exit_code);
void RegisterReconstruction(CLI::App* app, int* exit_code);
void RegisterShow(CLI::App* app, int* exit_code);
void RegisterNeighbors(CLI::App* app, int* exit_code);
void RegisterPose(CLI::App* app, int* exit_code);
void RegisterLocalize(CLI::App* app, int* exit_code);
void RegisterForbid(CLI::App* app, int* exit_code);
void RegisterHide(CLI::App* app, int* exit_code);
void RegisterReports(CLI::App* app, int* exit_code);
void RegisterGeoreference(CLI::App* app, int* exit_code);
void RegisterToken(CLI::App* app, int* exit_code);
void RegisterExport(CLI::App* app, int* exit_code);
void RegisterDensify(CLI::App* app, int* exit_code);
void RegisterRender(CLI::App* app, int* exit_code);
void RegisterVerify(CLI::App* app, int* exit_code);
void RegisterDigest(CLI::App* app, int* exit_code);
void RegisterVocabulary(CLI::App* app, int* exit_code);
void RegisterJournal(CLI::App* app, int* exit_code);
void RegisterBackup(CLI::App* app, int* exit_code);
void RegisterRepair(CLI::App* app, int* exit_code);
void RegisterDevices(CLI::App* app, int* exit_code);

}  // namespace veduta
