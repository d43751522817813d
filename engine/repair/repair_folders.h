// SPDX-License-Identifier: Apache-2.0
#pragma once
// The folders and files of a repair, all beside the database so that renaming moves them.
//
//   DB.repairing-source  links to the damaged files, to read from; may be deleted at any time
//   DB.repairing         the new database while it is written; may be deleted at any time
//   DB.repaired          the new database, complete and checked
//   DB.repaired-for      a text file that says which folder DB.repaired is to replace
//   DB.damaged-N         the damaged database, from then on; N is the first that is free
//   DB.damaged-N.txt     the report
//   DB.damaged-N.photos  photos that the user has to add again
//
// The switch renames DB.repairing to DB.repaired, exchanges DB.repaired with DB in one step, and
// renames what is DB.repaired now, the damaged database, to DB.damaged-N. Where the file system
// cannot exchange two folders, it renames DB to DB.damaged-N and then DB.repaired to DB, and a kill
// in between leaves no DB. The next repair does the last step in either case.

#include <string>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

struct RepairFolders {
  std::string database, source, repairing, repaired, repaired_for;
  std::string kept, report, photos;
};

// Beside the folder that `path` leads to: "." and links are followed. Looks for the N that is free.
RepairFolders RepairFoldersFor(const std::string& path);

// Whether the folder has any file that a database has and other folders have not.
bool HasFilesOfDatabase(const std::string& folder);
// kInvalidArgument where the database's folder is one that cannot be renamed, since a file system
// is mounted there.
Status CheckCanBeRenamed(const RepairFolders& folders);

// Where an earlier switch was cut short.
enum class SwitchState {
  kNone,       // nothing of a switch is there, or nothing had been moved yet
  kMovedAway,  // there is no database, and the new one is complete
  kExchanged,  // the new database is in its place, and the damaged one is not yet in its own
  kReplaced,   // there is a complete new database for another database than the one that is there
};
SwitchState FindSwitch(const RepairFolders& folders);

// Puts the new database, which is complete at `repairing`, at `repaired`.
Status CompleteSwitch(const RepairFolders& folders);
// Moves the new database to its place and the damaged one away, except for the last step, which
// FinishSwitch does. `may_exchange` is false in tests of file systems that cannot exchange folders.
Status BeginSwitch(const RepairFolders& folders, bool may_exchange = true);
// The last step of a switch: kMovedAway and kExchanged.
Status FinishSwitch(const RepairFolders& folders);
// Deletes what an earlier repair left unfinished, or this one needs no more. kAlreadyExists where
// the switch is kReplaced: nothing is deleted.
Status DeleteLeftovers(const RepairFolders& folders);

// kIoError where the disk has less room than the database takes.
Status CheckRoom(const RepairFolders& folders);

// Makes the folders that lead to the file. Never writes outside of `folder`, whatever the name.
// Where something else lies there already, the file's name begins with `prefix` and lies directly
// in `folder`; two files with one prefix must have the same bytes.
Status WriteFileInside(const std::string& folder, const std::string& name,
                       const std::string& prefix, const std::vector<uint8_t>& bytes);
Status WriteTextDurably(const std::string& path, const std::string& text);

}  // namespace veduta
