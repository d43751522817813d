// SPDX-License-Identifier: Apache-2.0
// Fills a database with synthetic photos, and tells what was written for each, by RocksDB's own
// counters; then what opening it as a killed process has left it takes.
//   veduta-bench-storage FOLDER --photos 5000 --every 1000
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "storage/database.h"
#include "storage/log_inspection.h"
#include "tools/bench/storage/synthetic_photos.h"

namespace veduta::bench {
namespace {

double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void PrintWritten(const Database& database, uint32_t photos, double seconds) {
  const auto statistics = database.GetStatistics();
  if (!statistics.ok()) return;
  const auto per_photo = [&](uint64_t bytes) { return static_cast<double>(bytes) / photos / 1e3; };
  const uint64_t written =
      statistics->log_bytes + statistics->flush_bytes + statistics->compaction_bytes;
  std::printf(
      "%6u photos, %5.0f s: %8.1f kB written per photo: log %.1f, flushes %.1f, "
      "compactions %.1f; of these blob files %.1f, copied %.1f; cache hits %.1f %%\n",
      photos, seconds, per_photo(written), per_photo(statistics->log_bytes),
      per_photo(statistics->flush_bytes), per_photo(statistics->compaction_bytes),
      per_photo(statistics->blob_bytes), per_photo(statistics->blob_copied_bytes),
      100.0 * static_cast<double>(statistics->cache_hits) /
          static_cast<double>(
              std::max<uint64_t>(1, statistics->cache_hits + statistics->cache_misses)));
  std::fflush(stdout);
}

// As a killed process leaves it, but for what a writer deletes in the background meanwhile.
Status TimeOpening(const std::string& folder, const std::string& copy) {
  std::filesystem::remove_all(copy);
  std::filesystem::copy(folder, copy, std::filesystem::copy_options::recursive);
  uint64_t log_bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(copy))
    if (entry.path().extension() == ".log") log_bytes += entry.file_size();
  auto start = std::chrono::steady_clock::now();
  VEDUTA_RETURN_IF_ERROR(InspectLogs(copy, {}).status());
  const double inspection_s = SecondsSince(start);
  start = std::chrono::steady_clock::now();
  VEDUTA_RETURN_IF_ERROR(Database::Open(copy, {.read_only = true}).status());
  const double reader_s = SecondsSince(start);
  start = std::chrono::steady_clock::now();
  VEDUTA_RETURN_IF_ERROR(Database::Open(copy, {}).status());
  std::printf(
      "a log of %.0f MB: inspected in %.3f s; opened for reading in %.3f s, for writing in "
      "%.3f s\n",
      static_cast<double>(log_bytes) / 1e6, inspection_s, reader_s, SecondsSince(start));
  std::filesystem::remove_all(copy);
  return Status::Ok();
}

Status Run(const std::string& folder, uint32_t photos, uint32_t every, const PhotoSizes& sizes) {
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Database> database,
                          Database::Open(folder, {.create = true}));
  const auto start = std::chrono::steady_clock::now();
  for (uint32_t id = 1; id <= photos; ++id) {
    VEDUTA_RETURN_IF_ERROR(AddSyntheticPhoto(*database, id, sizes));
    if (id % every == 0) PrintWritten(*database, id, SecondsSince(start));
  }
  return TimeOpening(folder, folder + ".killed");
}

}  // namespace
}  // namespace veduta::bench

int main(int argc, char** argv) {
  CLI::App app("What the storage writes for each photo, and how long opening takes");
  std::string folder;
  uint32_t photos = 5000, every = 1000;
  veduta::bench::PhotoSizes sizes;
  app.add_option("folder", folder, "Where to make the database; must not exist")->required();
  app.add_option("--photos", photos, "How many")->capture_default_str();
  app.add_option("--every", every, "Print after so many photos")->capture_default_str();
  app.add_option("--photo-bytes", sizes.photo_bytes, "Of one photo")->capture_default_str();
  app.add_option("--features", sizes.features, "Of one photo")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const veduta::Status status = veduta::bench::Run(folder, photos, every, sizes);
  if (!status.ok()) std::fprintf(stderr, "veduta-bench-storage: %s\n", status.message().c_str());
  return status.ok() ? 0 : 1;
}
