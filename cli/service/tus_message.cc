// SPDX-License-Identifier: Apache-2.0
#include "cli/service/tus_message.h"

#include <openssl/evp.h>
#include <sodium.h>

#include <algorithm>
#include <cstring>
#include <ctime>
#include <optional>
#include <vector>

namespace veduta {
namespace {

// Chosen by hand: names of files have at most 255 bytes, and there are few keys that mean anything.
constexpr size_t kMetadataBytesMax = 4096, kPairsMax = 32;

// Nothing where the text is no Base64 (RFC 4648, with padding).
std::optional<std::string> FromBase64(const std::string& text) {
  std::string bytes(text.size(), '\0');
  size_t size = 0;
  if (sodium_base642bin(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), text.data(),
                        text.size(), nullptr, &size, nullptr, sodium_base64_VARIANT_ORIGINAL) != 0)
    return std::nullopt;
  bytes.resize(size);
  return bytes;
}

bool IsKey(const std::string& key) {
  return !key.empty() && std::ranges::all_of(key, [](char c) { return c > ' ' && c <= '~'; });
}

}  // namespace

Result<std::map<std::string, std::string>> ParseTusMetadata(const std::string& header) {
  std::map<std::string, std::string> metadata;
  if (header.size() > kMetadataBytesMax)
    return Status::InvalidArgument("Upload-Metadata has " + std::to_string(header.size()) +
                                   " bytes, but must have at most " +
                                   std::to_string(kMetadataBytesMax));
  for (size_t begin = 0; begin < header.size();) {
    const size_t end = std::min(header.find(',', begin), header.size());
    std::string pair = header.substr(begin, end - begin);
    begin = end + 1;
    while (pair.starts_with(' ')) pair.erase(0, 1);
    while (pair.ends_with(' ')) pair.pop_back();
    const size_t space = std::min(pair.find(' '), pair.size());
    const std::string key = pair.substr(0, space);
    const auto value = FromBase64(space < pair.size() ? pair.substr(space + 1) : "");
    if (!IsKey(key) || !value)
      return Status::InvalidArgument(
          "Upload-Metadata has a pair that is no key and a value in "
          "Base64: '" +
          pair + "'");
    if (metadata.size() == kPairsMax)
      return Status::InvalidArgument("Upload-Metadata has more than " + std::to_string(kPairsMax) +
                                     " pairs");
    if (!metadata.emplace(key, *value).second)
      return Status::InvalidArgument("Upload-Metadata has the key '" + key + "' twice");
  }
  return metadata;
}

Result<bool> HasTusChecksum(const std::string& header, std::span<const uint8_t> bytes) {
  const size_t space = std::min(header.find(' '), header.size());
  const std::string algorithm = header.substr(0, space);
  const EVP_MD* const method = algorithm == "sha1"     ? EVP_sha1()
                               : algorithm == "sha256" ? EVP_sha256()
                                                       : nullptr;
  const auto sum = FromBase64(space < header.size() ? header.substr(space + 1) : "");
  if (method == nullptr || !sum || sum->size() != static_cast<size_t>(EVP_MD_get_size(method)))
    return Status::InvalidArgument("Upload-Checksum is '" + header + "', and must be one of " +
                                   kTusChecksums + ", a space, and the sum in Base64");
  unsigned char hash[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), hash, &size, method, nullptr) != 1)
    return Status::NoMemory("the checksum cannot be computed");
  return std::memcmp(hash, sum->data(), size) == 0;
}

std::string HttpDate(int64_t time_unix_s) {
  const std::time_t time = time_unix_s;
  std::tm parts{};
  char text[64];
  // In the locale "C", which the program never leaves.
  if (gmtime_r(&time, &parts) == nullptr ||
      std::strftime(text, sizeof(text), "%a, %d %b %Y %H:%M:%S GMT", &parts) == 0)
    return "";
  return text;
}

bool ComesInParts(const HttpRequest& request) {
  return IsTus(request) && request.method == "PATCH" &&
         !request.headers.contains("Upload-Checksum");
}

bool IsTus(const HttpRequest& request) {
  return request.path.size() >= 2 && request.path[0] == "v1" && request.path[1] == "tus";
}

}  // namespace veduta
