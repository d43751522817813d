// SPDX-License-Identifier: Apache-2.0
// Goal: photos are decoded as in this process, byte for byte and word for word; a photo whose
//   process dies, or answers nonsense, is refused, and no other one is; nothing is left open.
// Method: files of every kind, whole and damaged, by both decoders and on several threads; real
//   decoder processes that get too little time and memory, and are killed while they decode; a
//   decoder process that lies (lying_decoder.cc).
#include "engine/camera/sandbox/sandboxed_decoder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstring>
#include <functional>
#include <thread>
#include <utility>

#include "engine/camera/photo_decoder.h"
#include "storage/base/content_hash.h"
#include "tests/engine/camera/exif_writer.h"
#include "tests/engine/camera/sandbox/processes.h"
#include "tests/engine/camera/specimens.h"

namespace veduta {
namespace {

using testing::ChildrenOf;
using testing::FileBytes;
using testing::OpenDescriptorCount;
using testing::Specimen;
using testing::Specimens;

using Decoder = std::shared_ptr<const SandboxedDecoder>;

Decoder StartDecoder(const char* program = VEDUTA_DECODER) {
  auto started = SandboxedDecoder::Start(program);
  EXPECT_TRUE(started.ok()) << started.status().message();
  return started.ok() ? *std::move(started) : nullptr;
}

DecodedPhoto Decode(const PhotoDecoder& decoder, const FileBytes& bytes,
                    const DecodeLimits& limits = {}) {
  return DecodePhoto(decoder, bytes, decoder.Examine(bytes).header, limits);
}

bool IsSame(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  const size_t row_bytes = a.elemSize() * static_cast<size_t>(a.cols);
  for (int row = 0; row < a.rows; ++row) {
    if (std::memcmp(a.ptr(row), b.ptr(row), row_bytes) != 0) return false;
  }
  return true;
}

void ExpectSame(const DecodedPhoto& a, const DecodedPhoto& b, const std::string& name) {
  EXPECT_EQ(a.outcome, b.outcome) << name;
  EXPECT_EQ(a.detail, b.detail) << name;
  EXPECT_EQ(a.format, b.format) << name;
  EXPECT_EQ(a.orientation, b.orientation) << name;
  EXPECT_EQ(a.stored_size, b.stored_size) << name;
  EXPECT_TRUE(IsSame(a.bgr, b.bgr) && IsSame(a.gray, b.gray)) << name;
}

// Changed here and there, seeded by what it was.
FileBytes Mutated(FileBytes bytes, SeededRandom* random) {
  const auto size = static_cast<uint32_t>(bytes.size());
  for (uint32_t k = 1 + random->Below(6); k-- > 0;) {
    const uint32_t at = random->Below(random->Below(2) == 0 ? std::min(size, 200u) : size);
    bytes[at] = static_cast<uint8_t>(random->Below(256));
  }
  return bytes;
}

TEST(SandboxedDecoder, DecodesAsThisProcessDoes) {
  const Decoder decoder = StartDecoder();
  ASSERT_TRUE(decoder);
  for (const Specimen& specimen : Specimens(160, 120)) {
    const DecodedPhoto here = Decode(DecoderInProcess(), specimen.bytes);
    EXPECT_EQ(here.outcome, DecodeOutcome::kDecoded) << specimen.name;
    ExpectSame(Decode(*decoder, specimen.bytes), here, specimen.name);
    ExpectSame(DecodePhoto(specimen.bytes, {}), here, specimen.name);
  }
  const ExifCamera phone{"Maker", "Model 7", "Lens", 4.25, 1.5, 27};
  const FileBytes photo =
      testing::WithExif(testing::JpegFile(testing::TestPicture(64, 48)), testing::ExifOf(phone));
  EXPECT_EQ(decoder->Examine(photo).camera, phone);
  for (const FileBytes& none : {FileBytes(), FileBytes(100, 'x'), FileBytes{0xFF, 0xD8, 0xFF}}) {
    ExpectSame(Decode(*decoder, none), Decode(DecoderInProcess(), none), "no photo");
  }
}

// Damage is told in the same words, and ends no process.
TEST(SandboxedDecoder, RefusesAsThisProcessDoes) {
  const Decoder decoder = StartDecoder();
  ASSERT_TRUE(decoder);
  DecodeLimits limits;
  limits.pixels_max = 1 << 20;
  int decoded = 0, refused = 0;
  for (const Specimen& specimen : Specimens(40, 28)) {
    SeededRandom random(HashContent(specimen.bytes).Seed());
    for (int i = 0; i < 25; ++i) {
      const FileBytes bytes = Mutated(specimen.bytes, &random);
      const DecodedPhoto here = Decode(DecoderInProcess(), bytes, limits);
      DecodedPhoto there = Decode(*decoder, bytes, limits);
      EXPECT_EQ(there.detail.find("the decoder died"), std::string::npos) << there.detail;
      // Bytes of the file that a library quotes may be none that are passed on.
      if (there.detail.find('?') != std::string::npos) there.detail = here.detail;
      ExpectSame(there, here, specimen.name);
      (here.outcome == DecodeOutcome::kDecoded ? decoded : refused) += 1;
    }
  }
  EXPECT_GT(decoded, 50);
  EXPECT_GT(refused, 50);
}

TEST(SandboxedDecoder, PhotosDecodedAtTheSameTimeDoNotMeet) {
  const size_t open_before = OpenDescriptorCount();
  const auto specimens = Specimens(160, 120);
  {
    const Decoder decoder = StartDecoder();
    ASSERT_TRUE(decoder);
    std::vector<std::thread> threads;
    for (size_t t = 0; t < 4; ++t) {
      threads.emplace_back([&, t] {
        for (size_t i = 0; i < 2 * specimens.size(); ++i) {
          const Specimen& specimen = specimens[(i * (t + 1)) % specimens.size()];
          ExpectSame(Decode(*decoder, specimen.bytes), DecodePhoto(specimen.bytes, {}),
                     specimen.name);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_LE(ChildrenOf(getpid()).size(), 4u);
  }
  EXPECT_EQ(OpenDescriptorCount(), open_before);
  EXPECT_TRUE(ChildrenOf(getpid(), /*with_zombies=*/true).empty());
}

// A decoder process of its own, asked directly.
class ConnectionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const Descriptor program(open(VEDUTA_DECODER, O_PATH | O_CLOEXEC));
    auto started = DecoderConnection::Start(program.number());
    ASSERT_TRUE(started.ok()) << started.status().message();
    connection_ = *std::move(started);
  }
  // How decoding a picture of that size with those limits ends.
  DecoderEnd Run(const FileBytes& bytes, ImageSize size, DecoderRequest request) {
    request.task = DecodeTask::kDecodePixels;
    request.width_px = size.width_px;
    request.height_px = size.height_px;
    request.photo_bytes = bytes.size();
    request.answer_bytes = kPixelsOffset + 3 * size.pixel_count();
    const auto photo = ShareForReading(bytes);
    const auto memory = ShareForWriting(request.answer_bytes);
    const auto end = connection_->Ask(request, photo->number(), memory->number());
    EXPECT_TRUE(end);
    const auto mapped =
        MappedMemory::Map(memory->number(), request.answer_bytes, MappedMemory::Access::kRead);
    std::memcpy(&answer_, mapped->data(), sizeof(answer_));
    return end.value_or(DecoderEnd());
  }

  std::unique_ptr<DecoderConnection> connection_;
  DecoderAnswer answer_;
};

constexpr uint64_t kPlenty = 2ull << 30;

// A picture of one colour: small as a file, long to decode.
const FileBytes& LargePng() {
  static const FileBytes png = testing::PngFile(cv::Mat(8000, 8000, CV_8UC3, cv::Scalar(1, 2, 3)));
  return png;
}
constexpr ImageSize kLarge = {8000, 8000};

TEST_F(ConnectionTest, TooMuchMemoryIsToldAndNothingElse) {
#ifdef VEDUTA_SANITIZED
  GTEST_SKIP() << "the sanitizer takes its addresses by the terabyte";
#endif
  const DecoderEnd end =
      Run(LargePng(), kLarge, {.cpu_s = 60, .wall_s = 120, .memory_bytes = 32 << 20});
  EXPECT_TRUE(WIFEXITED(end.wait_status) && WEXITSTATUS(end.wait_status) == 0);
  EXPECT_EQ(answer_.outcome, static_cast<uint32_t>(PixelOutcome::kNoMemory));
  Run(LargePng(), kLarge, {.cpu_s = 60, .wall_s = 120, .memory_bytes = kPlenty});
  EXPECT_EQ(answer_.outcome, static_cast<uint32_t>(PixelOutcome::kDecoded));
}

TEST_F(ConnectionTest, TooMuchTimeEndsTheChildAlone) {
  const pid_t process = ChildrenOf(getpid()).at(0);
  const DecoderEnd end =
      Run(LargePng(), kLarge, {.cpu_s = 60, .wall_s = 0, .memory_bytes = kPlenty});
  EXPECT_EQ(end.is_overdue, 1u);
  EXPECT_TRUE(WIFSIGNALED(end.wait_status) && WTERMSIG(end.wait_status) == SIGKILL);
  EXPECT_EQ(ChildrenOf(getpid()), std::vector{process});
  EXPECT_TRUE(ChildrenOf(process, true).empty());
  const FileBytes small = testing::PngFile(testing::TestPicture(40, 28));
  Run(small, {40, 28}, {.cpu_s = 60, .wall_s = 120, .memory_bytes = kPlenty});
  EXPECT_EQ(answer_.outcome, static_cast<uint32_t>(PixelOutcome::kDecoded));
}

// Of another size than the request says there is no room for the pixels.
TEST_F(ConnectionTest, AnotherSizeIsUnreadable) {
  const FileBytes small = testing::PngFile(testing::TestPicture(40, 28));
  Run(small, {28, 40}, {.cpu_s = 60, .wall_s = 120, .memory_bytes = kPlenty});
  EXPECT_EQ(answer_.outcome, static_cast<uint32_t>(PixelOutcome::kUnreadable));
}

// Kills what it is told to while `decode` runs, as often as it can.
template <typename Decoding>
int KillWhile(const Decoding& decode, const std::function<std::vector<pid_t>()>& whom) {
  std::atomic<bool> is_done = false;
  int killed = 0;
  std::thread killer([&] {
    while (!is_done) {
      for (const pid_t process : whom()) killed += kill(process, SIGKILL) == 0 ? 1 : 0;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  decode();
  is_done = true;
  killer.join();
  return killed;
}

// Children of decoder processes.
std::vector<pid_t> Grandchildren() {
  std::vector<pid_t> found;
  for (const pid_t process : ChildrenOf(getpid())) {
    for (const pid_t child : ChildrenOf(process)) found.push_back(child);
  }
  return found;
}

TEST(SandboxedDecoder, KillingSaysNothingAboutThePhoto) {
  const size_t open_before = OpenDescriptorCount();
  {
    const Decoder decoder = StartDecoder();
    ASSERT_TRUE(decoder);
    const PhotoHeader header = decoder->Examine(LargePng()).header;
    for (const auto& whom :
         {std::function(Grandchildren), std::function([] { return ChildrenOf(getpid()); })}) {
      Pixels pixels;
      const int killed =
          KillWhile([&] { pixels = decoder->DecodePixels(LargePng(), header); }, whom);
      EXPECT_GE(killed, 2);
      EXPECT_EQ(pixels.outcome, PixelOutcome::kNoMemory) << pixels.detail;
      EXPECT_TRUE(pixels.detail.find("was killed") != std::string::npos ||
                  pixels.detail.find("cannot be started") != std::string::npos)
          << pixels.detail;
      EXPECT_TRUE(pixels.bgr.empty());
      // One that nobody disturbs.
      EXPECT_EQ(decoder->DecodePixels(LargePng(), header).outcome, PixelOutcome::kDecoded);
    }
  }
  EXPECT_EQ(OpenDescriptorCount(), open_before);
  EXPECT_TRUE(ChildrenOf(getpid(), /*with_zombies=*/true).empty());
}

// Killed once, it is tried once more, and nobody notices.
TEST(SandboxedDecoder, OneKillCostsNothing) {
  const Decoder decoder = StartDecoder();
  ASSERT_TRUE(decoder);
  const PhotoHeader header = decoder->Examine(LargePng()).header;
  std::atomic<bool> has_killed = false;
  Pixels pixels;
  KillWhile([&] { pixels = decoder->DecodePixels(LargePng(), header); },
            [&]() -> std::vector<pid_t> {
              if (has_killed) return {};
              const auto found = Grandchildren();
              has_killed = !found.empty();
              return found;
            });
  EXPECT_TRUE(has_killed);
  EXPECT_EQ(pixels.outcome, PixelOutcome::kDecoded) << pixels.detail;
}

TEST(SandboxedDecoder, LiesCostOnePhoto) {
  const size_t open_before = OpenDescriptorCount();
  {
    const Decoder decoder = StartDecoder(VEDUTA_LYING_DECODER);
    ASSERT_TRUE(decoder);
    const PhotoHeader sound = decoder->Examine(FileBytes{'s'}).header;
    EXPECT_EQ(sound.stored_size, (ImageSize{40, 30}));
    for (const char how : {'n', 'o', 't', 'r', 'm', 'x', 'v'}) {
      const FileBytes photo = {static_cast<uint8_t>(how)};
      const PhotoHeader header = decoder->Examine(photo).header;
      const Pixels pixels = decoder->DecodePixels(photo, sound);
      if (how == 'r') {  // it could not
        EXPECT_EQ(pixels.outcome, PixelOutcome::kDecoded);
        continue;
      }
      EXPECT_EQ(header.outcome, HeaderOutcome::kUnreadable) << how;
      EXPECT_EQ(pixels.outcome, PixelOutcome::kUnreadable) << how;
      EXPECT_NE(header.detail.find("the decoder"), std::string::npos) << header.detail;
      EXPECT_NE(pixels.detail.find("save it as a JPEG"), std::string::npos) << pixels.detail;
      EXPECT_TRUE(pixels.bgr.empty()) << how;
      // The next photo is none the worse for it.
      EXPECT_EQ(decoder->DecodePixels(FileBytes{'s'}, sound).outcome, PixelOutcome::kDecoded);
    }
    for (const char how : {'k', 'd', '?'}) {
      const FileBytes photo = {static_cast<uint8_t>(how)};
      EXPECT_EQ(decoder->Examine(photo).header.outcome, HeaderOutcome::kNoMemory) << how;
      EXPECT_EQ(decoder->DecodePixels(photo, sound).outcome, PixelOutcome::kNoMemory) << how;
    }
    // What it claims is bounded before memory is taken for it.
    EXPECT_EQ(Decode(*decoder, FileBytes{'c'}).outcome, DecodeOutcome::kTooLarge);
  }
  EXPECT_EQ(OpenDescriptorCount(), open_before);
  EXPECT_TRUE(ChildrenOf(getpid(), /*with_zombies=*/true).empty());
}

TEST(SandboxedDecoder, WhatIsMissingIsSaid) {
  const auto absent = SandboxedDecoder::Start("/nowhere/veduta-decoder");
  EXPECT_EQ(absent.status().code(), StatusCode::kIoError);
  EXPECT_NE(absent.status().message().find("/nowhere/veduta-decoder"), std::string::npos);
  const auto another = SandboxedDecoder::Start("/bin/true");
  EXPECT_NE(another.status().message().find("does not answer"), std::string::npos);
  EXPECT_TRUE(ChildrenOf(getpid(), /*with_zombies=*/true).empty());
}

}  // namespace
}  // namespace veduta
