// SPDX-License-Identifier: Apache-2.0
#include "cli/photo_list.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace veduta {
namespace {

namespace fs = std::filesystem;

Status AppendFolder(const fs::path& folder, std::vector<ListedPhoto>* photos) {
  std::vector<fs::path> files;
  std::error_code error;
  for (auto it = fs::recursive_directory_iterator(folder, error); !error && it != fs::end(it);
       it.increment(error)) {
    // What cannot be looked at (a link that leads in a circle) is no photo.
    std::error_code unknown;
    const bool hidden = it->path().filename().string().starts_with(".");
    if (hidden && it->is_directory(unknown)) it.disable_recursion_pending();
    if (!hidden && it->is_regular_file(unknown)) files.push_back(it->path());
  }
  if (error)
    return Status::NotFound("cannot read folder " + folder.string() + ": " + error.message());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files)
    photos->push_back({file.lexically_relative(folder).generic_string(), file.string(), ""});
  return Status::Ok();
}

fs::path CommonFolder(const std::vector<ListedPhoto>& photos) {
  fs::path common;
  for (size_t i = 0; i < photos.size(); ++i) {
    const fs::path folder = fs::absolute(photos[i].path).lexically_normal().parent_path();
    if (i == 0) {
      common = folder;
      continue;
    }
    fs::path shared;
    for (auto a = common.begin(), b = folder.begin();
         a != common.end() && b != folder.end() && *a == *b; ++a, ++b)
      shared /= *a;
    common = shared;
  }
  return common;
}

}  // namespace

Result<std::vector<ListedPhoto>> ListPhotos(const std::vector<std::string>& paths) {
  std::vector<ListedPhoto> photos;
  for (const std::string& path : paths) {
    std::error_code error;
    if (fs::is_directory(path, error)) {
      VEDUTA_RETURN_IF_ERROR(AppendFolder(path, &photos));
    } else if (fs::exists(path, error)) {
      photos.push_back({fs::path(path).filename().generic_string(), path, ""});
    } else {
      return Status::NotFound("there is no file or folder " + path);
    }
  }
  return photos;
}

Result<std::vector<ListedPhoto>> ReadPhotoList(const std::string& list_path,
                                               const std::string& folder) {
  std::ifstream file(list_path);
  std::error_code error;
  if (!file || fs::is_directory(list_path, error))
    return Status::NotFound("cannot read list " + list_path);
  std::vector<ListedPhoto> photos;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line[0] == '#') continue;
    const size_t tab = line.find('\t');
    ListedPhoto photo;
    photo.path = line.substr(0, tab);
    if (tab != std::string::npos) photo.camera = line.substr(tab + 1);
    if (!folder.empty()) {
      photo.name = fs::path(photo.path).lexically_normal().generic_string();
      photo.path = (fs::path(folder) / photo.path).string();
    }
    photos.push_back(std::move(photo));
  }
  if (folder.empty()) {
    const fs::path common = CommonFolder(photos);
    for (ListedPhoto& photo : photos) {
      photo.name =
          fs::absolute(photo.path).lexically_normal().lexically_relative(common).generic_string();
    }
  }
  return photos;
}

}  // namespace veduta
