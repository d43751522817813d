// SPDX-License-Identifier: Apache-2.0
#pragma once
// How far a long command is, on standard error: a bar on a terminal, a line every so often
// otherwise.

#include <chrono>
#include <cstddef>
#include <string>

namespace veduta {

class Progress {
 public:
  // `what` names the things that are counted.
  explicit Progress(size_t total, std::string what = "photos");
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // One more is done; `word` says what became of it.
  void Advance(const std::string& word);
  // `done` things are done now.
  void Set(size_t done);
  // Prints a whole line above the bar.
  void Say(const std::string& line);

 private:
  void Draw();
  void Erase();

  void Tick();

  const size_t total_;
  const std::string what_;
  size_t done_ = 0;
  const bool is_terminal_;
  std::string last_word_;
  const std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point drawn_;
};

}  // namespace veduta
