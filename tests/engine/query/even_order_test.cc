// SPDX-License-Identifier: Apache-2.0
// Goal: the order has each value once, and each beginning of it is spread evenly over the list.
// Method: lists of numbers that ascend, of all small sizes and of some large ones; in each tenth of
//   the list the values of a beginning are counted.
#include "engine/query/even_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

namespace veduta {
namespace {

std::vector<size_t> OrderOf(size_t size) {
  std::vector<size_t> values(size);
  std::iota(values.begin(), values.end(), 0);
  return InEvenOrder(values);
}

TEST(EvenOrderTest, HasEachValueOnce) {
  for (size_t size = 0; size < 500; ++size) {
    std::vector<size_t> order = OrderOf(size);
    std::sort(order.begin(), order.end());
    ASSERT_EQ(order.size(), size);
    for (size_t i = 0; i < size; ++i) ASSERT_EQ(order[i], i) << "of " << size;
  }
}

// Products of small primes have few steps to choose from.
TEST(EvenOrderTest, EachBeginningIsSpreadEvenly) {
  for (const size_t size : {1000, 30030, 65536, 99991}) {
    const std::vector<size_t> order = OrderOf(size);
    for (const size_t count : {50UL, 117UL, 500UL, size / 3}) {
      std::array<size_t, 10> found{};
      for (size_t i = 0; i < count; ++i) ++found[10 * order[i] / size];
      const auto [least, most] = std::minmax_element(found.begin(), found.end());
      EXPECT_LE(*most - *least, 4U + count / 100) << count << " of " << size;
    }
  }
}

}  // namespace
}  // namespace veduta
