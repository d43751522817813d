// SPDX-License-Identifier: Apache-2.0
// Goal: the cache never exceeds its cost but by one entry, gives up the least recently used first,
//   makes a value once, and forgets nothing that fits.
// Method: small sequences with known ends; then random operations beside a plain list that is
//   searched; then several threads at once, for ThreadSanitizer.
#include "storage/base/lru_cache.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

using Kept = std::shared_ptr<const int>;
using Cache = LruCache<int, Kept>;

Kept Of(int number) {
  return std::make_shared<const int>(number);
}

TEST(LruCache, GivesUpTheLeastRecentlyUsedFirst) {
  Cache cache(3);
  for (int i = 1; i <= 3; ++i) cache.Put(i, Of(i), 1);
  ASSERT_TRUE(cache.Find(1));  // now 2 is the oldest
  cache.Put(4, Of(4), 1);
  EXPECT_FALSE(cache.Find(2));
  for (const int i : {1, 3, 4}) EXPECT_EQ(*cache.Find(i), i);
  EXPECT_EQ(cache.cost(), 3u);
}

TEST(LruCache, TheNewestStaysHoweverLarge) {
  Cache cache(3);
  cache.Put(1, Of(1), 1);
  cache.Put(2, Of(2), 100);
  EXPECT_FALSE(cache.Find(1));
  EXPECT_TRUE(cache.Find(2));
  cache.Put(3, Of(3), 1);
  EXPECT_FALSE(cache.Find(2));
  EXPECT_EQ(cache.cost(), 1u);
}

TEST(LruCache, TheFirstValueOfAKeyStays) {
  Cache cache(3);
  cache.Put(1, Of(10), 1);
  cache.Put(1, Of(11), 1);
  EXPECT_EQ(*cache.Find(1), 10);
  EXPECT_EQ(cache.size(), 1u);
  cache.Erase(1);
  cache.Erase(1);
  EXPECT_EQ(cache.cost(), 0u);
  cache.Put(2, Of(2), 1);
  cache.Clear();
  EXPECT_FALSE(cache.Find(2));
}

TEST(LruCache, MakesOnceAndKeepsNoError) {
  Cache cache(10);
  int made = 0;
  const auto cost = [](const Kept&) { return uint64_t{1}; };
  const auto fail = [&]() -> Result<Kept> {
    ++made;
    return Status::IoError("no");
  };
  EXPECT_FALSE(cache.GetOrMake(1, fail, cost).ok());
  EXPECT_FALSE(cache.GetOrMake(1, fail, cost).ok());
  EXPECT_EQ(made, 2);
  const auto make = [&]() -> Result<Kept> {
    ++made;
    return Of(7);
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(**cache.GetOrMake(1, make, cost), 7);
  EXPECT_EQ(made, 3);
}

TEST(LruCache, AgreesWithAPlainList) {
  constexpr uint64_t kCostMax = 20;
  Cache cache(kCostMax);
  std::vector<std::pair<int, uint64_t>> list;  // the most recently used first
  SeededRandom random(5);
  for (int step = 0; step < 5000; ++step) {
    const int key = static_cast<int>(random.Unit() * 12);
    const auto at = std::find_if(list.begin(), list.end(), [&](auto& e) { return e.first == key; });
    if (random.Unit() < 0.5) {
      ASSERT_EQ(cache.Find(key) != nullptr, at != list.end()) << "step " << step;
      if (at != list.end()) std::rotate(list.begin(), at, at + 1);
    } else {
      const uint64_t cost = 1 + static_cast<uint64_t>(random.Unit() * 6);
      cache.Put(key, Of(key), cost);
      if (at == list.end()) list.insert(list.begin(), {key, cost});
      const auto sum = [&] {
        uint64_t all = 0;
        for (const auto& entry : list) all += entry.second;
        return all;
      };
      while (sum() > kCostMax && list.size() > 1) list.pop_back();
      ASSERT_EQ(cache.cost(), sum()) << "step " << step;
    }
    ASSERT_EQ(cache.size(), list.size());
  }
}

TEST(LruCache, OnThreads) {
  Cache cache(8);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&cache, t] {
      for (int i = 0; i < 2000; ++i) {
        const int key = (i * 7 + t) % 16;
        const auto got = cache.GetOrMake(
            key, [&]() -> Result<Kept> { return Of(key); }, [](const Kept&) { return 1u; });
        ASSERT_TRUE(got.ok());
        ASSERT_EQ(**got, key);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_LE(cache.cost(), 8u);
}

}  // namespace
}  // namespace veduta
