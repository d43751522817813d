// SPDX-License-Identifier: Apache-2.0
// Goal: groups are listed as they are joined, strongest links first; of what stays apart the
//   largest is not listed.
// Method: small graphs whose groups are known.
#include "engine/mapping/single_linkage.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

using Groups = std::vector<std::vector<uint32_t>>;

TEST(SingleLinkage, ListsTheSmallerOfEachTwoThatAreJoined) {
  const std::vector<Link> links = {{0, 1}, {1, 2}, {4, 3}, {2, 3}, {0, 4}};
  EXPECT_EQ(ListLinkedGroups(5, links), (Groups{{1}, {2}, {3}, {3, 4}}));
}

TEST(SingleLinkage, WhatStaysApartIsListedButForTheLargest) {
  const std::vector<Link> links = {{0, 1}, {2, 3}, {3, 4}};
  EXPECT_EQ(ListLinkedGroups(6, links), (Groups{{1}, {3}, {4}, {0, 1}, {5}}));
  EXPECT_EQ(ListLinkedGroups(3, {}), (Groups{{1}, {2}}));
  EXPECT_TRUE(ListLinkedGroups(1, {}).empty());
  EXPECT_TRUE(ListLinkedGroups(0, {}).empty());
}

}  // namespace
}  // namespace veduta
