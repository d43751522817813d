// SPDX-License-Identifier: Apache-2.0
#pragma once
// The folders and files of a repair, all beside the database so that renaming moves them.
//
//   DB.repairing-source  links to the damaged files, to read from; may be deleted at any time
//   DB.repairing         the new database while it is written; may be deleted at any time
//   DB.repaired          the new database, complete and checked
//   DB.damaged-N         the damaged database, from then on; N is the first that is free
//   DB.damaged-N.txt     the report
//   DB.damaged-N.photos  photos that the user has to add again
//
// The switch renames DB.repairing to DB.repaired, DB to DB.damaged-N, DB.repaired to DB. A kill in
// between leaves no DB but a DB.repaired: the next repair does the last step.

#include <string>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

struct RepairFolders {
  std::string database, source, repairing, repaired;
  std::string kept, report, photos;
};

// `path` may end with a slash. Looks for the N that is free.
RepairFolders RepairFoldersFor(const std::string& path);

// The last step of a switch that was killed is still to be done.
bool IsSwitchUnfinished(const RepairFolders& folders);
Status FinishSwitch(const RepairFolders& folders);
// Deletes what an earlier repair left unfinished, or this one needs no more.
Status DeleteLeftovers(const RepairFolders& folders);

// kIoError where the disk has less room than the database takes.
Status CheckRoom(const RepairFolders& folders);

Status RenameDurably(const std::string& from, const std::string& to);
// Makes the folders that lead to the file. Never writes outside of `folder`, whatever the name.
Status WriteFileInside(const std::string& folder, const std::string& name,
                       const std::vector<uint8_t>& bytes);
Status WriteTextDurably(const std::string& path, const std::string& text);

}  // namespace veduta
