// SPDX-License-Identifier: Apache-2.0
// Goal: parts are within their bound and hold every image once; a street is cut across and not
//   along, a loop in two arcs; what no edge holds together is parted all the same; the order of the
//   edges does not matter.
// Method: a street, a loop, two towns with a bridge, and random graphs from seeds.
#include "engine/mapping/view_graph_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

std::vector<ImageId> Ids(uint32_t count) {
  std::vector<ImageId> ids;
  for (uint32_t i = 1; i <= count; ++i) ids.push_back(ImageId(i));
  return ids;
}

// Each image sees what the next three see, the nearer the more.
std::vector<ViewGraphEdge> StreetEdges(uint32_t count) {
  std::vector<ViewGraphEdge> edges;
  for (uint32_t i = 1; i <= count; ++i) {
    for (uint32_t j = i + 1; j <= std::min(i + 3, count); ++j)
      edges.push_back({ImageId(i), ImageId(j), 400 / (j - i)});
  }
  return edges;
}

using Parts = std::vector<std::vector<ImageId>>;

void ExpectPartition(const Parts& parts, std::span<const ImageId> images, size_t images_max) {
  std::vector<ImageId> all;
  for (const std::vector<ImageId>& part : parts) {
    EXPECT_FALSE(part.empty());
    EXPECT_LE(part.size(), images_max);
    EXPECT_TRUE(std::ranges::is_sorted(part));
    all.insert(all.end(), part.begin(), part.end());
  }
  EXPECT_TRUE(
      std::ranges::is_sorted(parts, {}, [](const std::vector<ImageId>& p) { return p.front(); }));
  std::ranges::sort(all);
  EXPECT_TRUE(std::ranges::equal(all, images));
}

TEST(ViewGraphParts, AStreetIsCutAcross) {
  const std::vector<ImageId> images = Ids(80);
  std::vector<ViewGraphEdge> edges = StreetEdges(80);
  const Parts parts = PartViewGraph(images, edges, 20);
  ExpectPartition(parts, images, 20);
  ASSERT_EQ(parts.size(), 4u);
  for (const std::vector<ImageId>& part : parts) {
    EXPECT_EQ(part.size(), 20u);
    EXPECT_EQ(part.back().value - part.front().value, 19u) << "one piece of the street";
  }
  std::ranges::reverse(edges);
  for (ViewGraphEdge& edge : edges) std::swap(edge.a, edge.b);
  EXPECT_EQ(PartViewGraph(images, edges, 20), parts);
}

TEST(ViewGraphParts, ALoopIsCutInTwoArcs) {
  const std::vector<ImageId> images = Ids(60);
  std::vector<ViewGraphEdge> edges = StreetEdges(60);
  edges.push_back({ImageId(1), ImageId(60), 400});
  const Parts parts = PartViewGraph(images, edges, 30);
  ExpectPartition(parts, images, 30);
  ASSERT_EQ(parts.size(), 2u);
  // Going round, one leaves each part once.
  int leavings = 0;
  for (uint32_t i = 0; i < 60; ++i) {
    const bool here = std::ranges::binary_search(parts[0], ImageId(i + 1));
    leavings += here && !std::ranges::binary_search(parts[0], ImageId((i + 1) % 60 + 1));
  }
  EXPECT_EQ(leavings, 1);
}

TEST(ViewGraphParts, ABridgeIsCut) {
  const std::vector<ImageId> images = Ids(40);
  std::vector<ViewGraphEdge> edges;
  for (uint32_t i = 1; i <= 40; ++i) {
    for (uint32_t j = i + 1; j <= 40; ++j) {
      if ((i <= 20) == (j <= 20)) edges.push_back({ImageId(i), ImageId(j), 100});
    }
  }
  edges.push_back({ImageId(20), ImageId(21), 1});
  const Parts parts = PartViewGraph(images, edges, 39);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0], Ids(20));
}

TEST(ViewGraphParts, WhatNothingHoldsTogetherIsPartedToo) {
  const std::vector<ImageId> images = Ids(10);
  ExpectPartition(PartViewGraph(images, {}, 3), images, 3);
  const ViewGraphEdge strange[] = {{ImageId(2), ImageId(99), 5}, {ImageId(3), ImageId(3), 5}};
  ExpectPartition(PartViewGraph(images, strange, 1), images, 1);
  EXPECT_TRUE(PartViewGraph({}, strange, 3).empty());
  EXPECT_EQ(PartViewGraph(images, {}, 10), Parts{images});
}

TEST(ViewGraphParts, HoldOnRandomGraphs) {
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    SeededRandom random(seed);
    const auto images = Ids(1 + static_cast<uint32_t>(random.Unit() * 200));
    std::vector<ViewGraphEdge> edges;
    for (size_t e = 0; e < 2 * images.size(); ++e) {
      const auto pick = [&] {
        return images[static_cast<size_t>(random.Unit() * static_cast<double>(images.size()))];
      };
      const ImageId a = pick(), b = pick();
      edges.push_back({a, b, 1 + static_cast<uint32_t>(random.Unit() * 100)});
    }
    const size_t images_max = 1 + static_cast<size_t>(random.Unit() * 40);
    ExpectPartition(PartViewGraph(images, edges, images_max), images, images_max);
  }
}

}  // namespace
}  // namespace veduta
