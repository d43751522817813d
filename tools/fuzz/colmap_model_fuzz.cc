// SPDX-License-Identifier: Apache-2.0
// ReadColmapModel on models in both formats: the three files, each after its length in four bytes.
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "engine/camera/projection.h"
#include "engine/colmap/colmap_model.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {
namespace {

template <typename Number>
std::string Bytes(std::initializer_list<Number> numbers) {
  return {reinterpret_cast<const char*>(std::data(numbers)), numbers.size() * sizeof(Number)};
}

std::string Joined(char format, std::initializer_list<std::string> files) {
  std::string text(1, format);
  for (const std::string& file : files)
    text += Bytes<uint32_t>({static_cast<uint32_t>(file.size())}) + file;
  return text;
}

}  // namespace

std::vector<std::string> Seeds() {
  const std::string camera = Bytes<uint64_t>({1}) + Bytes<uint32_t>({3, 2}) +
                             Bytes<uint64_t>({640, 480}) + Bytes<double>({500, 320, 240, -0.1});
  const std::string image = Bytes<uint64_t>({1}) + Bytes<uint32_t>({7}) +
                            Bytes<double>({1, 0, 0, 0, 1, 2, 3}) + Bytes<uint32_t>({3}) +
                            std::string("a.jpg", 6) + Bytes<uint64_t>({0});
  const std::string point = Bytes<uint64_t>({1, 1}) + Bytes<double>({1, 2, 3}) + "rgb" +
                            Bytes<double>({0.5}) + Bytes<uint64_t>({1}) + Bytes<uint32_t>({7, 0});
  return {Joined('b', {camera, image, point}),
          Joined('t', {"3 SIMPLE_RADIAL 640 480 500 320 240 -0.1\n",
                       "7 1 0 0 0 1 2 3 3 a b.jpg\n1 1 -1\n8 1 0 0 0 1 2 3 3 c.jpg\n\n",
                       "1 1 2 3 9 9 9 0.5 7 0 8 0\n"})};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  namespace fs = std::filesystem;
  static const fs::path folder = [] {
    char name[] = "/tmp/colmap-model-fuzz-XXXXXX";
    veduta::fuzz::Expect(mkdtemp(name) != nullptr, "a folder can be made");
    return fs::path(name);
  }();
  if (size == 0) return 0;
  const char* const ending = data[0] == 'b' ? ".bin" : ".txt";
  size_t at = 1;
  for (const char* const name : {"cameras", "images", "points3D"}) {
    uint32_t length = 0;
    std::memcpy(&length, data + at, std::min<size_t>(sizeof(length), size - at));
    at = std::min(at + sizeof(length), size);
    length = static_cast<uint32_t>(std::min<size_t>(length, size - at));
    std::ofstream(folder / (std::string(name) + ending), std::ios::binary)
        .write(reinterpret_cast<const char*>(data) + at, length);
    at += length;
  }
  const auto model = veduta::ReadColmapModel(folder.string());
  fs::remove(folder / "cameras.bin");
  if (!model.ok()) return 0;
  for (const veduta::ModelCamera& camera : model->cameras)
    veduta::fuzz::Expect(veduta::CheckCamera(camera.model), "a camera that is read is accepted");
  for (const veduta::ModelImage& image : model->images) {
    veduta::fuzz::Expect(image.cam_from_world.translation.allFinite() &&
                             std::abs(image.cam_from_world.rotation.norm() - 1) < 1e-9,
                         "a pose that is read is one");
  }
  return 0;
}
