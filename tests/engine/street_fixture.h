// SPDX-License-Identifier: Apache-2.0
#pragma once
// An engine over a database of its own, and photos of one synthetic street to add to it.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "engine/engine.h"
#include "engine/parts.h"
#include "engine/query/digest.h"
#include "engine/query/find_image.h"
#include "engine/query/invariants.h"
#include "engine/query/verdict_text.h"
#include "tests/engine/pose_errors.h"
#include "tests/engine/street_photos.h"

namespace veduta {

// Every option that a test may want to set.
struct CityOptions {
  uint32_t thread_count = 0;
  DatabaseOptions database;
  PrepareOptions prepare;
  IngestOptions ingest;
  uint64_t undistort_cache_bytes = 256ull << 20;
  bool settle_each = false;
};

// Questions of the door, with the snapshot behind them.
class CityQuestions {
 public:
  explicit CityQuestions(Questions questions) : questions_(std::move(questions)) {}

  const Snapshot& snapshot() const { return *EngineParts::SnapshotOf(questions_); }
  Questions& door() { return questions_; }
  Result<StatusAnswer> Status() const { return questions_.Status(); }
  Result<ImageRecord> FindImage(const std::string& name) const {
    return veduta::FindImage(snapshot(), name);
  }
  Result<std::vector<PairNeighbor>> Neighbors(ImageId image) const {
    return snapshot().ListNeighbors(image);
  }
  Result<std::optional<PoseRecord>> Pose(ImageId image) const { return snapshot().FindPose(image); }

 private:
  Questions questions_;
};

// A database in a folder of its own.
class City {
 public:
  explicit City(CityOptions options = Options(2)) : options_(std::move(options)) {
    options_.database.create = true;
    Open();
    options_.database.create = false;
    if (engine_ != nullptr) {
      EXPECT_OK(engine_->AddCamera("street", StreetCameraModel(), "the truth"));
    }
  }

  static CityOptions Options(uint32_t thread_count) {
    CityOptions options;
    options.thread_count = thread_count;
    options.database.block_cache_bytes = 16 << 20;
    options.database.sync_wal = false;  // what is tested needs no disk to be slow
    return options;
  }

  Engine& engine() { return *engine_; }
  EngineParts& parts() const { return EngineParts::Of(*engine_); }
  const CityOptions& options() const { return options_; }
  CityQuestions Ask() const { return CityQuestions(engine_->Ask()); }
  std::string path() const { return folder_ / "db"; }

  void Close() { engine_.reset(); }
  void Open() {
    Close();
    EngineOptions engine;
    engine.create = options_.database.create;
    engine.read_only = options_.database.read_only;
    engine.sync = options_.database.sync_wal;
    engine.settle_each = options_.settle_each;
    engine.thread_count = options_.thread_count;
    engine.block_cache_bytes = options_.database.block_cache_bytes;
    engine.feature_cache_bytes = options_.ingest.feature_cache_bytes;
    engine.undistort_cache_bytes = options_.undistort_cache_bytes;
    auto opened = EngineParts::Open(
        path(), engine, {options_.database, options_.prepare, options_.ingest, nullptr});
    EXPECT_OK(opened);
    if (opened.ok()) engine_ = std::move(*opened);
  }
  void Reopen() { Open(); }
  void Reopen(const IngestOptions& ingest) {
    options_.ingest = ingest;
    Open();
  }

  PhotoSubmission Submit(const std::string& name, std::vector<uint8_t> bytes) {
    return {{name, name, std::move(bytes)}, "street", "anna"};
  }
  PhotoSubmission Submit(const Stand& stand) {
    const TakenPhoto& photo = TakePhoto(stand);
    return Submit(photo.name, photo.jpeg);
  }

  // The status of the photos, or else the first failure of a step that followed from them.
  Status TryAdd(const std::vector<PhotoSubmission>& photos, std::vector<AddOutcome>* outcomes) {
    Status followed;
    const Status added = engine_->AddPhotos(
        photos, [&](const AddOutcome& outcome) { outcomes->push_back(outcome); }, {},
        [&](const FollowUp& step) {
          if (followed.ok()) followed = step.status;
        });
    return added.ok() ? followed : added;
  }
  std::vector<AddOutcome> Add(const std::vector<PhotoSubmission>& photos) {
    std::vector<AddOutcome> outcomes;
    EXPECT_OK(TryAdd(photos, &outcomes));
    EXPECT_EQ(outcomes.size(), photos.size());
    outcomes.resize(photos.size());
    return outcomes;
  }
  std::vector<AddOutcome> Add(const std::vector<Stand>& stands) {
    std::vector<PhotoSubmission> photos;
    for (const Stand& stand : stands) photos.push_back(Submit(stand));
    return Add(photos);
  }
  AddOutcome AddOne(const std::string& name, std::vector<uint8_t> bytes) {
    return Add({Submit(name, std::move(bytes))}).front();
  }

  std::string Digest() const {
    const auto digest = DigestOf(Ask().snapshot());
    EXPECT_OK(digest);
    return digest.ok() ? digest->Hex() : "";
  }
  StatusAnswer Counts() const {
    auto status = Ask().Status();
    EXPECT_OK(status);
    return status.ok() ? *status : StatusAnswer();
  }

 private:
  TemporaryFolder folder_;
  CityOptions options_;
  std::unique_ptr<Engine> engine_;
};

// For a message: what became of each photo.
inline std::string Told(const std::vector<AddOutcome>& outcomes) {
  std::string text;
  for (const AddOutcome& o : outcomes) {
    text += std::string(o.duplicate ? "duplicate" : VerdictText(o.verdict)) + " " + o.name + ": " +
            ReasonText(o.reason) + ": " + o.detail + "\n";
  }
  return text;
}

inline ::testing::AssertionResult IsSound(const Snapshot& snapshot) {
  const auto violations = FindViolations(snapshot, 20);
  if (!violations.ok()) return ::testing::AssertionFailure() << violations.status().message();
  if (violations->empty()) return ::testing::AssertionSuccess();
  ::testing::AssertionResult failure = ::testing::AssertionFailure();
  for (const std::string& violation : *violations) failure << violation << "\n";
  return failure;
}

}  // namespace veduta
