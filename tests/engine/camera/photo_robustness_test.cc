// SPDX-License-Identifier: Apache-2.0
// Goal: no file, however damaged or hostile, crashes the decoder, is taken for whole when it is
//   not, or makes it allocate what its header claims.
// Method: files of every format cut at every sixteenth, thousands of seeded mutations, and
//   headers that declare pictures of gigabytes, with the process's memory counted before and
//   after.
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bitset>
#include <fstream>
#include <string>
#include <vector>

#include "engine/camera/hevc_stream.h"
#include "engine/camera/photo_decoder.h"
#include "storage/base/content_hash.h"
#include "tests/engine/camera/heif_grid_writer.h"
#include "tests/engine/camera/modern_writer.h"
#include "tests/engine/camera/photo_writer.h"
#include "tests/engine/camera/specimens.h"
#include "tests/engine/camera/tiff_writer.h"

namespace veduta {
namespace {

using testing::Append;
using testing::FileBytes;
using testing::JpegFile;
using testing::PngFile;
using testing::Specimen;
using testing::Specimens;
using testing::TestPicture;
using testing::TiffFile;
using testing::TiffKind;

const DecodeLimits kLimits;

// What holds of every answer.
void ExpectSound(const DecodedPhoto& photo) {
  const bool is_decoded = photo.outcome == DecodeOutcome::kDecoded;
  EXPECT_EQ(is_decoded, !photo.bgr.empty());
  EXPECT_EQ(is_decoded, !photo.gray.empty());
  EXPECT_EQ(is_decoded, photo.detail.empty());
  EXPECT_LT(photo.detail.size(), 400u);
  if (is_decoded) {
    EXPECT_EQ(photo.bgr.type(), CV_8UC3);
    EXPECT_EQ(static_cast<uint32_t>(photo.bgr.cols), photo.upright_size.width_px);
    EXPECT_EQ(static_cast<uint32_t>(photo.bgr.rows), photo.upright_size.height_px);
  }
}

TEST(DamagedPhotos, CutShortAreUnreadable) {
  for (const Specimen& specimen : Specimens(160, 120)) {
    ASSERT_EQ(DecodePhoto(specimen.bytes, kLimits).outcome, DecodeOutcome::kDecoded)
        << specimen.name;
    for (size_t sixteenth = 1; sixteenth < 16; ++sixteenth) {
      const FileBytes cut(specimen.bytes.begin(),
                          specimen.bytes.begin() + specimen.bytes.size() * sixteenth / 16);
      const DecodedPhoto photo = DecodePhoto(cut, kLimits);
      ExpectSound(photo);
      EXPECT_EQ(photo.outcome, DecodeOutcome::kUnreadable)
          << specimen.name << " at " << sixteenth << "/16";
    }
  }
}

TEST(DamagedPhotos, CutAnywhereNeverCrash) {
  for (const Specimen& specimen : Specimens(20, 12)) {
    for (size_t length = 0; length < specimen.bytes.size(); ++length) {
      // A buffer of just this size, so that a sanitizer sees a read past the end.
      const FileBytes cut(specimen.bytes.begin(), specimen.bytes.begin() + length);
      ExpectSound(DecodePhoto(cut, kLimits));
    }
  }
}

TEST(DamagedPhotos, MutationsNeverCrashAndRepeat) {
  constexpr int kMutationsPerSpecimen = 1000;
  int decoded = 0, refused = 0;
  DecodeLimits limits;
  limits.pixels_max =
      1 << 20;  // a mutated size may pass: keeps the test small, not the decoder safe
  for (const Specimen& specimen : Specimens(40, 28)) {
    SeededRandom random(HashContent(specimen.bytes).Seed());
    for (int i = 0; i < kMutationsPerSpecimen; ++i) {
      FileBytes bytes = specimen.bytes;
      // Headers are where the decisions are: half of the changes go there.
      const uint32_t count = 1 + random.Below(6);
      for (uint32_t k = 0; k < count; ++k) {
        const auto size = static_cast<uint32_t>(bytes.size());
        const uint32_t at = random.Below(random.Below(2) == 0 ? size : std::min(size, 256u));
        switch (random.Below(5)) {
          case 0:
            bytes[at] = static_cast<uint8_t>(random.Below(256));
            break;
          case 1:
            bytes[at] ^= static_cast<uint8_t>(1u << random.Below(8));
            break;
          case 2:
            bytes[at] = random.Below(2) == 0 ? 0xFF : 0x00;
            break;
          case 3:
            bytes.erase(bytes.begin() + at);
            break;
          default:
            bytes.insert(bytes.begin() + at, static_cast<uint8_t>(random.Below(256)));
            break;
        }
      }
      const DecodedPhoto photo = DecodePhoto(bytes, limits);
      ExpectSound(photo);
      if (i % 16 == 0) {
        const DecodedPhoto again = DecodePhoto(bytes, limits);
        EXPECT_EQ(again.outcome, photo.outcome);
        EXPECT_EQ(again.detail, photo.detail);
        if (!photo.bgr.empty()) {
          EXPECT_EQ(cv::norm(photo.bgr, again.bgr, cv::NORM_INF), 0) << specimen.name;
        }
      }
      ++(photo.outcome == DecodeOutcome::kDecoded ? decoded : refused);
    }
  }
  EXPECT_GT(decoded, 100) << "mutations that no decoder gets to see prove little";
  EXPECT_GT(refused, 100);
}

// Where a damaged file lacks a part of its picture, a decoder could give what memory held there.
TEST(DamagedPhotos, HeicsDoNotShowWhatMemoryHeld) {
  const FileBytes heic = testing::HeifFileOf(TestPicture(200, 136));
  SeededRandom random(HashContent(heic).Seed());
  for (int i = 0; i < 400; ++i) {
    FileBytes bytes = heic;
    const auto half = static_cast<uint32_t>(bytes.size() / 2);  // the coded picture comes last
    bytes[half + random.Below(half)] = static_cast<uint8_t>(random.Below(256));
    mallopt(M_PERTURB, 0x55);
    const DecodedPhoto photo = DecodePhoto(bytes, kLimits);
    mallopt(M_PERTURB, 0xAA);
    const DecodedPhoto again = DecodePhoto(bytes, kLimits);
    ASSERT_EQ(again.outcome, photo.outcome) << i;
    if (!photo.bgr.empty()) {
      ASSERT_EQ(cv::norm(photo.bgr, again.bgr, cv::NORM_INF), 0) << i;
    }
  }
  mallopt(M_PERTURB, 0);
}

TEST(DamagedPhotos, TiffTagsOfAnyValueNeverCrash) {
  // Each 16-bit word of the directory becomes each of a few values: types, counts, offsets, sizes
  // of strips.
  for (const bool is_tiled : {false, true}) {
    TiffKind kind;
    kind.compression = COMPRESSION_LZW;
    kind.is_tiled = is_tiled;
    const FileBytes tiff = TiffFile(TestPicture(40, 28), kind);
    const size_t directory = tiff[4] | tiff[5] << 8 | tiff[6] << 16;
    const size_t end = std::min(tiff.size(), directory + 2 + 12 * tiff[directory]);
    for (size_t at = directory; at + 1 < end; at += 2) {
      for (const uint16_t value : {0, 1, 2, 4, 7, 16, 255, 256, 0x7FFF, 0x8000, 0xFFFF}) {
        FileBytes bytes = tiff;
        bytes[at] = static_cast<uint8_t>(value);
        bytes[at + 1] = static_cast<uint8_t>(value >> 8);
        ExpectSound(DecodePhoto(bytes, kLimits));
      }
    }
  }
}

int64_t PeakMemoryKilobytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

void Put32(FileBytes* bytes, size_t at, uint32_t value) {
  for (int i = 0; i < 4; ++i) (*bytes)[at + i] = static_cast<uint8_t>(value >> (24 - 8 * i));
}

TEST(HostilePhotos, HugeDeclaredSizesAllocateNothing) {
  const cv::Mat picture = TestPicture(32, 32);
  std::vector<Specimen> specimens;
  FileBytes jpeg = JpegFile(picture);
  for (size_t i = 2; i + 9 < jpeg.size(); ++i) {
    if (jpeg[i] == 0xFF && jpeg[i + 1] == 0xC0) {
      for (const size_t at : {i + 5, i + 7}) {
        jpeg[at] = 60000 >> 8;
        jpeg[at + 1] = 60000 & 0xFF;
      }
      break;
    }
  }
  specimens.push_back({"JPEG", jpeg});
  FileBytes png = PngFile(picture);
  Put32(&png, 16, 60000);
  Put32(&png, 20, 60000);
  specimens.push_back({"PNG", png});
  Put32(&png, 16, 0x7FFFFFFF);
  Put32(&png, 20, 0xFFFFFFFF);
  specimens.push_back({"PNG of the largest size there is", png});
  TiffKind kind;
  kind.is_big_endian = true;
  FileBytes tiff = TiffFile(picture, kind);
  const size_t directory = tiff[6] << 8 | tiff[7];
  for (const size_t entry : {directory + 2, directory + 14}) {  // width and length come first
    tiff[entry + 3] = 4;                                        // LONG
    Put32(&tiff, entry + 8, 60000);
  }
  specimens.push_back({"TIFF", tiff});
  const int64_t before = PeakMemoryKilobytes();
  for (const Specimen& specimen : specimens) {
    const DecodedPhoto photo = DecodePhoto(specimen.bytes, kLimits);
    EXPECT_EQ(photo.outcome, DecodeOutcome::kTooLarge) << specimen.name << ": " << photo.detail;
    ExpectSound(photo);
    // With limits that let it pass, it is refused for the camera's size before anything is decoded.
    DecodeLimits generous;
    generous.side_px_max = 65535;
    generous.pixels_max = ~0ull;
    const DecodedPhoto wrong = DecodePhoto(specimen.bytes, generous, {1536, 1024});
    EXPECT_TRUE(wrong.outcome == DecodeOutcome::kWrongSize ||
                wrong.outcome == DecodeOutcome::kTooLarge)
        << wrong.detail;
  }
  EXPECT_LT(PeakMemoryKilobytes() - before, 16 << 10);
}

// The unit of HEVC that starts so in a HEIC's box of parameters, where its length of two bytes goes
// before it.
FileBytes UnitOf(const FileBytes& heic, const FileBytes& start) {
  const auto at = std::search(heic.begin(), heic.end(), start.begin(), start.end());
  return FileBytes(at, at + (at[-2] << 8 | at[-1]));
}

// As H.265, 9.2 writes it.
std::string ExpGolomb(uint32_t value) {
  std::string digits;
  for (uint32_t rest = value + 1; rest != 0; rest /= 2)
    digits.insert(digits.begin(), rest % 2 == 0 ? '0' : '1');
  return std::string(digits.size() - 1, '0') + digits;
}

// The parameters of a sequence of square pictures, made from those of another, and the bytes that
// keep start codes out of them (H.265, 7.3.1.1 and 7.3.2.2).
FileBytes WithSide(const FileBytes& parameters, uint32_t side_px) {
  std::string bits;
  for (size_t i = 0; i < parameters.size(); ++i) {
    const bool is_escape =
        i >= 2 && parameters[i] == 3 && (parameters[i - 1] | parameters[i - 2]) == 0;
    if (!is_escape) bits += std::bitset<8>(parameters[i]).to_string();
  }
  size_t at = 16 + 8 + 96;  // the unit's header; numbers; profile and level
  const auto skip_number = [&] { at += 2 * (bits.find('1', at) - at) + 1; };
  skip_number();
  skip_number();
  const size_t sizes_at = at;
  skip_number();
  skip_number();
  bits.replace(sizes_at, at - sizes_at, ExpGolomb(side_px) + ExpGolomb(side_px));
  FileBytes bytes;
  for (size_t i = 0; i + 8 <= bits.size(); i += 8) {
    const auto byte = static_cast<uint8_t>(std::stoi(bits.substr(i, 8), nullptr, 2));
    const size_t n = bytes.size();
    if (n >= 2 && byte <= 3 && (bytes[n - 1] | bytes[n - 2]) == 0) bytes.push_back(3);
    bytes.push_back(byte);
  }
  return bytes;
}

// A HEIC whose bitstream has parameters of its own, of larger pictures than the file declares.
FileBytes HeicWithHugeBitstream(FileBytes heic, uint32_t side_px) {
  FileBytes units;
  for (const FileBytes& unit :
       {WithSide(UnitOf(heic, {0x42, 0x01}), side_px), UnitOf(heic, {0x44, 0x01})}) {
    Append(&units, {0, 0, 0, static_cast<int>(unit.size())});
    units.insert(units.end(), unit.begin(), unit.end());
  }
  const std::string box = "mdat";
  const size_t data_at =
      std::search(heic.begin(), heic.end(), box.begin(), box.end()) + 4 - heic.begin();
  const auto size = static_cast<uint32_t>(heic.size() - data_at);
  FileBytes extent(4);
  Put32(&extent, 0, size);
  const size_t extent_at =
      std::search(heic.begin(), heic.end(), extent.begin(), extent.end()) - heic.begin();
  Put32(&heic, extent_at, size + static_cast<uint32_t>(units.size()));
  heic.insert(heic.begin() + data_at, units.begin(), units.end());
  return heic;
}

TEST(HostilePhotos, HeicsOfHugeBitstreamsAllocateNothing) {
  const FileBytes heic = testing::HeifFileOf(TestPicture(64, 64));
  // What is put in front does not make the file unreadable in itself.
  EXPECT_EQ(DecodePhoto(HeicWithHugeBitstream(heic, 64), kLimits).outcome, DecodeOutcome::kDecoded);
  const int64_t before = PeakMemoryKilobytes();
  for (const uint64_t side_px : {8192, 32768, 65528}) {
    const FileBytes parameters = WithSide(UnitOf(heic, {0x42, 0x01}), side_px);
    EXPECT_EQ(HevcPixelCount(parameters), side_px * side_px);
    const DecodedPhoto photo = DecodePhoto(HeicWithHugeBitstream(heic, side_px), kLimits);
    ExpectSound(photo);
    EXPECT_EQ(photo.outcome, DecodeOutcome::kUnreadable);
    EXPECT_NE(photo.detail.find("more pixels than the file"), std::string::npos) << photo.detail;
  }
  EXPECT_LT(PeakMemoryKilobytes() - before, 16 << 10);
}

TEST(HostilePhotos, PngThatInflatesWithoutEndIsBounded) {
  // A text chunk and a colour profile that would inflate a thousandfold are not even looked at.
  FileBytes png = PngFile(TestPicture(16, 16));
  FileBytes chunk = {0, 0, 0x40, 0, 'z', 'T', 'X', 't'};
  chunk.resize(8 + 0x4000 + 4, 0x42);
  png.insert(png.begin() + 33, chunk.begin(), chunk.end());
  const DecodedPhoto photo = DecodePhoto(png, kLimits);
  ExpectSound(photo);
  EXPECT_EQ(photo.outcome, DecodeOutcome::kDecoded) << photo.detail;
}

// The address space that the process has, in bytes.
rlim_t AddressSpace() {
  std::ifstream file("/proc/self/statm");
  rlim_t pages = 0;
  file >> pages;
  return pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
}

// Decodes with `spare_bytes` of address space besides what is there, and ends the process: with 0
// where the photo was decoded, 3 where the memory was too short, 1 where the photo was blamed.
[[noreturn]] void DecodeWithLittleMemory(const FileBytes& bytes, size_t spare_bytes) {
  const rlimit limit{AddressSpace() + spare_bytes, RLIM_INFINITY};
  if (setrlimit(RLIMIT_AS, &limit) != 0) _exit(2);
  const DecodeOutcome outcome = DecodePhoto(bytes, kLimits).outcome;
  _exit(outcome == DecodeOutcome::kDecoded ? 0 : outcome == DecodeOutcome::kNoMemory ? 3 : 1);
}

// Freed memory is not there again at once: not in the arenas of threads of encoders (from the
// start, before any thread), and not in the heap where it was large.
const bool kIsMemoryReturned =
    mallopt(M_ARENA_MAX, 1) == 1 && mallopt(M_MMAP_THRESHOLD, 1 << 16) == 1;

TEST(PhotoRobustness, ShortageOfMemoryIsNotThePhotosFault) {
  if (!kIsMemoryReturned) GTEST_SKIP() << "a sanitizer keeps what is freed";
  size_t short_count = 0;
  const std::vector<Specimen> specimens = Specimens(1500, 1000);
  malloc_trim(0);  // the encoders' memory would be there for the decoders
  for (const Specimen& specimen : specimens) {
    for (size_t spare_bytes = 0; spare_bytes < (14 << 20); spare_bytes += 1'300'000) {
      const pid_t child = fork();
      if (child == 0) DecodeWithLittleMemory(specimen.bytes, spare_bytes);
      int status = 0;
      ASSERT_EQ(waitpid(child, &status, 0), child);
      ASSERT_TRUE(WIFEXITED(status)) << specimen.name << ", " << spare_bytes;
      EXPECT_TRUE(WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 3)
          << specimen.name << ", " << spare_bytes << ": " << WEXITSTATUS(status);
      if (WEXITSTATUS(status) == 3) ++short_count;
    }
  }
  EXPECT_GT(short_count, 20u);
}

}  // namespace
}  // namespace veduta
