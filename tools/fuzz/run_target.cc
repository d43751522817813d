// SPDX-License-Identifier: Apache-2.0
// Runs a fuzz target. Where libFuzzer does not (VEDUTA_LIBFUZZER), this runs it on its seeds, and
// on mutations of them that follow from the seeds alone, so that a failure comes again:
//        veduta-fuzz-TARGET RUNS SECONDS   (whichever ends first)
//        veduta-fuzz-TARGET FILE           (one input, such as libFuzzer leaves behind)
// An input that crashes is left in the current folder, as veduta-fuzz-crash.
// libFuzzer gets its seeds as files: where the environment's VEDUTA_FUZZ_SEEDS names a folder, the
// target writes them into it and ends.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "storage/base/content_hash.h"
#include "tools/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerInitialize(int* /*count*/, char*** /*arguments*/) {
  const char* folder = std::getenv("VEDUTA_FUZZ_SEEDS");
  if (folder == nullptr) return 0;
  std::filesystem::create_directories(folder);
  size_t number = 0;
  for (const std::string& seed : veduta::fuzz::Seeds()) {
    const auto path = std::filesystem::path(folder) / ("seed" + std::to_string(number++));
    std::ofstream file(path, std::ios::binary);
    file << seed;
    veduta::fuzz::Expect(file.good(), "the folder of seeds can be written");
  }
  std::exit(0);
}

#ifndef VEDUTA_LIBFUZZER

namespace {

using veduta::SeededRandom;

// Lengths and counts of little- and big-endian formats where overflow is near.
constexpr uint8_t kEdges[] = {0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFF};

void MutateOnce(SeededRandom* random, const std::string& other, std::string* bytes) {
  const auto size = static_cast<uint32_t>(bytes->size());
  if (size == 0) {
    bytes->push_back(static_cast<char>(random->Next()));
    return;
  }
  // Headers are where the decisions are: half of the changes go there.
  const uint32_t at = random->Below(random->Below(2) == 0 ? size : std::min(size, 64u));
  const uint32_t count = 1 + random->Below(std::min(size - at, 16u));
  switch (random->Below(7)) {
    case 0:
      (*bytes)[at] = static_cast<char>(random->Next());
      break;
    case 1:
      (*bytes)[at] = static_cast<char>((*bytes)[at] ^ (1 << random->Below(8)));
      break;
    case 2:
      std::fill_n(bytes->begin() + at, count, static_cast<char>(kEdges[random->Below(6)]));
      break;
    case 3:
      bytes->erase(at, count);
      break;
    case 4:
      bytes->insert(at, bytes->substr(random->Below(size), count));
      break;
    case 5:
      bytes->resize(at);
      break;
    default:
      bytes->replace(at, count,
                     other.substr(random->Below(1 + static_cast<uint32_t>(other.size())), count));
      break;
  }
}

const std::vector<uint8_t>* running = nullptr;

void KeepInput(int signal_number) {
  const int file = open("veduta-fuzz-crash", O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const ssize_t written = write(file, running->data(), running->size());
  std::signal(signal_number, SIG_DFL);
  if (written >= 0) std::raise(signal_number);
}

void Run(const std::string& input) {
  // A buffer of just this size, so that a sanitizer sees a read past the end.
  const std::vector<uint8_t> bytes(input.begin(), input.end());
  running = &bytes;
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
}

int RunFile(const char* path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    std::fprintf(stderr, "cannot open %s\n", path);
    return 1;
  }
  Run({std::istreambuf_iterator<char>(file), {}});
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  if (count == 2) return RunFile(arguments[1]);
  if (count != 3) {
    std::fprintf(stderr, "usage: %s RUNS SECONDS | FILE\n", arguments[0]);
    return 2;
  }
  const long runs = std::atol(arguments[1]);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(std::atol(arguments[2]));
  for (const int number : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL})
    std::signal(number, KeepInput);
  const std::vector<std::string> seeds = veduta::fuzz::Seeds();
  for (const std::string& seed : seeds) Run(seed);
  Run("");
  SeededRandom random(1);
  long done = 0;
  for (; done < runs && std::chrono::steady_clock::now() < end; ++done) {
    const auto seed_count = static_cast<uint32_t>(seeds.size());
    std::string input = seeds[random.Below(seed_count)];
    const std::string& other = seeds[random.Below(seed_count)];
    const uint32_t mutations = 1 + random.Below(6);
    for (uint32_t i = 0; i < mutations; ++i) MutateOnce(&random, other, &input);
    Run(input);
  }
  std::printf("%zu seeds, %ld mutations\n", seeds.size(), done);
  return 0;
}

#endif
