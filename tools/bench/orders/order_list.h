// SPDX-License-Identifier: Apache-2.0
#pragma once
// In which orders photos are added.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/status.h"

namespace veduta::orders {

struct OrderedPhoto {
  std::string name, path;
};

struct PhotoOrder {
  std::string label;  // "seed 6", or the path of a list file
  std::vector<OrderedPhoto> photos;
};

// The photos right in a folder, in the order of their names' bytes: files whose names end as
// `ls FOLDER/*.[jJpP][pPnN]*[gG]` has it. kNotFound where there is none.
Result<std::vector<OrderedPhoto>> ListFolder(const std::string& folder);

// The order of `ls FOLDER/* | shuf --random-source=<(yes SEED)`: coreutils' shuf shuffles. Seed 0
// is the order of names. kIoError where shuf cannot be run.
Result<PhotoOrder> ShuffledOrder(const std::vector<OrderedPhoto>& photos, uint64_t seed);

// The order of a file as `veduta add --list` takes it. Errors: as ReadPhotoList.
Result<PhotoOrder> ListedOrder(const std::string& list_path);

}  // namespace veduta::orders
