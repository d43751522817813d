// SPDX-License-Identifier: Apache-2.0
// Goal: the options of adding photos are sound as they stand, and every field that is moved out of
//   its bounds is named in the error with its value, however deep it lies.
// Method: a table of every bounded field of every options struct, each moved out of its bounds
//   alone.
#include "engine/ingest/ingest_options.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "engine/photo/photo_preparer.h"

namespace veduta {
namespace {

struct Violation {
  std::string name;  // as the error has it
  std::function<void(IngestOptions*)> make;
};

void AppendResection(const std::string& at,
                     const std::function<ResectionOptions&(IngestOptions*)>& in,
                     std::vector<Violation>* all) {
  const auto add = [&](const char* name, auto set) {
    all->push_back({at + name, [in, set](IngestOptions* o) { set(in(o)); }});
  };
  add("error_px_max is 0", [](ResectionOptions& o) { o.error_px_max = 0; });
  add("error_px_max is 100", [](ResectionOptions& o) { o.error_px_max = 100; });
  add("inlier_count_min is 3", [](ResectionOptions& o) { o.inlier_count_min = 3; });
  add("inlier_share_min is 1.5", [](ResectionOptions& o) { o.inlier_share_min = 1.5; });
  add("confidence is 1", [](ResectionOptions& o) { o.confidence = 1; });
  add("samples_max is 0", [](ResectionOptions& o) { o.samples_max = 0; });
}

void AppendGrowth(const std::string& at, const std::function<GrowthOptions&(IngestOptions*)>& in,
                  std::vector<Violation>* all) {
  const auto add = [&](const char* name, auto set) {
    all->push_back({at + name, [in, set](IngestOptions* o) { set(in(o)); }});
  };
  add("error_px_max is nan", [](GrowthOptions& o) { o.error_px_max = std::nan(""); });
  add("angle_deg_min is 90", [](GrowthOptions& o) { o.angle_deg_min = 90; });
  add("search_radius_px is 0", [](GrowthOptions& o) { o.search_radius_px = 0; });
  add("descriptor_distance_squared_max is 0",
      [](GrowthOptions& o) { o.descriptor_distance_squared_max = 0; });
  add("scale_ratio_max is 0.9", [](GrowthOptions& o) { o.scale_ratio_max = 0.9; });
  add("views_min is 1", [](GrowthOptions& o) { o.views_min = 1; });
  add("guided_views_min is 1", [](GrowthOptions& o) { o.guided_views_min = 1; });
  add("guided_band_px is 65", [](GrowthOptions& o) { o.guided_band_px = 65; });
  add("guided_ratio_max is 1.1", [](GrowthOptions& o) { o.guided_ratio_max = 1.1; });
}

void AppendBundle(const std::string& at, const std::function<BundleOptions&(IngestOptions*)>& in,
                  std::vector<Violation>* all) {
  const auto add = [&](const char* name, auto set) {
    all->push_back({at + name, [in, set](IngestOptions* o) { set(in(o)); }});
  };
  add("loss_scale_px is 0", [](BundleOptions& o) { o.loss_scale_px = 0; });
  add("iterations_max is 0", [](BundleOptions& o) { o.iterations_max = 0; });
  add("function_tolerance is 0", [](BundleOptions& o) { o.function_tolerance = 0; });
}

void AppendFilter(const std::string& at,
                  const std::function<PointFilterOptions&(IngestOptions*)>& in,
                  std::vector<Violation>* all) {
  const auto add = [&](const char* name, auto set) {
    all->push_back({at + name, [in, set](IngestOptions* o) { set(in(o)); }});
  };
  add("observation_error_px_max is 0",
      [](PointFilterOptions& o) { o.observation_error_px_max = 0; });
  add("point_error_px_max is -1", [](PointFilterOptions& o) { o.point_error_px_max = -1; });
  add("angle_deg_min is -1", [](PointFilterOptions& o) { o.angle_deg_min = -1; });
}

std::vector<Violation> MapperViolations() {
  std::vector<Violation> all;
  const auto add = [&](const char* name, auto set) {
    all.push_back({std::string("mapper.") + name, [set](IngestOptions* o) { set(o->mapper); }});
  };
  using M = MapperOptions;
  add("putative_ratio_max is 0", [](M& o) { o.putative_ratio_max = 0; });
  add("neighbor_match_count_min is 0", [](M& o) { o.neighbor_match_count_min = 0; });
  add("sure_inlier_count is 0", [](M& o) { o.sure_inlier_count = 0; });
  add("weak_inlier_count_min is 0", [](M& o) { o.weak_inlier_count_min = 0; });
  add("weak_inlier_share_min is 2", [](M& o) { o.weak_inlier_share_min = 2; });
  add("agreement.line_error_px_max is 0", [](M& o) { o.agreement.line_error_px_max = 0; });
  add("contradiction_share_max is 0", [](M& o) { o.contradiction_share_max = 0; });
  add("deviation_share_max is 0", [](M& o) { o.deviation_share_max = 0; });
  add("local_images_max is 1", [](M& o) { o.local_images_max = 1; });
  add("settled_images_max is 1", [](M& o) { o.settled_images_max = 1; });
  add("common_points_min is 2", [](M& o) { o.common_points_min = 2; });
  add("merge_error_px_max is 0", [](M& o) { o.merge_error_px_max = 0; });
  add("founding_views_max is 2", [](M& o) { o.founding_views_max = 2; });
  add("founding.common_points_min is 2", [](M& o) { o.founding.common_points_min = 2; });
  add("founding.angle_deg_min is 0", [](M& o) { o.founding.angle_deg_min = 0; });
  add("founding.pairs_tried_max is 0", [](M& o) { o.founding.pairs_tried_max = 0; });
  add("founding.explained_share_min is 2", [](M& o) { o.founding.explained_share_min = 2; });
  add("founding.deviation_share_max is 0", [](M& o) { o.founding.deviation_share_max = 0; });
  add("founding.network_deviation_share_max is 0",
      [](M& o) { o.founding.network_deviation_share_max = 0; });
  add("founding.twin_score_share_max is 0", [](M& o) { o.founding.twin_score_share_max = 0; });
  add("founding.rms_px_max is 0", [](M& o) { o.founding.rms_px_max = 0; });
  return all;
}

std::vector<Violation> AllViolations() {
  std::vector<Violation> all = MapperViolations();
  using O = IngestOptions;
  AppendResection(
      "mapper.resection.", [](O * o) -> auto& { return o->mapper.resection; }, &all);
  AppendResection(
      "mapper.along_neighbor.", [](O * o) -> auto& { return o->mapper.along_neighbor; }, &all);
  AppendResection(
      "mapper.founding.resection.", [](O * o) -> auto& { return o->mapper.founding.resection; },
      &all);
  AppendResection(
      "neighbors.pair.structure.", [](O * o) -> auto& { return o->neighbors.pair.structure; },
      &all);
  AppendGrowth(
      "mapper.growth.", [](O * o) -> auto& { return o->mapper.growth; }, &all);
  AppendGrowth(
      "mapper.founding.growth.", [](O * o) -> auto& { return o->mapper.founding.growth; }, &all);
  AppendBundle(
      "mapper.local_bundle.", [](O * o) -> auto& { return o->mapper.local_bundle; }, &all);
  AppendBundle(
      "mapper.global_bundle.", [](O * o) -> auto& { return o->mapper.global_bundle; }, &all);
  AppendBundle(
      "mapper.founding.bundle.", [](O * o) -> auto& { return o->mapper.founding.bundle; }, &all);
  AppendFilter(
      "mapper.filter.", [](O * o) -> auto& { return o->mapper.filter; }, &all);
  AppendFilter(
      "mapper.founding.filter.", [](O * o) -> auto& { return o->mapper.founding.filter; }, &all);
  const auto add = [&](const char* name, auto set) {
    all.push_back({name, [set](O* o) { set(*o); }});
  };
  add("schedule.views_step is 0", [](O& o) { o.schedule.views_step = 0; });
  add("schedule.submap_views_step is 0", [](O& o) { o.schedule.submap_views_step = 0; });
  add("schedule.region_images_max is 2", [](O& o) { o.schedule.region_images_max = 2; });
  add("schedule.growth_share is 0", [](O& o) { o.schedule.growth_share = 0; });
  add("schedule.long_growth_share is 0", [](O& o) { o.schedule.long_growth_share = 0; });
  add("neighbors.extended_per_image_max is 0",
      [](O& o) { o.neighbors.extended_per_image_max = 0; });
  add("neighbors.pair.ratio_max is 1.5", [](O& o) { o.neighbors.pair.ratio_max = 1.5; });
  add("neighbors.pair.distinct_count_min is 0",
      [](O& o) { o.neighbors.pair.distinct_count_min = 0; });
  add("neighbors.pair.structure_count_min is 3",
      [](O& o) { o.neighbors.pair.structure_count_min = 3; });
  add("neighbors.pair.two_view.", [](O& o) { o.neighbors.pair.two_view.error_px_max = 0; });
  add("map_images_max is 0", [](O& o) { o.map_images_max = 0; });
  add("feature_cache_bytes is 0", [](O& o) { o.feature_cache_bytes = 0; });
  add("matched_count_max is 0", [](O& o) { o.matched_count_max = 0; });
  add("matched_count_max is 65536", [](O& o) { o.matched_count_max = 65536; });
  add("thorough_count_max is 1499", [](O& o) { o.thorough_count_max = 1499; });
  add("thorough_pairs_max is 0", [](O& o) { o.thorough_pairs_max = 0; });
  add("ample_match_count is 0", [](O& o) { o.ample_match_count = 0; });
  return all;
}

TEST(IngestOptions, EveryFieldOutOfBoundsIsNamed) {
  EXPECT_TRUE(IngestOptions().Check().ok()) << IngestOptions().Check().message();
  const std::vector<Violation> all = AllViolations();
  EXPECT_GT(all.size(), 80u);
  for (const Violation& violation : all) {
    IngestOptions options;
    violation.make(&options);
    const Status status = options.Check();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << violation.name;
    EXPECT_EQ(status.message().rfind(violation.name, 0), 0u)
        << violation.name << " was expected, not: " << status.message();
  }
}

TEST(IngestOptions, TheErrorIsASentence) {
  IngestOptions options;
  options.mapper.resection.inlier_count_min = 0;
  EXPECT_EQ(options.Check().message(),
            "mapper.resection.inlier_count_min is 0, but must be 4 or more");
}

TEST(PrepareOptions, EveryFieldOutOfBoundsIsNamed) {
  EXPECT_TRUE(PrepareOptions().Check().ok());
  PrepareOptions options;
  options.feature_count_min = 0;
  EXPECT_EQ(options.Check().message(), "feature_count_min is 0, but must be 1 or more");
  options = {};
  options.border_px = -1;
  EXPECT_EQ(options.Check().message(), "border_px is -1, but must be 0 or more");
  options = {};
  options.limits.pixels_max = 0;
  EXPECT_EQ(options.Check().message().rfind("limits.pixels_max", 0), 0u);
  options = {};
  options.features.sigma = 0;
  EXPECT_EQ(options.Check().message().rfind("features.sigma", 0), 0u);
}

}  // namespace
}  // namespace veduta
