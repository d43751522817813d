// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is withheld from whom, and what people complain of.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/model/moderation.h"
#include "storage/model/token.h"

namespace veduta {

// How much of the photos whoever asks may see. What is not for them is in no answer, and asked by
// its name it is kNotFound; what the map holds by it (points, surfaces, counts) is told to all.
struct Sight {
  bool sees_hidden = true;  // photos and contributions that a curator has hidden
  // Only photos of this contribution (0: any), or only those that have a pose in this
  // reconstruction, or in the one that it was merged into.
  uint32_t contribution = 0;
  ReconstructionId reconstruction = {};
};

struct HideRequest {
  std::vector<std::string> photos;  // each by what Questions::Image finds it by; or
  uint32_t contribution = 0;        // with all of its photos, also those to come; 0: none
  std::string actor = "anonymous";  // who does it, for the journal
  std::string reason;  // for curators; UTF-8, at most 2000 bytes, no control characters but lines

  Status Check() const;  // the first violated bound, named with its value
};

struct HiddenAnswer {
  HiddenKind kind = HiddenKind::kImage;
  uint32_t number = 0;  // of the image or the contribution
  std::string name;     // of the image; empty where it was removed since, and of a contribution
  int64_t time_unix_s = 0;
  std::string actor, reason;
};

// Open reports that the city keeps, at most. Chosen by hand: more than people read.
inline constexpr size_t kOpenReportsMax = 10'000;

struct ReportRequest {
  std::string photo;  // by what Questions::Image finds it by
  ReportReason reason = ReportReason::kOther;
  std::string text;      // for curators; as HideRequest::reason
  std::string reporter;  // who reports it

  Status Check() const;  // the first violated bound, named with its value
};

struct ReportAnswer {
  uint32_t number = 0;  // from 1, in the order in which they came
  ImageId image;
  std::string name;  // of the image; empty where it was removed since
  ReportReason reason = ReportReason::kOther;
  std::string text, reporter;
  int64_t time_unix_s = 0;
  ReportState state = ReportState::kOpen;
  std::string resolver;
  int64_t resolved_unix_s = 0;  // 0 while it is open
};

// "privacy", "copyright", "offensive", "wrong", "other".
std::string ReportReasonWord(ReportReason reason);
// kInvalidArgument lists the five.
Result<ReportReason> ParseReportReason(const std::string& word);
// "open", "dismissed", "hidden", "erased".
std::string ReportStateWord(ReportState state);

}  // namespace veduta
