// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/backup_json.h"

namespace veduta {

Json ToJson(const BackupAnswer& backup) {
  return {{"backup", backup.number},
          {"time", backup.time_unix_s},
          {"database", backup.database},
          {"files", backup.files},
          {"bytes", backup.bytes}};
}

Json ToJson(const BackupReport& report) {
  Json json = ToJson(report.backup);
  json["copied_files"] = report.copied_files;
  json["copied_bytes"] = report.copied_bytes;
  json["deleted"] = report.deleted;
  return json;
}

Json ToJson(const BackupList& list) {
  return {{"backups", ToJson(list.backups)}, {"damage", list.damage}};
}

}  // namespace veduta
