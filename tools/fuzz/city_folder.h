// SPDX-License-Identifier: Apache-2.0
#pragma once
// A folder with a database of its own, for targets that ask an engine.

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "engine/engine.h"
#include "storage/base/content_hash.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

// Goes with all that is in it.
class CityFolder final {
 public:
  explicit CityFolder(const std::string& target) {
    std::string path = std::filesystem::temp_directory_path() / ("veduta_fuzz_" + target);
    path += "_XXXXXX";
    Expect(mkdtemp(path.data()) != nullptr, "a folder can be made");
    path_ = path;
  }
  ~CityFolder() { std::filesystem::remove_all(path_); }
  CityFolder(const CityFolder&) = delete;
  CityFolder& operator=(const CityFolder&) = delete;

  std::filesystem::path database() const { return path_ / "db"; }

  // Makes the database, which is empty. Whoever keeps the engine until the program ends must be
  // made around this: RocksDB and OpenSSL, which are first used here, put away what they have of
  // their own after that.
  std::unique_ptr<Engine> MakeCity() const {
    HashContent({});
    EngineOptions opening;
    opening.create = true;
    opening.sync = false;
    opening.thread_count = 1;
    auto engine = Engine::Open(database(), opening);
    Expect(engine.status(), "a database can be made");
    return *std::move(engine);
  }

 private:
  std::filesystem::path path_;
};

}  // namespace veduta::fuzz
