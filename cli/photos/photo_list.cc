// SPDX-License-Identifier: Apache-2.0
#include "cli/photos/photo_list.h"

#include <algorithm>
#include <filesystem>

#include "storage/base/whole_file.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

// Why the entry is passed over; empty for a file and for a folder. Links to folders are not
// followed, so that no folder is walked twice or for ever.
std::string WhyPassedOver(const fs::directory_entry& entry) {
  std::error_code error;
  const fs::file_type type = entry.status(error).type();
  if (type == fs::file_type::not_found) return "it is a link to nothing";
  if (error) return error.message();
  if (type == fs::file_type::directory) {
    return entry.is_symlink(error) ? "it is a link to a folder; name that folder to add it" : "";
  }
  return type == fs::file_type::regular ? "" : "it is no file";
}

Status AppendFolder(const fs::path& folder, std::vector<ListedPhoto>* photos,
                    std::vector<std::string>* passed_over) {
  std::vector<fs::path> files;
  std::error_code error;
  for (auto it = fs::recursive_directory_iterator(folder, error); !error && it != fs::end(it);
       it.increment(error)) {
    std::error_code unknown;
    if (it->path().filename().string().starts_with(".")) {
      if (it->is_directory(unknown)) it.disable_recursion_pending();
      continue;
    }
    const std::string why = WhyPassedOver(*it);
    if (!why.empty()) {
      passed_over->push_back(it->path().string() + " is passed over: " + why);
    } else if (it->is_regular_file(unknown)) {
      files.push_back(it->path());
    }
  }
  if (error)
    return Status::NotFound("cannot read folder " + folder.string() + ": " + error.message());
  std::sort(files.begin(), files.end());
  std::sort(passed_over->begin(), passed_over->end());
  for (const fs::path& file : files)
    photos->push_back({file.lexically_relative(folder).generic_string(), file.string(), ""});
  return Status::Ok();
}

// Absolute as the list's folder makes it, without a look at the disk. Paths that cannot be made
// absolute, because the current folder is gone, stay as they are.
fs::path Normal(const std::string& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  return (error ? fs::path(path) : absolute).lexically_normal();
}

fs::path CommonFolder(const std::vector<ListedPhoto>& photos) {
  fs::path common;
  for (size_t i = 0; i < photos.size(); ++i) {
    const fs::path folder = Normal(photos[i].path).parent_path();
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

Result<std::vector<ListedPhoto>> ListPhotos(const std::vector<std::string>& paths,
                                            std::vector<std::string>* passed_over) {
  std::vector<ListedPhoto> photos;
  for (const std::string& path : paths) {
    std::error_code error;
    if (fs::is_directory(path, error)) {
      VEDUTA_RETURN_IF_ERROR(AppendFolder(path, &photos, passed_over));
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
  VEDUTA_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(list_path, kPhotoListBytesMax));
  Result<std::vector<ListedPhoto>> photos = ParsePhotoList(text, folder);
  if (photos.ok()) return photos;
  return Status::InvalidArgument(list_path + ": " + photos.status().message());
}

Result<std::vector<ListedPhoto>> ParsePhotoList(std::string_view text, const std::string& folder) {
  std::vector<ListedPhoto> photos;
  size_t number = 0;
  text = WithoutByteOrderMark(text);
  for (size_t end = 0; !text.empty(); text.remove_prefix(std::min(text.size(), end + 1))) {
    ++number;
    end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty() || line[0] == '#') continue;
    const size_t tab = line.find('\t');
    ListedPhoto photo;
    photo.path = line.substr(0, tab);
    if (photo.path.empty() || photo.path.find('\0') != std::string::npos) {
      return Status::InvalidArgument("line " + std::to_string(number) + " names no file");
    }
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
      photo.name = Normal(photo.path).lexically_relative(common).generic_string();
    }
  }
  return photos;
}

}  // namespace veduta
