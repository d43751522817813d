// SPDX-License-Identifier: Apache-2.0
#pragma once
// The processes of this machine, as tests look at them.

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace veduta::testing {

// The living children of a process; zombies are left out unless they are asked for.
inline std::vector<pid_t> ChildrenOf(pid_t parent, bool with_zombies = false) {
  std::vector<pid_t> children;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", failed)) {
    const std::string name = entry.path().filename();
    if (!std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isdigit(c); }))
      continue;
    std::ifstream file(entry.path() / "stat");
    std::string line;
    if (!std::getline(file, line)) continue;
    // PID (NAME) STATE PPID ...
    const size_t end = line.rfind(')');
    if (end == std::string::npos || end + 4 >= line.size()) continue;
    const char state = line[end + 2];
    if (std::stoi(line.substr(end + 4)) != parent) continue;
    if (with_zombies || state != 'Z') children.push_back(std::stoi(name));
  }
  return children;
}

// The descriptors that this process has open.
inline size_t OpenDescriptorCount() {
  size_t count = 0;
  for ([[maybe_unused]] const auto& open : std::filesystem::directory_iterator("/proc/self/fd"))
    ++count;
  return count;
}

}  // namespace veduta::testing
