// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos whose bytes come by RPC: to be added, and to be asked about.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cli/rpc/caller.h"
#include "cli/rpc/veduta.capnp.h"

namespace veduta {

// The bytes of a photo as they come, within the limits of the schema. On one thread.
class ArrivingPhoto final {
 public:
  explicit ArrivingPhoto(const Caller& caller);

  // Throws 413 and 429 where the chunk is too much, 408 once the photo has taken too long, and 409
  // after Take.
  void Append(kj::ArrayPtr<const uint8_t> chunk);
  // The whole photo, which counts in the budget as long as it is held. Throws 400 where it is
  // empty, and as Append does.
  struct Whole {
    std::vector<uint8_t> bytes;
    std::shared_ptr<DividedShare> share;
  };
  Whole Take();

 private:
  void CheckOpen() const;

  const std::shared_ptr<BudgetShare> thing_;  // it is one of the session's
  Whole whole_;
  bool is_taken_ = false, is_late_ = false;
  kj::Promise<void> deadline_;
};

// What is known of a photo before its bytes.
struct PhotoTitle {
  std::string name, camera, contributor;
  uint32_t contribution = 0;  // that it is a part of; 0: of none
};

class UploadServer final : public rpc::Upload::Server {
 public:
  UploadServer(Caller caller, PhotoTitle title)
      : caller_(std::move(caller)), title_(std::move(title)), photo_(caller_) {}

  kj::Promise<void> write(WriteContext context) override;
  kj::Promise<void> done(DoneContext context) override;

 private:
  kj::Promise<void> Store(DoneContext context, HttpRequest sender,
                          const std::shared_ptr<PhotoSubmission>& photo,
                          const std::shared_ptr<DividedShare>& share);

  const Caller caller_;
  const PhotoTitle title_;
  ArrivingPhoto photo_;
};

class ExaminationServer final : public rpc::Examination::Server {
 public:
  ExaminationServer(Caller caller, std::string name)
      : caller_(std::move(caller)), name_(std::move(name)), photo_(caller_) {}

  kj::Promise<void> write(WriteContext context) override;
  kj::Promise<void> localize(LocalizeContext context) override;
  kj::Promise<void> candidates(CandidatesContext context) override;

 private:
  // What makes a copy of the photo for a question, on the thread that answers it. The photo is held
  // for a while from then on, in case of another question. Throws 408 once that has passed.
  std::function<PhotoSource()> Photo();

  const Caller caller_;
  const std::string name_;
  ArrivingPhoto photo_;
  std::shared_ptr<const ArrivingPhoto::Whole> whole_;  // once something was asked
  bool was_dropped_ = false;                           // it rested too long
  kj::Promise<void> rest_ = kj::READY_NOW;
};

}  // namespace veduta
