// SPDX-License-Identifier: Apache-2.0
#pragma once
// Who may ask the daemon, and what for.

#include <array>
#include <cstdint>
#include <string>

namespace veduta {

// What a token is good for; each may also do what those before it may. Values are stored: append
// only, never renumber.
enum class Role : uint8_t {
  kViewer = 1,       // asks
  kContributor = 2,  // sends photos, too
  kCurator = 3,      // takes out, forbids, adds cameras and surveyed points, rules the dense pass
  kAdmin = 4,        // makes and revokes tokens
};

// How much may be done with a token; 0: as much as the daemon gives to each.
struct TokenQuota {
  uint32_t photos_per_day = 0;
  uint64_t bytes_per_day = 0;  // of the photos
  uint32_t requests_per_s = 0;
};

// Of the token itself only a hash is stored.
struct TokenRecord {
  uint32_t number = 0;  // from 1; never used again
  std::string name;     // whose it is, for the journal; not empty
  Role role = Role::kViewer;
  std::array<uint8_t, 32> hash{};  // BLAKE2b-256 of its secret
  int64_t created_unix_s = 0;
  int64_t expires_unix_s = 0;  // 0: never
  int64_t revoked_unix_s = 0;  // 0: it was not
  TokenQuota quota;
  bool is_link = false;  // a link for reading is made of it: a viewer's, and it expires
  // A link that shows no more than this contribution, or this reconstruction: one of them at most;
  // 0: all of the city.
  uint32_t contribution = 0, reconstruction = 0;
};

// What a token has used up of its quotas at that time; it fills again as time goes.
struct TokenUse {
  uint32_t token = 0;  // its number; 0: all who ask without one
  int64_t time_unix_ms = 0;
  double photos = 0, bytes = 0, reports = 0, contributions = 0;  // finite, 0 or more
};

}  // namespace veduta
