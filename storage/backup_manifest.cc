// SPDX-License-Identifier: Apache-2.0
#include "storage/backup_manifest.h"

#include <algorithm>
#include <charconv>
#include <optional>

#include "storage/base/plain_text.h"

namespace veduta {
namespace {

constexpr std::string_view kTitle = "veduta backup 1";
// A line that ends the manifest: "end " and a hash.
constexpr size_t kEndBytes = 4 + 64 + 1;
constexpr size_t kNameBytesMax = 255;

bool IsFileName(std::string_view name) {
  return !name.empty() && name.size() <= kNameBytesMax && name.front() != '.' &&
         std::ranges::all_of(name, [](unsigned char c) {
           return std::isalnum(c) || c == '.' || c == '-' || c == '_';
         });
}

// Takes the text up to the separator off the front; nothing where there is none.
std::optional<std::string_view> Take(std::string_view* text, char separator) {
  const size_t end = text->find(separator);
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view taken = text->substr(0, end);
  text->remove_prefix(end + 1);
  return taken;
}

template <typename Number>
bool Parse(const std::optional<std::string_view>& text, Number* number) {
  if (!text) return false;
  const auto [rest, error] = std::from_chars(text->data(), text->data() + text->size(), *number);
  return error == std::errc() && rest == text->data() + text->size();
}

bool ParseHash(const std::optional<std::string_view>& text, ContentHash* hash) {
  if (!text || text->size() != 2 * hash->bytes.size()) return false;
  for (size_t i = 0; i < hash->bytes.size(); ++i) {
    const char* const digits = text->data() + 2 * i;
    if (std::from_chars(digits, digits + 2, hash->bytes[i], 16).ptr != digits + 2) return false;
  }
  return hash->Hex() == *text;
}

// "SHA-256 size inode modified name".
bool ParseFile(std::string_view line, BackedUpFile* file) {
  if (!ParseHash(Take(&line, ' '), &file->hash)) return false;
  if (!Parse(Take(&line, ' '), &file->size_bytes)) return false;
  if (!Parse(Take(&line, ' '), &file->inode)) return false;
  if (!Parse(Take(&line, ' '), &file->modified_ns)) return false;
  file->name = line;
  return IsFileName(line);
}

std::string HashOf(std::string_view text) {
  ContentHasher hasher;
  hasher.Add(text);
  return hasher.Finish().Hex();
}

}  // namespace

uint64_t BackupManifest::SizeBytes() const {
  uint64_t bytes = 0;
  for (const BackedUpFile& file : files) bytes += file.size_bytes;
  return bytes;
}

std::string ManifestText(const BackupManifest& manifest) {
  std::string text = std::string(kTitle) + "\nnumber " + std::to_string(manifest.number) +
                     "\ntime " + std::to_string(manifest.time_unix_s) + "\nof " +
                     manifest.database + "\n";
  for (const BackedUpFile& file : manifest.files) {
    text += file.hash.Hex() + " " + std::to_string(file.size_bytes) + " " +
            std::to_string(file.inode) + " " + std::to_string(file.modified_ns) + " " + file.name +
            "\n";
  }
  return text + "end " + HashOf(text) + "\n";
}

Result<BackupManifest> ParseManifest(std::string_view text) {
  const Status failure = Status::Corruption("it is not what was written");
  if (text.size() < kEndBytes) return failure;
  std::string_view head = text.substr(0, text.size() - kEndBytes);
  if (text.substr(head.size()) != "end " + HashOf(head) + "\n") return failure;
  BackupManifest manifest;
  const auto value = [&](std::string_view key) -> std::optional<std::string_view> {
    if (Take(&head, ' ') != key) return std::nullopt;
    return Take(&head, '\n');
  };
  if (Take(&head, '\n') != kTitle)
    return Status::Corruption("another version of the program has written it");
  if (!Parse(value("number"), &manifest.number) || manifest.number == 0) return failure;
  if (!Parse(value("time"), &manifest.time_unix_s)) return failure;
  const auto database = value("of");
  if (!database || !IsPlainText(*database, /*may_have_lines=*/false)) return failure;
  manifest.database = *database;
  while (!head.empty()) {
    const auto line = Take(&head, '\n');
    BackedUpFile file;
    if (!line || !ParseFile(*line, &file)) return failure;
    if (!manifest.files.empty() && file.name <= manifest.files.back().name) return failure;
    manifest.files.push_back(std::move(file));
  }
  return manifest;
}

}  // namespace veduta
