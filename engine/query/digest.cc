// SPDX-License-Identifier: Apache-2.0
#include "engine/query/digest.h"

#include "storage/base/content_feed.h"

namespace veduta {
namespace {

void Add(const CameraRecord& camera, ContentFeed* feed) {
  const CameraModel& m = camera.model;
  *feed << camera.id << camera.name << m.width_px << m.height_px << m.fx << m.fy << m.cx << m.cy
        << m.k1 << m.k2 << m.u0 << m.v0;
  if (!camera.refined_from) return;
  const CameraModel& from = *camera.refined_from;
  *feed << from.fx << from.fy << from.k1 << from.k2;
}

void Add(const GeoPosition& position, ContentFeed* feed) {
  *feed << position.latitude_deg << position.longitude_deg << position.height_m;
}

void Add(const Sim3& s, ContentFeed* feed) {
  *feed << s.scale << s.rotation << s.translation;
}

void Add(const FitTally& tally, ContentFeed* feed) {
  *feed << tally.used << tally.agreeing << tally.error_m;
}

void Add(const Georeference& georeference, ContentFeed* feed) {
  *feed << georeference.version << georeference.images_at_look << georeference.images_at_adjustment;
  if (!georeference.place) return;
  const EarthPlace& place = *georeference.place;
  Add(place.origin, feed);
  Add(place.enu_from_world, feed);
  *feed << place.pivot;
  for (const double number : place.covariance) *feed << number;
  Add(place.fixes, feed);
  Add(place.ground_points, feed);
}

void Add(const GroundPoint& point, ContentFeed* feed) {
  *feed << point.name;
  Add(point.position, feed);
  *feed << point.deviation_m << static_cast<uint64_t>(point.sightings.size());
  for (const GroundSighting& sighting : point.sightings)
    *feed << sighting.image << sighting.x_px << sighting.y_px;
}

void Add(const ImageRecord& image, ContentFeed* feed) {
  *feed << image.id << image.name << image.photo << image.camera << image.width_px
        << image.height_px << image.size_bytes << image.feature_count << image.contributor
        << image.verdict << image.reason << image.detail;
  if (!image.gps) return;
  const GpsFix& gps = *image.gps;
  Add(GeoPosition{gps.latitude_deg, gps.longitude_deg, gps.height_m.value_or(0)}, feed);
  *feed << gps.height_m.has_value() << gps.accuracy_m;
  if (gps.heading_deg) *feed << *gps.heading_deg;
}

void Add(const ReconstructionRecord& record, ContentFeed* feed) {
  *feed << record.id << record.merged_into << record.merged_from_this.scale
        << record.merged_from_this.rotation << record.merged_from_this.translation
        << record.image_count << record.point_count << record.observation_count
        << record.images_at_adjustment;
  // Only where it is so: databases from before there were any keep their digests.
  if (record.is_dissolved) *feed << record.is_dissolved;
  if (record.georeference.version > 0 || record.georeference.images_at_look > 0)
    Add(record.georeference, feed);
}

void Add(const PointBlock& block, ContentFeed* feed) {
  *feed << block.home << block.next_ordinal << static_cast<uint64_t>(block.points.size());
  for (const PointRecord& point : block.points) {
    *feed << point.id << point.position << point.rgb[0] << point.rgb[1] << point.rgb[2]
          << point.error_px << static_cast<uint64_t>(point.track.size());
    for (const TrackElement& element : point.track) *feed << element.image << element.feature;
  }
}

// Without the time of the judgment.
void Add(const HypothesisRecord& record, ContentFeed* feed) {
  *feed << record.a << record.b << record.kind << record.reason << record.a_from_b.scale
        << record.a_from_b.rotation << record.a_from_b.translation << record.common_point_count
        << record.agreeing_pairs << record.contradicting_pairs << record.agreeing_matches
        << record.contradicting_matches << record.judged_cells << record.missing_cells
        << record.image << record.judgment_count << record.is_due
        << static_cast<uint64_t>(record.images.size());
  for (const ImageId image : record.images) *feed << image;
  for (const ImageId image : record.unsure) *feed << image;
  if (record.loop_images > 0) *feed << record.loop_images;
}

void Add(const SubmapRecord& record, ContentFeed* feed) {
  *feed << record.id.value << record.reconstruction << record.images_at_adjustment
        << static_cast<uint64_t>(record.images.size());
  for (const ImageId image : record.images) *feed << image;
  if (record.motion)
    *feed << record.motion->scale << record.motion->rotation << record.motion->translation;
}

void Add(const SubmapBorder& border, ContentFeed* feed) {
  *feed << border.id.value << static_cast<uint64_t>(border.views.size());
  for (const BorderView& view : border.views)
    *feed << view.tie << view.image << view.x_px << view.y_px;
  for (const BorderEvidence& row : border.evidence) {
    *feed << row.a << row.b << row.shared_points << row.agreeing_matches
          << row.contradicting_matches << row.turned_matches;
  }
  for (const BorderFragment& row : border.fragments) *feed << row.image << row.head;
}

// What may be placed follows from it; who said so, when and why does not matter.
void Add(const ForbiddenRecord& record, ContentFeed* feed) {
  *feed << record.kind << record.a << record.b;
}

Status AddImage(const Snapshot& snapshot, const ImageRecord& image, uint32_t generation,
                ContentFeed* feed) {
  Add(image, feed);
  if (image.verdict == Verdict::kRejected) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const StoredBytes photo, snapshot.GetPhoto(image.photo));
  *feed << HashContent(photo.bytes());
  VEDUTA_ASSIGN_OR_RETURN(const Features features, snapshot.GetFeatures(image.photo));
  for (const Keypoint& k : features.keypoints)
    *feed << k.x_px << k.y_px << k.scale_px << k.angle_deg << k.response << k.contrast_sign;
  *feed << HashContent(features.descriptors);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                          snapshot.ListNeighbors(image.id));
  for (const PairNeighbor& neighbor : neighbors) {
    if (neighbor.image < image.id) continue;
    VEDUTA_ASSIGN_OR_RETURN(const PairRecord pair, snapshot.GetPair(image.id, neighbor.image));
    *feed << pair.a << pair.b << pair.geometry << pair.b_from_a
          << static_cast<uint64_t>(pair.matches.size());
    // A pair of an older program keeps the digest that this gave.
    if (pair.lens_a.focal_px != 0) *feed << pair.lens_a.focal_px << pair.lens_b.focal_px;
    for (const PairLens& lens : {pair.lens_a, pair.lens_b}) {
      if (lens.k1 != 0 || lens.k2 != 0) *feed << lens.k1 << lens.k2;
    }
    for (const FeatureMatch& match : pair.matches) *feed << match.a << match.b;
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                          snapshot.GetObservations(image.id));
  for (const Observation& observation : observations)
    *feed << observation.feature << observation.point;
  if (generation != 0) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words,
                            snapshot.GetWords(generation, image.id));
    *feed << static_cast<uint64_t>(words.size());
    for (const WordId word : words) *feed << word;
  }
  return Status::Ok();
}

// Hypotheses, submaps, what people have forbidden and what they have surveyed.
Status AddFacts(const Snapshot& snapshot, ContentFeed* feed) {
  // What is judged anew follows from these. A city without any has the digest that it had before
  // there were hypotheses.
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> hypotheses,
                          snapshot.ListHypotheses());
  if (!hypotheses.empty()) *feed << static_cast<uint64_t>(hypotheses.size());
  for (const HypothesisRecord& hypothesis : hypotheses) Add(hypothesis, feed);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<SubmapRecord> submaps, snapshot.ListSubmaps());
  for (const SubmapRecord& submap : submaps) {
    Add(submap, feed);
    VEDUTA_ASSIGN_OR_RETURN(const auto border, snapshot.FindSubmapBorder(submap.id));
    if (border) Add(*border, feed);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ForbiddenRecord> forbidden, snapshot.ListForbidden());
  for (const ForbiddenRecord& record : forbidden) Add(record, feed);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<GroundPoint> ground, snapshot.ListGroundPoints());
  for (const GroundPoint& point : ground) Add(point, feed);
  return Status::Ok();
}

}  // namespace

Result<ContentHash> DigestOf(const Snapshot& snapshot) {
  ContentFeed feed;
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  feed << state.next_image << state.next_reconstruction << state.vocabulary_generation
       << state.images_at_vocabulary << state.retrievable_image_count
       << static_cast<uint64_t>(state.pending_propagation.size());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> cameras, snapshot.ListCameras());
  for (const CameraRecord& camera : cameras) Add(camera, &feed);
  Status inner;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanImages([&](const ImageRecord& image) {
    inner = AddImage(snapshot, image, state.vocabulary_generation, &feed);
    return inner.ok();
  }));
  VEDUTA_RETURN_IF_ERROR(inner);
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    feed << pose.image << pose.reconstruction << pose.cam_from_world;
    return true;
  }));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> reconstructions,
                          snapshot.ListReconstructions());
  for (const ReconstructionRecord& record : reconstructions) {
    Add(record, &feed);
    if (!record.is_living()) continue;
    VEDUTA_RETURN_IF_ERROR(
        snapshot.ScanPointBlocks(record.id, record.points_generation, [&](const PointBlock& block) {
          Add(block, &feed);
          return true;
        }));
  }
  VEDUTA_RETURN_IF_ERROR(AddFacts(snapshot, &feed));
  if (state.vocabulary_generation != 0) {
    VEDUTA_ASSIGN_OR_RETURN(const StoredBytes tree,
                            snapshot.GetVocabulary(state.vocabulary_generation));
    feed << HashContent(tree.bytes());
    VEDUTA_RETURN_IF_ERROR(snapshot.ScanPostings(
        state.vocabulary_generation, [&](WordId word, std::span<const ImageId> images) {
          feed << word << static_cast<uint64_t>(images.size());
          for (const ImageId id : images) feed << id;
          return true;
        }));
  }
  VEDUTA_RETURN_IF_ERROR(snapshot.dense().ScanAll([&](uint8_t family, auto key, auto value) {
    feed << family << HashContent(key) << HashContent(value);
  }));
  return feed.Finish();
}

}  // namespace veduta
