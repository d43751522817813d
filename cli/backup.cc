// SPDX-License-Identifier: Apache-2.0
// veduta backup DB DIR [--keep N] [--json]; veduta restore DIR DB [--backup N] [--json]
// veduta backups list|check DIR [--json]; veduta backups thin DIR --keep N [--json]
// veduta copy DB OUT
#include <ctime>

#include "cli/command.h"
#include "cli/owner_beside.h"
#include "cli/stop_on_signal.h"
#include "cli/wire/backup_json.h"

namespace veduta {
namespace {

struct BackupArguments {
  std::string db, folder;
  uint32_t keep = 0, number = 0;
  bool json = false;
};

// "2026-11-24 03:00:00 UTC".
std::string TimeText(int64_t time_unix_s) {
  const time_t time = time_unix_s;
  std::tm parts{};
  char text[64] = "";
  if (gmtime_r(&time, &parts)) std::strftime(text, sizeof(text), "%F %T UTC", &parts);
  return text;
}

std::string BackupText(const BackupAnswer& backup) {
  return "backup " + std::to_string(backup.number) + " of " + TimeText(backup.time_unix_s) + ": " +
         std::to_string(backup.files) + " files, " + std::to_string(backup.bytes) + " bytes";
}

Result<BackupReport> MakeBackup(const BackupArguments& arguments) {
  const BackupRequest request{arguments.folder, arguments.keep};
  if (auto daemon = DaemonClient::Connect(arguments.db)) return BackupBeside(&*daemon, request);
  const StopOnSignal stop;
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Engine> engine, OpenToWrite(arguments.db));
  return engine->Backup(request, stop.token());
}

int Backup(const BackupArguments& arguments) {
  const Result<BackupReport> report = MakeBackup(arguments);
  if (!report.ok()) return Fail(report.status());
  if (arguments.json) {
    PrintJson(ToJson(*report));
    return kDone;
  }
  PrintLine("%s", BackupText(report->backup).c_str());
  PrintLine("copied %lu files, %lu bytes", report->copied_files, report->copied_bytes);
  if (report->deleted > 0) PrintLine("deleted %u older backups", report->deleted);
  return kDone;
}

int Copy(const BackupArguments& arguments) {
  if (auto daemon = DaemonClient::Connect(arguments.db)) {
    const Status copied = CopyBeside(&*daemon, arguments.folder);
    return copied.ok() ? kDone : Fail(copied);
  }
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status copied = (*engine)->Copy(arguments.folder);
  return copied.ok() ? kDone : Fail(copied);
}

int Restore(const BackupArguments& arguments) {
  const StopOnSignal stop;
  const auto restored =
      RestoreBackup(arguments.folder, arguments.number, arguments.db, stop.token());
  if (!restored.ok()) return Fail(restored.status());
  if (arguments.json) {
    PrintJson(ToJson(*restored));
  } else {
    PrintLine("restored %s", BackupText(*restored).c_str());
  }
  return kDone;
}

int Tell(const Result<BackupList>& list, bool json, const char* if_whole) {
  if (!list.ok()) return Fail(list.status());
  if (json) {
    PrintJson(ToJson(*list));
  } else {
    for (const BackupAnswer& backup : list->backups) PrintLine("%s", BackupText(backup).c_str());
    for (const std::string& what : list->damage) PrintLine("%s", Printable(what).c_str());
    if (list->damage.empty() && *if_whole != '\0') PrintLine("%s", if_whole);
  }
  return list->damage.empty() ? kDone : kDatabaseUnusable;
}

int List(const BackupArguments& arguments) {
  return Tell(ListBackups(arguments.folder), arguments.json, "");
}

int Check(const BackupArguments& arguments) {
  const StopOnSignal stop;
  return Tell(CheckBackups(arguments.folder, stop.token()), arguments.json, "all files are whole");
}

int Thin(const BackupArguments& arguments) {
  const Result<uint32_t> deleted = ThinBackups(arguments.folder, arguments.keep);
  if (!deleted.ok()) return Fail(deleted.status());
  if (arguments.json) {
    PrintJson({{"deleted", *deleted}});
  } else {
    PrintLine("deleted %u backups", *deleted);
  }
  return kDone;
}

using Run = int (*)(const BackupArguments&);

CLI::App* RegisterOne(CLI::App* app, const char* name, const char* help, Run run, int* exit_code,
                      const std::shared_ptr<BackupArguments>& arguments) {
  CLI::App* command = app->add_subcommand(name, help);
  command->callback([=] { *exit_code = run(*arguments); });
  return command;
}

// A positional argument that must be there.
void AddPlace(CLI::App* command, const char* name, std::string* target, const char* help) {
  command->add_option(name, *target, help)->required();
}

void AddFlag(CLI::App* command, BackupArguments* arguments) {
  command->add_flag("--json", arguments->json, "JSON");
}

void RegisterList(CLI::App* app, int* exit_code) {
  CLI::App* backups = app->add_subcommand("backups", "What is in a folder of backups");
  backups->require_subcommand(1);
  const auto arguments = std::make_shared<BackupArguments>();
  BackupArguments& a = *arguments;
  for (CLI::App* const command :
       {RegisterOne(backups, "list", "The backups, by number and time", List, exit_code, arguments),
        RegisterOne(backups, "check", "Read all files of all backups, and name what is damaged",
                    Check, exit_code, arguments),
        RegisterOne(backups, "thin", "Delete all but the newest backups", Thin, exit_code,
                    arguments)}) {
    AddPlace(command, "DIR", &a.folder, "Folder of backups");
    AddFlag(command, &a);
    if (command->get_name() == "thin")
      command->add_option("--keep", a.keep, "How many backups stay")
          ->required()
          ->check(AboveZero());
  }
}

}  // namespace

void RegisterBackup(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<BackupArguments>();
  BackupArguments& a = *arguments;
  CLI::App* backup =
      RegisterOne(app, "backup", "Add a backup to a folder of them; copies what is new, checked",
                  Backup, exit_code, arguments);
  AddPlace(backup, "DB", &a.db, "Database");
  AddPlace(backup, "DIR", &a.folder, "Folder of this database's backups, on another disk");
  backup->add_option("--keep", a.keep, "Delete older backups than so many (default: none)")
      ->check(AboveZero());
  AddFlag(backup, &a);
  RegisterList(app, exit_code);
  CLI::App* restore = RegisterOne(app, "restore", "Make a database of a backup; checks every file",
                                  Restore, exit_code, arguments);
  AddPlace(restore, "DIR", &a.folder, "Folder of backups");
  AddPlace(restore, "DB", &a.db, "Database to make, where nothing is yet");
  restore->add_option("--backup", a.number, "Its number, as `backups list` has it (the newest)")
      ->check(AboveZero());
  AddFlag(restore, &a);
  CLI::App* copy =
      RegisterOne(app, "copy", "A consistent copy that opens on its own, linked where possible",
                  Copy, exit_code, arguments);
  AddPlace(copy, "DB", &a.db, "Database");
  AddPlace(copy, "OUT", &a.folder, "Folder to make");
}

}  // namespace veduta
