// SPDX-License-Identifier: Apache-2.0
// Goal: standard output carries what PrintLine, PrintJson and PrintBytes print and nothing else;
//   a failure to write is remembered with its cause.
// Method: child processes whose standard output and standard error are files, /dev/full or closed;
//   in between they print as a careless library would.
#include "cli/output.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <sstream>

namespace veduta {
namespace {

struct Child {
  int exit_code = -1;
  std::string out, err;
};

// Empty for what is no file: one could read from /dev/full for ever.
std::string ReadAll(const std::string& path) {
  std::stringstream text;
  if (!std::filesystem::is_regular_file(path)) return "";
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// Runs `body` in a process of its own; its result is the exit code. Empty paths: closed.
Child RunChild(const std::string& out, const std::string& err, const std::function<int()>& body) {
  std::fflush(stdout);  // or the child would print what this process has not printed yet
  const pid_t child = fork();
  if (child == 0) {
    for (const auto& [path, number] : {std::pair(out, STDOUT_FILENO), {err, STDERR_FILENO}}) {
      close(number);
      if (path.empty()) continue;
      const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      if (file == number) continue;
      dup2(file, number);
      close(file);
    }
    const int code = body();
    std::fflush(stdout);
    _exit(code);
  }
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadAll(out), ReadAll(err)};
}

class Output : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = testing::TempDir() + "veduta_output_" + std::to_string(getpid());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string File(const char* name) const { return folder_ + "/" + name; }

 private:
  std::string folder_;
};

TEST_F(Output, IsResultsAlone) {
  const Child child = RunChild(File("out"), File("err"), [] {
    KeepOutputForResults();
    std::printf("CHOLMOD warning: not positive definite\n");
    PrintLine("%s is %d", "one", 1);
    std::cout << "another library" << std::endl;
    PrintJson(Json::object({{"two", 2}}));
    PrintBytes("three");
    return OutputStatus().ok() ? 0 : 1;
  });
  EXPECT_EQ(child.exit_code, 0);
  EXPECT_EQ(child.out, "one is 1\n{\"two\":2}\nthree");
  EXPECT_NE(child.err.find("not positive definite"), std::string::npos);
  EXPECT_NE(child.err.find("another library"), std::string::npos);
}

TEST_F(Output, EachLineReachesTheReaderAtOnce) {
  const Child child = RunChild(File("out"), File("err"), [this] {
    KeepOutputForResults();
    PrintLine("acknowledged");
    return ReadAll(File("out")) == "acknowledged\n" ? 0 : 1;
  });
  EXPECT_EQ(child.exit_code, 0);
}

TEST_F(Output, TellsWhyItCouldNotBeWritten) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no device that is always full";
  const std::function<void()> prints[] = {[] { PrintLine("x"); }, [] { PrintJson(Json(1)); },
                                          [] { PrintBytes("x"); }};
  for (const auto& print : prints) {
    const Child child = RunChild("/dev/full", File("err"), [&] {
      KeepOutputForResults();
      if (!OutputStatus().ok()) return 2;
      print();
      print();
      std::fprintf(stderr, "%s", OutputStatus().message().c_str());
      return OutputStatus().code() == StatusCode::kIoError ? 0 : 1;
    });
    EXPECT_EQ(child.exit_code, 0);
    EXPECT_EQ(child.err, "cannot write to standard output: No space left on device");
  }
}

TEST_F(Output, ClosedIsAFailureToo) {
  const Child child = RunChild("", File("err"), [] {
    KeepOutputForResults();
    PrintLine("x");
    PrintBytes("x");
    return OutputStatus().code() == StatusCode::kIoError ? 0 : 1;
  });
  EXPECT_EQ(child.exit_code, 0);
}

TEST_F(Output, StandardErrorMayBeClosed) {
  const Child child = RunChild(File("out"), "", [this] {
    KeepOutputForResults();
    // The next file must not get the number that a careless library prints to.
    const int file = open(File("data").c_str(), O_WRONLY | O_CREAT, 0600);
    std::printf("noise\n");
    std::fflush(stdout);
    PrintLine("result");
    return file > STDERR_FILENO && OutputStatus().ok() ? 0 : 1;
  });
  EXPECT_EQ(child.exit_code, 0);
  EXPECT_EQ(child.out, "result\n");
  EXPECT_EQ(ReadAll(File("data")), "");
}

}  // namespace
}  // namespace veduta
