// SPDX-License-Identifier: Apache-2.0
#pragma once
// What people withhold from others, and what they complain of.

#include <cstdint>
#include <string>

#include "storage/base/ids.h"

namespace veduta {

// Values are stored: append only, never renumber.
enum class HiddenKind : uint8_t {
  kImage = 1,
  kContribution = 2,  // all images that came with it, also those that are still to come
};

// A fact that a curator states: the picture, the name and the contributor are told to curators
// alone. The image keeps its place in the map.
struct HiddenRecord {
  HiddenKind kind = HiddenKind::kImage;
  uint32_t number = 0;  // of the image or the contribution
  int64_t time_unix_s = 0;
  std::string actor, reason;
};

// Why somebody reports a photo. Values are stored: append only, never renumber.
enum class ReportReason : uint8_t {
  kPrivacy = 1,    // it shows people, number plates or a home
  kCopyright = 2,  // it is somebody else's work
  kOffensive = 3,  // it must not be shown, for decency or by law
  kWrong = 4,      // it is of another place, or no photo of a city
  kOther = 5,
};

// What has become of a report. Values are stored: append only, never renumber.
enum class ReportState : uint8_t {
  kOpen = 1,
  kDismissed = 2,
  kHidden = 3,  // the photo was
  kErased = 4,  // the photo was removed
};

struct ReportRecord {
  uint32_t number = 0;  // from 1, in the order in which they came
  ImageId image;        // which nothing has any more once it was removed
  ReportReason reason = ReportReason::kOther;
  std::string text;      // what the reporter wrote; goes with the photo
  std::string reporter;  // by the name of the token
  int64_t time_unix_s = 0;
  ReportState state = ReportState::kOpen;
  std::string resolver;         // who has dismissed it, hidden or removed the photo
  int64_t resolved_unix_s = 0;  // 0 while it is open
};

}  // namespace veduta
