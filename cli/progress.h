// SPDX-License-Identifier: Apache-2.0
#pragma once
// How far a long command is, on standard error: a bar on a terminal, otherwise one line every few
// seconds.

#include <chrono>
#include <cstddef>
#include <map>
#include <string>

namespace veduta {

// What is known of a long command at one moment.
struct ProgressState {
  size_t done = 0, total = 0;
  double elapsed_s = 0;
  std::string what;       // the things that are counted
  std::string last_word;  // what became of the last one
};

// "3 of 12 photos, 1.50 a second, 0:06 left", without the line's end.
std::string ProgressLine(const ProgressState& state);
// "[#######...] 3/12  1.50/s  0:06 left  placed", without control characters.
std::string ProgressBar(const ProgressState& state);
// What became of all, from how often each word was told: "9 placed, 1 postponed". Empty for none.
std::string TextOfCounts(const std::map<std::string, size_t>& counts);

class Progress final {
 public:
  // `what` names the things that are counted.
  explicit Progress(size_t total, std::string what = "photos");
  // Erases the bar.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // One more is done; `word` says what became of it.
  void Advance(const std::string& word);
  // `done` things are done now.
  void Set(size_t done);
  // Prints a line of its own above the bar.
  void Say(const std::string& line);

 private:
  // Draws when the last drawing is long enough ago, and when everything is done.
  void Tick();
  void Draw();
  void Erase();

  ProgressState state_;
  const bool is_terminal_;
  const std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point drawn_;
};

}  // namespace veduta
