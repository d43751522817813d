// SPDX-License-Identifier: Apache-2.0
#include "cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace veduta {
namespace {

using Clock = std::chrono::steady_clock;

std::string Duration(double seconds) {
  const long s = std::lround(seconds);
  char text[32];
  if (s < 3600) {
    std::snprintf(text, sizeof(text), "%ld:%02ld", s / 60, s % 60);
  } else {
    std::snprintf(text, sizeof(text), "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
  }
  return text;
}

}  // namespace

Progress::Progress(size_t total, std::string what)
    : total_(total),
      what_(std::move(what)),
      is_terminal_(isatty(STDERR_FILENO)),
      start_(Clock::now()),
      drawn_(start_) {}

Progress::~Progress() {
  Erase();
}

void Progress::Erase() {
  if (is_terminal_) std::fprintf(stderr, "\r\033[K");
}

void Progress::Say(const std::string& line) {
  Erase();
  std::fprintf(stderr, "%s\n", line.c_str());
  if (is_terminal_) Draw();
}

void Progress::Advance(const std::string& word) {
  ++done_;
  last_word_ = word;
  Tick();
}

void Progress::Set(size_t done) {
  done_ = done;
  last_word_ = what_;
  Tick();
}

void Progress::Tick() {
  const auto now = Clock::now();
  const auto pause = is_terminal_ ? std::chrono::milliseconds(100) : std::chrono::seconds(5);
  if (now - drawn_ < pause && done_ != total_) return;
  drawn_ = now;
  Draw();
}

void Progress::Draw() {
  const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
  const double rate = elapsed > 0 ? static_cast<double>(done_) / elapsed : 0;
  const std::string left = rate > 0 ? Duration(static_cast<double>(total_ - done_) / rate) : "?";
  if (!is_terminal_) {
    std::fprintf(stderr, "%zu of %zu %s, %.2f a second, %s left\n", done_, total_, what_.c_str(),
                 rate, left.c_str());
    return;
  }
  constexpr size_t kWidth = 30;
  const size_t filled = total_ ? kWidth * done_ / total_ : kWidth;
  std::fprintf(stderr, "\r\033[K[%s%s] %zu/%zu  %.2f/s  %s left  %s",
               std::string(filled, '#').c_str(), std::string(kWidth - filled, '.').c_str(), done_,
               total_, rate, left.c_str(), last_word_.c_str());
  std::fflush(stderr);
}

}  // namespace veduta
