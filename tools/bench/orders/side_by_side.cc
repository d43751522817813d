// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/orders/side_by_side.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <map>

#include "tools/bench/orders/scratch_folder.h"

namespace veduta::orders {
namespace {

struct Started {
  size_t index = 0;
  ScratchFolder folder;
};

std::string Bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string LastLine(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

// In the new process; its last words go into the folder.
[[noreturn]] void RunAndExit(const PhotoOrder& order, const OrderRunner& runner,
                             const std::filesystem::path& folder) {
  const int words = open((folder / "errors").c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (words < 0 || dup2(words, STDERR_FILENO) < 0) _exit(1);
  const std::string text = RunText(runner(order, folder.string()));
  std::ofstream file(folder / "run", std::ios::binary);
  file << text;
  file.close();
  _exit(file ? 0 : 1);
}

Result<pid_t> Start(const PhotoOrder& order, const OrderRunner& runner,
                    const ScratchFolder& folder) {
  const pid_t child = fork();
  if (child < 0) return Status::IoError("cannot make a process for " + order.label);
  if (child == 0) RunAndExit(order, runner, folder.path());
  return child;
}

// What the process left, or why it left nothing.
OrderRun Collect(const PhotoOrder& order, int state, Started* started, bool keep) {
  OrderRun run;
  if (WIFEXITED(state) && WEXITSTATUS(state) == 0) {
    Result<OrderRun> parsed = ParseRun(Bytes(started->folder.path() / "run"));
    if (parsed.ok()) {
      run = std::move(*parsed);
    } else {
      run.failure = parsed.status().message();
    }
  } else {
    const std::string words = LastLine(Bytes(started->folder.path() / "errors"));
    run.failure = WIFSIGNALED(state) ? "ended by signal " + std::to_string(WTERMSIG(state))
                                     : "ended with exit code " + std::to_string(WEXITSTATUS(state));
    if (!words.empty()) run.failure += ": " + words;
  }
  run.label = order.label;
  run.photos = static_cast<uint32_t>(order.photos.size());
  if (keep) run.kept = started->folder.Keep();
  return run;
}

}  // namespace

Status RunSideBySide(std::span<const PhotoOrder> orders, const SideBySideOptions& options,
                     const OrderRunner& runner,
                     const std::function<void(size_t index, const OrderRun& run)>& done) {
  std::map<pid_t, Started> running;
  Status failure;
  size_t next = 0;
  while (!running.empty() || (failure.ok() && next < orders.size())) {
    if (failure.ok() && next < orders.size() && running.size() < options.jobs) {
      Result<ScratchFolder> folder = ScratchFolder::Make();
      const Result<pid_t> child =
          folder.ok() ? Start(orders[next], runner, *folder) : Result<pid_t>(folder.status());
      if (child.ok()) {
        running.emplace(*child, Started{next++, std::move(*folder)});
      } else {
        failure = child.status();
      }
      continue;
    }
    int state = 0;
    const pid_t ended = waitpid(-1, &state, 0);
    const auto found = running.find(ended);
    if (ended < 0) return Status::IoError("cannot wait for a process");
    if (found == running.end()) continue;  // not one of ours
    const size_t index = found->second.index;
    done(index, Collect(orders[index], state, &found->second, options.keep));
    running.erase(found);
  }
  return failure;
}

}  // namespace veduta::orders
