// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/orders/order_list.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "cli/photos/photo_list.h"
#include "tools/bench/orders/scratch_folder.h"

namespace veduta::orders {
namespace {

namespace fs = std::filesystem;

// As the pattern *.[jJpP][pPnN]*[gG] has it.
bool IsPhoto(const std::string& name) {
  const size_t dot = name.rfind('.');
  if (dot == std::string::npos || name.size() < dot + 4 || name[0] == '.') return false;
  const auto is_one_of = [&](size_t at, const char* letters) {
    return std::string(letters).find(name[at]) != std::string::npos;
  };
  return is_one_of(dot + 1, "jJpP") && is_one_of(dot + 2, "pPnN") &&
         is_one_of(name.size() - 1, "gG");
}

// What `yes SEED | head -c ...` writes: more than shuf takes for `count` lines.
std::string RandomSource(uint64_t seed, size_t count) {
  const std::string line = std::to_string(seed) + "\n";
  std::string source;
  while (source.size() < 65536 + 16 * count) source += line;
  return source;
}

Status WriteText(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  return file ? Status() : Status::IoError("cannot write " + path.string());
}

// Runs shuf with its standard output in a file.
Status RunShuf(const std::string& source, const std::string& lines, const std::string& out) {
  const pid_t child = fork();
  if (child < 0) return Status::IoError("cannot start shuf");
  if (child == 0) {
    const int file = open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    const std::string option = "--random-source=" + source;
    if (file >= 0 && dup2(file, STDOUT_FILENO) >= 0)
      execlp("shuf", "shuf", option.c_str(), lines.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  int state = 0;
  if (waitpid(child, &state, 0) != child || !WIFEXITED(state) || WEXITSTATUS(state) != 0)
    return Status::IoError("coreutils' shuf cannot be run");
  return {};
}

}  // namespace

Result<std::vector<OrderedPhoto>> ListFolder(const std::string& folder) {
  std::error_code error;
  std::vector<OrderedPhoto> photos;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (IsPhoto(name)) photos.push_back({name, at->path().string()});
  }
  if (error) return Status::IoError("cannot read " + folder + ": " + error.message());
  if (photos.empty()) return Status::NotFound("there is no photo in " + folder);
  std::ranges::sort(photos, {}, &OrderedPhoto::name);
  return photos;
}

Result<PhotoOrder> ShuffledOrder(const std::vector<OrderedPhoto>& photos, uint64_t seed) {
  PhotoOrder order = {"seed " + std::to_string(seed), photos};
  if (seed == 0) return order;
  VEDUTA_ASSIGN_OR_RETURN(const ScratchFolder scratch, ScratchFolder::Make());
  const fs::path source = scratch.path() / "source", lines = scratch.path() / "lines",
                 out = scratch.path() / "out";
  std::string numbers;
  for (size_t i = 0; i < photos.size(); ++i) numbers += std::to_string(i) + "\n";
  VEDUTA_RETURN_IF_ERROR(WriteText(source, RandomSource(seed, photos.size())));
  VEDUTA_RETURN_IF_ERROR(WriteText(lines, numbers));
  VEDUTA_RETURN_IF_ERROR(RunShuf(source.string(), lines.string(), out.string()));
  std::ifstream file(out);
  order.photos.clear();
  for (size_t i = 0; file >> i;) order.photos.push_back(photos.at(i));
  if (order.photos.size() != photos.size())
    return Status::IoError("shuf gave " + std::to_string(order.photos.size()) + " lines of " +
                           std::to_string(photos.size()));
  return order;
}

Result<PhotoOrder> ListedOrder(const std::string& list_path) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ListedPhoto> listed, ReadPhotoList(list_path, ""));
  PhotoOrder order;
  order.label = list_path;
  for (ListedPhoto& photo : listed)
    order.photos.push_back({std::move(photo.name), std::move(photo.path)});
  return order;
}

}  // namespace veduta::orders
