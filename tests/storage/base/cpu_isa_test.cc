// SPDX-License-Identifier: Apache-2.0
// Goal: the widest kernels that the processor can run are called, and a limit narrows the choice.
// Method: tables of numbers in place of functions, with and without gaps, under every limit.
#include "storage/base/cpu_isa.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

namespace veduta {
namespace {

constexpr int kTable[] = {0, 1, 2, 3};
constexpr CpuVariants<int> kFull = {&kTable[0], &kTable[1], &kTable[2], &kTable[3]};

TEST(CpuIsa, EveryIsaHasAName) {
  std::set<std::string> names;
  for (const CpuIsa isa : kCpuIsas) names.insert(CpuIsaName(isa));
  EXPECT_EQ(names, (std::set<std::string>{"portable", "avx2", "avx512", "avx512vnni"}));
}

TEST(CpuIsa, LimitsNarrowTheChoiceAndNest) {
  const CpuIsa best = BestCpuIsa();
  for (const CpuIsa most : kCpuIsas) {
    const CpuIsaLimit limit(most);
    EXPECT_EQ(BestCpuIsa(), std::min(best, most));
    {
      const CpuIsaLimit narrower(CpuIsa::kPortable);
      EXPECT_EQ(BestCpuIsa(), CpuIsa::kPortable);
      const CpuIsaLimit wider(CpuIsa::kAvx512Vnni);  // a limit allows no more than those around it
      EXPECT_EQ(BestCpuIsa(), CpuIsa::kPortable);
    }
    EXPECT_EQ(BestCpuIsa(), std::min(best, most));
  }
  EXPECT_EQ(BestCpuIsa(), best);
}

TEST(CpuIsa, TheWidestKernelsThatRunAreChosen) {
  for (const CpuIsa most : kCpuIsas) {
    const CpuIsaLimit limit(most);
    EXPECT_EQ(kFull.Best(), static_cast<int>(BestCpuIsa()));
    for (const CpuIsa isa : kCpuIsas) {
      const int* found = kFull.Find(isa);
      ASSERT_EQ(found != nullptr, isa <= BestCpuIsa()) << CpuIsaName(isa);
      if (found == nullptr) continue;
      EXPECT_EQ(*found, static_cast<int>(isa));
    }
  }
}

TEST(CpuIsa, GapsFallToTheNextNarrower) {
  const CpuVariants<int> alone = {.portable = &kTable[0]};
  const CpuVariants<int> two = {.portable = &kTable[0], .avx2 = &kTable[1]};
  const CpuVariants<int> no_middle = {
      .portable = &kTable[0], .avx2 = &kTable[1], .avx512_vnni = &kTable[3]};
  for (const CpuIsa most : kCpuIsas) {
    const CpuIsaLimit limit(most);
    const CpuIsa best = BestCpuIsa();
    EXPECT_EQ(alone.Best(), 0);
    EXPECT_EQ(two.Best(), best >= CpuIsa::kAvx2 ? 1 : 0);
    EXPECT_EQ(no_middle.Best(), best == CpuIsa::kAvx512Vnni ? 3 : best >= CpuIsa::kAvx2 ? 1 : 0);
    EXPECT_EQ(no_middle.Find(CpuIsa::kAvx512), nullptr);
  }
}

}  // namespace
}  // namespace veduta
