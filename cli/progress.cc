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

// Chosen by hand, not measured: a bar that moves, and a log that stays short.
constexpr std::chrono::milliseconds kBarPause(100), kLinePause(5000);
constexpr size_t kBarWidth = 30;  // characters; a bar with its numbers fits 80 columns

std::string DurationText(double seconds) {
  const long s = std::lround(seconds);
  char text[32];
  if (s < 3600) {
    std::snprintf(text, sizeof(text), "%ld:%02ld", s / 60, s % 60);
  } else {
    std::snprintf(text, sizeof(text), "%ld:%02ld:%02ld", s / 3600, s / 60 % 60, s % 60);
  }
  return text;
}

double RateOf(const ProgressState& state) {
  return state.elapsed_s > 0 ? static_cast<double>(state.done) / state.elapsed_s : 0;
}

// "0:06", or "?" as long as nothing is done.
std::string LeftText(const ProgressState& state) {
  const double rate = RateOf(state);
  if (rate == 0) return "?";
  const size_t left = state.total - std::min(state.done, state.total);
  return DurationText(static_cast<double>(left) / rate);
}

}  // namespace

std::string ProgressLine(const ProgressState& state) {
  char numbers[64];
  std::snprintf(numbers, sizeof(numbers), "%zu of %zu ", state.done, state.total);
  char rate[32];
  std::snprintf(rate, sizeof(rate), ", %.2f a second, ", RateOf(state));
  return numbers + state.what + rate + LeftText(state) + " left";
}

std::string ProgressBar(const ProgressState& state) {
  const size_t filled = state.done < state.total ? kBarWidth * state.done / state.total : kBarWidth;
  char numbers[96];
  std::snprintf(numbers, sizeof(numbers), "] %zu/%zu  %.2f/s  ", state.done, state.total,
                RateOf(state));
  return "[" + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + numbers +
         LeftText(state) + " left  " + state.last_word;
}

std::string TextOfCounts(const std::map<std::string, size_t>& counts) {
  std::string text;
  for (const auto& [word, count] : counts)
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + word;
  return text;
}

Progress::Progress(size_t total, std::string what)
    : state_{0, total, 0, std::move(what), ""},
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
  ++state_.done;
  state_.last_word = word;
  Tick();
}

void Progress::Set(size_t done) {
  state_.done = done;
  state_.last_word = state_.what;
  Tick();
}

void Progress::Tick() {
  const auto now = Clock::now();
  if (now - drawn_ < (is_terminal_ ? kBarPause : kLinePause) && state_.done != state_.total) return;
  drawn_ = now;
  Draw();
}

void Progress::Draw() {
  state_.elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count();
  if (!is_terminal_) {
    std::fprintf(stderr, "%s\n", ProgressLine(state_).c_str());
    return;
  }
  Erase();
  std::fprintf(stderr, "%s", ProgressBar(state_).c_str());
  std::fflush(stderr);
}

}  // namespace veduta
