// SPDX-License-Identifier: Apache-2.0
#include "cli/command.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace veduta {

int ExitCodeOf(const Status& status) {
  switch (status.code()) {
    case StatusCode::kOk:
      return kDone;
    case StatusCode::kBusy:
    case StatusCode::kCorruption:
      return kDatabaseUnusable;
    default:
      return kNotDone;
  }
}

int Fail(const Status& status) {
  std::fprintf(stderr, "veduta: %s\n", Printable(status.message()).c_str());
  return ExitCodeOf(status);
}

int FailUsage(const Status& status) {
  Fail(status);
  return kBadUsage;
}

Result<std::vector<ListedPhoto>> ListPhotosAndWarn(const std::vector<std::string>& paths) {
  std::vector<std::string> passed_over;
  auto photos = ListPhotos(paths, &passed_over);
  for (const std::string& text : passed_over)
    std::fprintf(stderr, "veduta: warning: %s\n", Printable(text).c_str());
  return photos;
}

Result<std::vector<ListedPhoto>> ListPhotosOf(const std::string& list,
                                              const std::vector<std::string>& paths) {
  if (list.empty()) return ListPhotosAndWarn(paths);
  return ReadPhotoList(list, paths.empty() ? "" : paths.front());
}

void CheckPhotoArguments(const std::string& list, const std::vector<std::string>& paths) {
  if (paths.empty() && list.empty()) throw CLI::RequiredError("PHOTO or --list");
  if (paths.size() > 1 && !list.empty()) {
    throw CLI::ValidationError("--list",
                               "takes one folder at most, the one that its paths are relative to");
  }
}

CLI::Validator SizeInBytes() {
  return {[size = CLI::AsSizeValue(/*kb_is_1000=*/false)](std::string& text) -> std::string {
            if (text.find('-') != std::string::npos) return "'" + text + "' is no size in bytes";
            return size(text);
          },
          "BYTES"};
}

CLI::Validator AboveZero() {
  return {[](std::string& text) -> std::string {
            double number = 0;
            const char* const last = text.data() + text.size();
            const auto [end, error] = std::from_chars(text.data(), last, number);
            const bool is_number = error == std::errc() && end == last && std::isfinite(number);
            if (is_number && number > 0) return "";
            return "'" + text + "' is no number above 0";
          },
          "ABOVE 0"};
}

std::string CheckCameraName(const std::string& name) {
  return name.empty() ? "is empty: leave the option out for an unknown camera" : "";
}

Result<std::unique_ptr<Engine>> OpenToRead(const std::string& path, uint32_t thread_count) {
  EngineOptions options;
  options.thread_count = thread_count;
  options.read_only = true;
  return Engine::Open(path, options);
}

Result<std::unique_ptr<Engine>> OpenToWrite(const std::string& path, const EngineOptions& options) {
  return Engine::Open(path, options);
}

std::string ProgramCacheFolder() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache)
    return std::string(cache) + "/veduta";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::string(home) + "/.cache/veduta";
  return "";
}

}  // namespace veduta
