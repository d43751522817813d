// SPDX-License-Identifier: Apache-2.0
#include "storage/base/content_hash.h"

#include <openssl/evp.h>

#include <cstring>

#include "storage/base/status.h"

namespace veduta {

std::string ContentHash::Hex() const {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  text.reserve(bytes.size() * 2);
  for (const uint8_t byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

uint64_t ContentHash::Seed() const {
  uint64_t seed = 0;
  for (int i = 0; i < 8; ++i) seed = seed << 8 | bytes[i];
  return seed;
}

ContentHasher::ContentHasher() : context_(EVP_MD_CTX_new()) {
  VEDUTA_CHECK(context_ != nullptr && EVP_DigestInit_ex(static_cast<EVP_MD_CTX*>(context_),
                                                        EVP_sha256(), nullptr) == 1,
               "OpenSSL offers no SHA-256");
}

ContentHasher::~ContentHasher() {
  EVP_MD_CTX_free(static_cast<EVP_MD_CTX*>(context_));
}

void ContentHasher::Add(std::span<const uint8_t> bytes) {
  VEDUTA_CHECK(
      EVP_DigestUpdate(static_cast<EVP_MD_CTX*>(context_), bytes.data(), bytes.size()) == 1,
      "SHA-256 update");
}

void ContentHasher::Add(std::string_view text) {
  Add(std::span(reinterpret_cast<const uint8_t*>(text.data()), text.size()));
}

ContentHash ContentHasher::Finish() {
  ContentHash hash;
  unsigned length = 0;
  VEDUTA_CHECK(
      EVP_DigestFinal_ex(static_cast<EVP_MD_CTX*>(context_), hash.bytes.data(), &length) == 1 &&
          length == 32,
      "SHA-256 length " + std::to_string(length));
  return hash;
}

ContentHash HashContent(std::span<const uint8_t> content) {
  ContentHasher hasher;
  hasher.Add(content);
  return hasher.Finish();
}

}  // namespace veduta
