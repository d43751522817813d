// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that arrive in parts, by the tus protocol 1.0.0 with the extensions creation,
// creation-with-upload, expiration, checksum and termination.

#include <cstdint>
#include <functional>
#include <shared_mutex>
#include <utility>

#include "cli/service/http_message.h"
#include "cli/service/photo_intake.h"
#include "cli/service/quotas.h"
#include "engine/engine.h"

namespace veduta {

struct TusOptions {
  PartialUploadLimits limits;
  // The largest photo, 1 to 2^40; all of it is in memory when its last part comes.
  uint64_t length_bytes_max = 128ull << 20;
  // So long after its last byte an upload is given up; one that has arrived is forgotten.
  // 1 to 31,536,000 s. Chosen by hand: a day, for phones that come home.
  uint32_t keep_s = 24 * 60 * 60;

  Status Check() const;  // the first violated bound, named with its value
};

// Thread-safe. An upload is there for the token alone that has begun it; other tokens are told that
// there is none.
class TusUploads final {
 public:
  // Both must outlive it. `write_failed` hears why something was not stored, from any thread.
  TusUploads(const TusOptions& options, PhotoIntake* intake, Quotas* quotas,
             std::function<void(const Status&)> write_failed = {})
      : options_(options),
        intake_(*intake),
        quotas_(*quotas),
        write_failed_(std::move(write_failed)) {}

  // The answer to any request of the protocol that is let in. A part that is answered by 204, and a
  // photo by 201, are on the disk.
  HttpAnswer Answer(Engine* engine, const HttpRequest& request);
  // Gives up what has expired. Nothing is given back to quotas: they have filled since, or will in
  // what is left of a day.
  Status Expire(Engine* engine) const;

 private:
  HttpAnswer Begin(Engine* engine, const HttpRequest& request);
  Result<PartialUploadRequest> RequestOf(const Engine& engine, const HttpRequest& request) const;
  HttpAnswer Continue(Engine* engine, const HttpRequest& request);
  HttpAnswer GiveUp(Engine* engine, const HttpRequest& request);
  HttpAnswer NotStored(const Status& status) const;
  // What is known of the upload that the request is about, or the answer where it has none.
  Result<PartialUploadAnswer> Find(const Engine& engine, const HttpRequest& request,
                                   HttpAnswer* refusal) const;
  HttpAnswer Options() const;
  // Where the upload is, and until when it is kept.
  void AddHeaders(const PartialUploadAnswer& upload, HttpAnswer* answer) const;

  const TusOptions options_;
  PhotoIntake& intake_;
  Quotas& quotas_;
  const std::function<void(const Status&)> write_failed_;
  // Held by who gives an upload up, alone, so that its last byte does not come meanwhile; shared by
  // those that go on.
  std::shared_mutex giving_up_mutex_;
};

}  // namespace veduta
