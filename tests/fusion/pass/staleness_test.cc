// SPDX-License-Identifier: Apache-2.0
// Goal: staleness tells the truth: every option that a stage of the dense pass uses is part of the
//   version of what the stage makes, and so are the numbers of the algorithms behind it.
// Method: every field of every options struct is flipped, one at a time, and the versions before
//   and after are compared. The lists of fields are structured bindings, so a new field that is not
//   in its list does not compile. Fields that are in no version stand in a table with the reason.
#include <gtest/gtest.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "fusion/pass/stage.h"
#include "storage/base/option_fields.h"

namespace veduta {
namespace {

void Flip(bool* field) {
  *field = !*field;
}
template <typename Number>
void Flip(Number* field) {
  *field = static_cast<Number>(*field + 1);
}
template <typename Number>
void Flip(std::optional<Number>* field) {
  *field = static_cast<Number>(field->value_or(3) + 1);
}
void Flip(ReconstructionId* id) {
  *id = ReconstructionId(id->value + 1);
}

size_t CountFields(const auto& options) {
  size_t count = 0;
  VisitOptionFields(options, "", [&](const std::string&, const auto&) { ++count; });
  return count;
}

// A copy of the options with the field of this index flipped; its name.
template <typename Options>
std::string FlipOne(size_t index, Options* options) {
  std::string flipped;
  size_t at = 0;
  VisitOptionFields(*options, "", [&](const std::string& name, auto& field) {
    if (at++ != index) return;
    Flip(&field);
    flipped = name;
  });
  return flipped;
}

template <typename StageOptions>
uint64_t VersionOf(const StageOptions& options) {
  return VersionFeed(options).Version();
}

template <typename StageOptions>
class StageTest : public testing::Test {};
using Stages =
    testing::Types<DepthStageOptions, CheckStageOptions, VolumeStageOptions, FusionStageOptions,
                   MeshStageOptions, ExposureStageOptions, ColorStageOptions>;
TYPED_TEST_SUITE(StageTest, Stages);

TYPED_TEST(StageTest, EveryFieldIsInTheVersion) {
  const TypeParam options;
  const uint64_t version = VersionOf(options);
  EXPECT_EQ(VersionOf(TypeParam()), version) << "equal options, equal versions";
  const size_t count = CountFields(options);
  EXPECT_GE(count, 2u);
  for (size_t i = 0; i < count; ++i) {
    TypeParam flipped = options;
    const std::string name = FlipOne(i, &flipped);
    EXPECT_NE(VersionOf(flipped), version) << TypeParam::kStage << ": " << name;
  }
  this->RecordProperty("fields_flipped", static_cast<int>(count));
  std::cout << TypeParam::kStage << ": " << count << " fields flipped\n";
}

// The same fields under one number and under the next.
template <uint32_t algorithm_version>
struct Numbered {
  static constexpr const char* kStage = "numbered";
  static constexpr std::array kAlgorithms = {algorithm_version};
  uint32_t field = 0;
};
using NumberedOne = Numbered<1>;
using NumberedTwo = Numbered<2>;
VEDUTA_OPTION_FIELDS(NumberedOne, field)
VEDUTA_OPTION_FIELDS(NumberedTwo, field)

TEST(Staleness, TheNumberOfAnAlgorithmIsInTheVersion) {
  EXPECT_NE(VersionOf(NumberedOne()), VersionOf(NumberedTwo()));
}

std::vector<uint64_t> VersionsOf(const DenseStageOptions& stages) {
  return {VersionOf(stages.depths), VersionOf(stages.checks), VersionOf(stages.volume),
          VersionOf(stages.fusion), VersionOf(stages.meshes), VersionOf(stages.exposures),
          VersionOf(stages.colors)};
}

// Fields of the door's options and of a reconstruction's settings that are in no version, and why
// no artefact can become stale by them unnoticed.
const std::map<std::string, std::string>& Reasons() {
  static const std::map<std::string, std::string> reasons = {
      {"DensifyOptions.depth_side_px", "it becomes DenseSettings.depth_side_px"},
      {"DensifyOptions.sensor_count", "it becomes DenseSettings.sensor_count"},
      {"DensifyOptions.voxel_size", "it becomes DenseSettings.voxel_size"},
      {"DensifyOptions.voxel_px", "it chooses the first DenseSettings.voxel_size"},
      {"DensifyOptions.moved_px_max",
       "it decides in every pass anew whether a depth map may stay; its bytes depend on the poses "
       "alone, which are in the version"},
      {"DensifyOptions.moved_voxels_max",
       "it decides in every pass anew whether a map stays where it was integrated; that pose is in "
       "the version"},
      {"DensifyOptions.block_pixel_count_min",
       "it chooses the allocated blocks in every pass anew; these are in the tile's version"},
      {"DensifyOptions.block_map_count_min",
       "it chooses the allocated blocks in every pass anew; these are in the tile's version"},
      {"DenseSettings.reconstruction", "it is in the key of every artefact"},
  };
  return reasons;
}

TEST(Staleness, WhatAPersonCanAskForReachesAVersionOrHasAReason) {
  const DensifyOptions options;
  const DenseSettings settings{ReconstructionId(1), 0.1, 512, 2};
  const std::vector<uint64_t> versions = VersionsOf(StageOptionsOf(options, settings));
  size_t with_reason = 0;
  const auto expect = [&](const std::string& name, const std::vector<uint64_t>& flipped) {
    const bool has_reason = Reasons().contains(name);
    with_reason += has_reason;
    EXPECT_EQ(flipped == versions, has_reason) << name;
  };
  for (size_t i = 0; i < CountFields(options); ++i) {
    DensifyOptions flipped = options;
    const std::string name = "DensifyOptions." + FlipOne(i, &flipped);
    expect(name, VersionsOf(StageOptionsOf(flipped, settings)));
  }
  for (size_t i = 0; i < CountFields(settings); ++i) {
    DenseSettings flipped = settings;
    const std::string name = "DenseSettings." + FlipOne(i, &flipped);
    expect(name, VersionsOf(StageOptionsOf(options, flipped)));
  }
  EXPECT_EQ(with_reason, Reasons().size()) << "a reason names a field that is not there";
}

TEST(Staleness, TheToleranceAndTheAllocationReachTheStages) {
  DensifyOptions options;
  options.moved_px_max = 1.5, options.moved_voxels_max = 2.5;
  options.block_pixel_count_min = 3, options.block_map_count_min = 4;
  const DenseStageOptions stages = StageOptionsOf(options, {ReconstructionId(1), 0.1, 512, 2});
  EXPECT_EQ(stages.tolerance.moved_px_max, 1.5);
  EXPECT_EQ(stages.tolerance.moved_voxels_max, 2.5);
  EXPECT_EQ(stages.allocation.block_pixel_count_min, 3u);
  EXPECT_EQ(stages.allocation.block_map_count_min, 4u);
}

TEST(OptionFields, AreNamedInOrder) {
  std::vector<std::string> names;
  const CheckStageOptions options;
  VisitOptionFields(options, "",
                    [&](const std::string& name, const auto&) { names.push_back(name); });
  ASSERT_EQ(names.size(), 12u);
  EXPECT_EQ(names.front(), "neighbor_count");
  EXPECT_EQ(names[1], "neighbors.overlap_min");
  EXPECT_EQ(names.back(), "grid.truncation_voxels");
}

}  // namespace
}  // namespace veduta
