// SPDX-License-Identifier: Apache-2.0
#pragma once
// A model in memory of what the database must hold: every key and value of every family, computed
// apart from the database, and random transactions that change both.

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "storage/base/content_hash.h"
#include "storage/database.h"

namespace veduta {

using RecordKey = std::pair<Family, std::string>;
using Records = std::map<RecordKey, std::string>;

// All that is stored. What cannot be read comes as the first failure, after all the rest was read.
Status ReadAll(const Snapshot& snapshot, Records* records);

// For a message: the first records that differ; empty where none does.
std::string DifferenceOf(const Records& expected, const Records& stored);

struct ModeledCity {
  Records records;
  DatabaseState state;
  uint32_t points_generation = 0;  // of the one reconstruction
  std::map<WordId, std::set<ImageId>> postings;
  uint32_t next_bytes = 1;  // of a photo that was never written before

  static ModeledCity New();  // what `init` makes
};

// Random actions, each done to a transaction and to the model. An action that fails leaves the
// transaction to be given up.
class ModeledTransaction final {
 public:
  ModeledTransaction(Database* database, const ModeledCity& before, SeededRandom* random);
  ~ModeledTransaction();

  // Some actions; what the database holds after Commit is `after`, or as before.
  Status Run();
  Status Commit();
  const ModeledCity& after() const;

 private:
  class Actions;
  const std::unique_ptr<Actions> actions_;
};

}  // namespace veduta
