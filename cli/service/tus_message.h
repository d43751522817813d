// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the tus protocol 1.0.0 (https://tus.io/protocols/resumable-upload) writes into headers. All
// of it comes from strangers.

#include <cstdint>
#include <map>
#include <span>
#include <string>

#include "cli/service/http_message.h"
#include "storage/base/status.h"

namespace veduta {

inline constexpr const char* kTusVersion = "1.0.0";
inline constexpr const char* kTusExtensions =
    "creation,creation-with-upload,expiration,checksum,termination";
inline constexpr const char* kTusChecksums = "sha1,sha256";
// Of the bodies that carry parts of a photo.
inline constexpr const char* kTusContentType = "application/offset+octet-stream";

// Upload-Metadata: pairs of a key and a value in Base64, with commas between. kInvalidArgument says
// which pair is wrong, or that there are too many.
Result<std::map<std::string, std::string>> ParseTusMetadata(const std::string& header);

// Upload-Checksum: the name of an algorithm and the sum in Base64. Whether the bytes have it;
// kInvalidArgument where the header is wrong, or names another algorithm than kTusChecksums.
Result<bool> HasTusChecksum(const std::string& header, std::span<const uint8_t> bytes);

// A time as RFC 9110 writes it: "Sun, 06 Nov 1994 08:49:37 GMT".
std::string HttpDate(int64_t time_unix_s);

// Whether this is a body that is to be handed over as it comes, one part after the other: then a
// connection that breaks costs what has not come yet, and nothing else.
bool ComesInParts(const HttpRequest& request);
// Whether this is a request of the protocol.
bool IsTus(const HttpRequest& request);

}  // namespace veduta
