// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

#include "engine/colmap/model_files.h"
#include "storage/base/whole_file.h"

namespace veduta {
namespace {

constexpr size_t kCamerasBytesMax = 64 << 20;  // 100,000 lines have some 20 MB
constexpr size_t kLineBytesMax = 64 << 20;     // a million features of an image; chosen by hand

class TextFile final {
 public:
  static Result<TextFile> Open(const std::string& path) {
    std::error_code failure;
    if (!std::filesystem::exists(path, failure))
      return Status::NotFound(path + " is missing: a model is cameras, images and points3D");
    if (!std::filesystem::is_regular_file(path, failure))
      return Status::InvalidArgument(path + " is not a file");
    TextFile file;
    file.stream_.open(path, std::ios::binary);
    if (!file.stream_) return Status::IoError("cannot read " + path);
    file.path_ = path;
    return file;
  }

  // The next line, without its end; nothing at the end of the file. Where it is not wanted, its
  // text is passed over.
  Result<bool> Next(bool is_wanted = true) {
    line_.clear();
    std::streambuf& bytes = *stream_.rdbuf();
    int byte = bytes.sbumpc();
    if (byte == std::char_traits<char>::eof()) return false;
    ++number_;
    for (; byte != std::char_traits<char>::eof() && byte != '\n'; byte = bytes.sbumpc()) {
      if (!is_wanted) continue;
      if (line_.size() == kLineBytesMax) return Wrong("it is longer than 64 MiB");
      line_ += static_cast<char>(byte);
    }
    if (line_.ends_with('\r')) line_.pop_back();
    return true;
  }
  bool IsRecord() const {
    const size_t first = line_.find_first_not_of(" \t");
    return first != std::string::npos && line_[first] != '#';
  }
  const std::string& line() const { return line_; }
  Status Wrong(const std::string& what) const {
    return Status::InvalidArgument(path_ + ", line " + std::to_string(number_) + ": " + what);
  }
  Status Told(const Status& status) const { return status.ok() ? status : Wrong(status.message()); }

 private:
  std::string path_;
  std::ifstream stream_;
  std::string line_;
  uint64_t number_ = 0;
};

// Takes the next word of a text; empty at its end.
std::string_view TakeWord(std::string_view* text) {
  text->remove_prefix(std::min(text->find_first_not_of(" \t"), text->size()));
  const size_t end = std::min(text->find_first_of(" \t"), text->size());
  const std::string_view word = text->substr(0, end);
  text->remove_prefix(end);
  return word;
}

template <typename Number>
bool TakeNumber(std::string_view* text, Number* number) {
  const std::string_view word = TakeWord(text);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *number);
  return error == std::errc() && end == word.data() + word.size();
}

Status ReadCameras(const std::string& folder, const ModelReceiver& receiver) {
  const std::string path = folder + "/cameras.txt";
  std::error_code failure;
  if (!std::filesystem::exists(path, failure)) {
    return Status::NotFound(folder +
                            " has neither cameras.bin nor cameras.txt: it holds no model of "
                            "COLMAP");
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path, kCamerasBytesMax));
  const Result<std::vector<KnownColmapCamera>> cameras = ParseColmapCameras(text);
  if (!cameras.ok()) return Status::InvalidArgument(folder + ": " + cameras.status().message());
  for (const KnownColmapCamera& camera : *cameras) {
    const Status told = receiver.camera(camera);
    if (!told.ok()) return Status(told.code(), path + ": " + told.message());
  }
  return Status::Ok();
}

// IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, where the name goes on to the end of the line, and
// then a line of features.
Status ReadImages(const std::string& folder, const ModelReceiver& receiver) {
  VEDUTA_ASSIGN_OR_RETURN(TextFile file, TextFile::Open(folder + "/images.txt"));
  for (uint64_t count = 0;;) {
    VEDUTA_ASSIGN_OR_RETURN(const bool has_line, file.Next());
    if (!has_line) return Status::Ok();
    if (!file.IsRecord()) continue;
    if (++count > kModelImagesMax)
      return file.Wrong("there are more than " + std::to_string(kModelImagesMax) + " images");
    std::string_view text = file.line();
    ImageRow image;
    bool is_read = TakeNumber(&text, &image.id);
    for (double& number : image.pose) is_read = is_read && TakeNumber(&text, &number);
    is_read = is_read && TakeNumber(&text, &image.camera) && !text.empty();
    if (!is_read) return file.Wrong("not IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
    image.name = text.substr(1, kModelNameBytesMax + 1);
    VEDUTA_RETURN_IF_ERROR(file.Told(receiver.image(std::move(image))));
    VEDUTA_RETURN_IF_ERROR(file.Next(false).status());
  }
}

// POINT3D_ID X Y Z R G B ERROR, then the track as IMAGE_ID POINT2D_IDX.
Status ReadPoints(const std::string& folder, const ModelReceiver& receiver) {
  VEDUTA_ASSIGN_OR_RETURN(TextFile file, TextFile::Open(folder + "/points3D.txt"));
  std::vector<uint32_t> track;
  for (;;) {
    VEDUTA_ASSIGN_OR_RETURN(const bool has_line, file.Next());
    if (!has_line) return Status::Ok();
    if (!file.IsRecord()) continue;
    std::string_view text = file.line();
    for (int i = 0; i < 8; ++i) {
      if (TakeWord(&text).empty())
        return file.Wrong("not POINT3D_ID X Y Z R G B ERROR and a track");
    }
    track.clear();
    for (text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size())); !text.empty();
         text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()))) {
      uint32_t image = 0, feature = 0;
      if (!TakeNumber(&text, &image) || !TakeNumber(&text, &feature))
        return file.Wrong("its track is not a list of IMAGE_ID POINT2D_IDX");
      track.push_back(image);
    }
    VEDUTA_RETURN_IF_ERROR(file.Told(receiver.track(track)));
  }
}

}  // namespace

Status ReadTextFiles(const std::string& folder, const ModelReceiver& receiver) {
  VEDUTA_RETURN_IF_ERROR(ReadCameras(folder, receiver));
  VEDUTA_RETURN_IF_ERROR(ReadImages(folder, receiver));
  return ReadPoints(folder, receiver);
}

}  // namespace veduta
