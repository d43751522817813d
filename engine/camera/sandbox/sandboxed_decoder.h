// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos are decoded in other processes, which can do nothing but compute (process/lockdown.h), one
// for each photo. Whatever a photo does to the libraries that read it, it ends its process at most.

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/camera/decoder.h"
#include "engine/camera/sandbox/decoder_connection.h"

namespace veduta {

// A photo on which its process ends, or takes too long or too much memory, or gives an answer that
// no sound decoder gives, is kUnreadable, and the detail says so. Where the process was killed from
// outside (SIGKILL: by the system where memory is short, or by a person), a second one tries it;
// the outcome is kNoMemory where that is killed, too, or where no process can be started. So the
// outcomes are those of DecoderInProcess, but for photos on which that would end the program.
//
// One decoder process waits for each thread that decodes at the same time, as nice as the thread
// that it was started for, and is kept for the next one.
class SandboxedDecoder final : public PhotoDecoder {
 public:
  // `program` is the path of `veduta-decoder`. It is opened once, so that one that is installed
  // later is not mixed with this one. Starts a first process. kIoError says what is missing: the
  // program, or what the system must be able to do.
  static Result<std::shared_ptr<const SandboxedDecoder>> Start(const std::string& program);

  PhotoExamination Examine(std::span<const uint8_t> bytes) const override;
  Pixels DecodePixels(std::span<const uint8_t> bytes, const PhotoHeader& header) const override;
  uint64_t HandoverBytes(uint64_t size_bytes, uint64_t pixel_count) const override;
  DecoderDeaths deaths() const override { return {died_, killed_}; }

 private:
  explicit SandboxedDecoder(Descriptor program) : program_(std::move(program)) {}

  enum class Fate : uint8_t { kAnswered, kDied, kNotDone };
  struct Asked {
    Fate fate = Fate::kNotDone;
    std::string why_not;  // for a person; empty where kAnswered
    DecoderAnswer answer;
    std::optional<MappedMemory> memory;  // of the answer; there where kAnswered
  };
  Asked Ask(DecoderRequest request, std::span<const uint8_t> photo) const;
  // How a child ended that nobody has killed from outside; a second one has a chance where one was.
  // kNoMemory, kIoError.
  Result<DecoderEnd> Run(const DecoderRequest& request, int photo, int answer) const;
  // One that waits, or a new one.
  Result<std::unique_ptr<DecoderConnection>> Take() const;
  void GiveBack(std::unique_ptr<DecoderConnection> connection) const;

  const Descriptor program_;
  mutable std::atomic<uint64_t> died_ = 0, killed_ = 0;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<DecoderConnection>> waiting_;
};

}  // namespace veduta
