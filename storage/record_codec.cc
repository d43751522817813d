// SPDX-License-Identifier: Apache-2.0
#include "storage/record_codec.h"

#include <algorithm>
#include <array>

#include "storage/message.h"
#include "storage/record_check.h"
#include "storage/schema.capnp.h"

namespace veduta {
namespace {

// The rows that are copied as they lie, as storage/schema.capnp describes them.
static_assert(sizeof(Keypoint) == 24 && sizeof(FeatureMatch) == 8 && sizeof(Observation) == 12);
static_assert(sizeof(TrackElement) == 8 && sizeof(ImageId) == 4);

Status Damaged(const Status& check) {
  return check.ok() ? check : Status::Corruption(check.message());
}

Status BadRows(std::string_view column) {
  return Status::Corruption(std::string(column) + " has a broken row");
}

// Text may hold any bytes: names of files need not be UTF-8.
capnp::Text::Reader AsText(const std::string& text) {
  return {text.c_str(), text.size()};
}
std::string FromText(capnp::Text::Reader text) {
  return {text.begin(), text.size()};
}

void Fill(schema::Rigid::Builder to, const Eigen::Quaterniond& rotation,
          const Eigen::Vector3d& translation) {
  to.setQw(rotation.w());
  to.setQx(rotation.x());
  to.setQy(rotation.y());
  to.setQz(rotation.z());
  to.setTx(translation.x());
  to.setTy(translation.y());
  to.setTz(translation.z());
}

void Read(schema::Rigid::Reader from, Eigen::Quaterniond* rotation, Eigen::Vector3d* translation) {
  *rotation = Eigen::Quaterniond(from.getQw(), from.getQx(), from.getQy(), from.getQz());
  *translation = Eigen::Vector3d(from.getTx(), from.getTy(), from.getTz());
}

}  // namespace

Result<std::string> Encode(const DatabaseState& state) {
  VEDUTA_RETURN_IF_ERROR(Check(state));
  const size_t payload = state.pending_propagation.size() * sizeof(ImageId);
  return WriteMessage<schema::State>(payload, [&](auto to) {
    to.setNextImage(state.next_image);
    to.setNextCamera(state.next_camera);
    to.setNextReconstruction(state.next_reconstruction);
    to.setNextJournal(state.next_journal);
    to.setNextBlob(state.next_blob);
    to.setVocabularyGeneration(state.vocabulary_generation);
    to.setImagesAtVocabulary(state.images_at_vocabulary);
    to.setVocabularyImported(state.vocabulary_imported);
    to.setRetrievableImageCount(state.retrievable_image_count);
    to.setPendingPropagation(AsData(state.pending_propagation));
    to.setCountsKnown(state.counts.has_value());
    if (!state.counts) return;
    to.setImageCount(state.counts->images);
    to.setPlacedCount(state.counts->placed);
    to.setPostponedCount(state.counts->postponed);
    to.setRejectedCount(state.counts->rejected);
    to.setCameraCount(state.counts->cameras);
  });
}

Status Decode(std::string_view value, DatabaseState* state) {
  return ReadMessage<schema::State>(value, [&](schema::State::Reader from) {
    state->next_image = from.getNextImage();
    state->next_camera = from.getNextCamera();
    state->next_reconstruction = from.getNextReconstruction();
    state->next_journal = from.getNextJournal();
    state->next_blob = from.getNextBlob();
    state->vocabulary_generation = from.getVocabularyGeneration();
    state->images_at_vocabulary = from.getImagesAtVocabulary();
    state->vocabulary_imported = from.getVocabularyImported();
    state->retrievable_image_count = from.getRetrievableImageCount();
    if (!CopyRows(from.getPendingPropagation(), &state->pending_propagation))
      return BadRows("pending_propagation");
    state->counts.reset();
    if (from.getCountsKnown()) {
      state->counts = {.images = from.getImageCount(),
                       .placed = from.getPlacedCount(),
                       .postponed = from.getPostponedCount(),
                       .rejected = from.getRejectedCount(),
                       .cameras = from.getCameraCount()};
    }
    return Damaged(Check(*state));
  });
}

Result<std::string> Encode(const CameraRecord& camera) {
  VEDUTA_RETURN_IF_ERROR(Check(camera));
  return WriteMessage<schema::Camera>(camera.name.size() + camera.source.size(), [&](auto to) {
    to.setName(AsText(camera.name));
    to.setSource(AsText(camera.source));
    to.setWidthPx(camera.model.width_px);
    to.setHeightPx(camera.model.height_px);
    to.setFx(camera.model.fx);
    to.setFy(camera.model.fy);
    to.setCx(camera.model.cx);
    to.setCy(camera.model.cy);
    to.setK1(camera.model.k1);
    to.setK2(camera.model.k2);
    to.setU0(camera.model.u0);
    to.setV0(camera.model.v0);
  });
}

Status Decode(std::string_view value, CameraId id, CameraRecord* camera) {
  return ReadMessage<schema::Camera>(value, [&](schema::Camera::Reader from) {
    camera->id = id;
    camera->name = FromText(from.getName());
    camera->source = FromText(from.getSource());
    camera->model = {from.getWidthPx(), from.getHeightPx(), from.getFx(), from.getFy(),
                     from.getCx(),      from.getCy(),       from.getK1(), from.getK2(),
                     from.getU0(),      from.getV0()};
    return Damaged(Check(*camera));
  });
}

Result<std::string> Encode(const ImageRecord& image) {
  VEDUTA_RETURN_IF_ERROR(Check(image));
  const size_t payload = image.name.size() + image.contributor.size() + image.detail.size() + 32;
  return WriteMessage<schema::Image>(payload, [&](auto to) {
    to.setName(AsText(image.name));
    to.setPhoto(AsData(image.photo.bytes.data(), image.photo.bytes.size()));
    to.setCamera(image.camera.value);
    to.setWidthPx(image.width_px);
    to.setHeightPx(image.height_px);
    to.setSizeBytes(image.size_bytes);
    to.setFeatureCount(image.feature_count);
    to.setContributor(AsText(image.contributor));
    to.setTimeUnixS(image.time_unix_s);
    to.setVerdict(static_cast<uint8_t>(image.verdict));
    to.setReason(static_cast<uint8_t>(image.reason));
    to.setDetail(AsText(image.detail));
  });
}

Status Decode(std::string_view value, ImageId id, ImageRecord* image) {
  return ReadMessage<schema::Image>(value, [&](schema::Image::Reader from) {
    image->id = id;
    image->name = FromText(from.getName());
    const capnp::Data::Reader photo = from.getPhoto();
    if (photo.size() != image->photo.bytes.size()) return BadRows("photo");
    std::copy(photo.begin(), photo.end(), image->photo.bytes.begin());
    image->camera = CameraId(from.getCamera());
    image->width_px = from.getWidthPx();
    image->height_px = from.getHeightPx();
    image->size_bytes = from.getSizeBytes();
    image->feature_count = from.getFeatureCount();
    image->contributor = FromText(from.getContributor());
    image->time_unix_s = from.getTimeUnixS();
    image->verdict = static_cast<Verdict>(from.getVerdict());
    image->reason = static_cast<Reason>(from.getReason());
    image->detail = FromText(from.getDetail());
    return Damaged(Check(*image));
  });
}

Result<std::string> Encode(const Features& features) {
  VEDUTA_RETURN_IF_ERROR(Check(features));
  const size_t payload = features.keypoints.size() * sizeof(Keypoint) + features.descriptors.size();
  return WriteMessage<schema::Features>(payload, [&](auto to) {
    to.setKeypoints(AsData(features.keypoints));
    to.setDescriptors(AsData(features.descriptors));
  });
}

Status Decode(std::string_view value, Features* features) {
  return ReadMessage<schema::Features>(value, [&](schema::Features::Reader from) {
    if (!CopyRows(from.getKeypoints(), &features->keypoints)) return BadRows("keypoints");
    if (!CopyRows(from.getDescriptors(), &features->descriptors)) return BadRows("descriptors");
    return Damaged(Check(*features));
  });
}

Result<std::string> Encode(const PairRecord& pair) {
  VEDUTA_RETURN_IF_ERROR(Check(pair));
  return WriteMessage<schema::Pair>(pair.matches.size() * sizeof(FeatureMatch), [&](auto to) {
    to.setGeometry(static_cast<uint8_t>(pair.geometry));
    Fill(to.initBFromA(), pair.b_from_a.rotation, pair.b_from_a.translation);
    to.setMatches(AsData(pair.matches));
  });
}

Status Decode(std::string_view value, ImageId a, ImageId b, PairRecord* pair) {
  return ReadMessage<schema::Pair>(value, [&](schema::Pair::Reader from) {
    pair->a = a;
    pair->b = b;
    pair->geometry = static_cast<PairGeometry>(from.getGeometry());
    Read(from.getBFromA(), &pair->b_from_a.rotation, &pair->b_from_a.translation);
    if (!CopyRows(from.getMatches(), &pair->matches)) return BadRows("matches");
    return Damaged(Check(*pair));
  });
}

Result<std::string> Encode(const PairNeighbor& neighbor) {
  VEDUTA_RETURN_IF_ERROR(Check(neighbor));
  return WriteMessage<schema::PairNeighbor>(0, [&](auto to) {
    to.setMatchCount(neighbor.match_count);
    to.setGeometry(static_cast<uint8_t>(neighbor.geometry));
  });
}

Status Decode(std::string_view value, ImageId image, PairNeighbor* neighbor) {
  return ReadMessage<schema::PairNeighbor>(value, [&](schema::PairNeighbor::Reader from) {
    *neighbor = {image, from.getMatchCount(), static_cast<PairGeometry>(from.getGeometry())};
    return Damaged(Check(*neighbor));
  });
}

Result<std::string> Encode(const ReconstructionRecord& reconstruction) {
  VEDUTA_RETURN_IF_ERROR(Check(reconstruction));
  return WriteMessage<schema::Reconstruction>(0, [&](auto to) {
    to.setMergedInto(reconstruction.merged_into.value);
    to.setMergedFromThisScale(reconstruction.merged_from_this.scale);
    Fill(to.initMergedFromThis(), reconstruction.merged_from_this.rotation,
         reconstruction.merged_from_this.translation);
    to.setImageCount(reconstruction.image_count);
    to.setPointCount(reconstruction.point_count);
    to.setObservationCount(reconstruction.observation_count);
    to.setReprojectionErrorPxSum(reconstruction.reprojection_error_px_sum);
    to.setGeometryVersion(reconstruction.geometry_version);
    to.setPointsGeneration(reconstruction.points_generation);
    to.setImagesAtAdjustment(reconstruction.images_at_adjustment);
  });
}

Status Decode(std::string_view value, ReconstructionId id, ReconstructionRecord* reconstruction) {
  return ReadMessage<schema::Reconstruction>(value, [&](schema::Reconstruction::Reader from) {
    reconstruction->id = id;
    reconstruction->merged_into = ReconstructionId(from.getMergedInto());
    Sim3& sim = reconstruction->merged_from_this;
    sim.scale = from.getMergedFromThisScale();
    Read(from.getMergedFromThis(), &sim.rotation, &sim.translation);
    reconstruction->image_count = from.getImageCount();
    reconstruction->point_count = from.getPointCount();
    reconstruction->observation_count = from.getObservationCount();
    reconstruction->reprojection_error_px_sum = from.getReprojectionErrorPxSum();
    reconstruction->geometry_version = from.getGeometryVersion();
    reconstruction->points_generation = from.getPointsGeneration();
    reconstruction->images_at_adjustment = from.getImagesAtAdjustment();
    return Damaged(Check(*reconstruction));
  });
}

Result<std::string> Encode(const PoseRecord& pose) {
  VEDUTA_RETURN_IF_ERROR(Check(pose));
  return WriteMessage<schema::Pose>(0, [&](auto to) {
    to.setReconstruction(pose.reconstruction.value);
    Fill(to.initCamFromWorld(), pose.cam_from_world.rotation, pose.cam_from_world.translation);
  });
}

Status Decode(std::string_view value, ImageId image, PoseRecord* pose) {
  return ReadMessage<schema::Pose>(value, [&](schema::Pose::Reader from) {
    pose->image = image;
    pose->reconstruction = ReconstructionId(from.getReconstruction());
    Read(from.getCamFromWorld(), &pose->cam_from_world.rotation, &pose->cam_from_world.translation);
    return Damaged(Check(*pose));
  });
}

Result<std::string> Encode(std::span<const Observation> observations) {
  VEDUTA_RETURN_IF_ERROR(Check(observations));
  return WriteMessage<schema::Observations>(observations.size_bytes(), [&](auto to) {
    to.setRows(AsData(observations.data(), observations.size()));
  });
}

Status Decode(std::string_view value, std::vector<Observation>* observations) {
  return ReadMessage<schema::Observations>(value, [&](schema::Observations::Reader from) {
    if (!CopyRows(from.getRows(), observations)) return BadRows("observations");
    return Damaged(Check(std::span<const Observation>(*observations)));
  });
}

Result<std::string> Encode(const JournalRecord& journal) {
  VEDUTA_RETURN_IF_ERROR(Check(journal));
  const size_t payload = journal.actor.size() + journal.action.size() + journal.detail.size();
  return WriteMessage<schema::Journal>(payload, [&](auto to) {
    to.setTimeUnixS(journal.time_unix_s);
    to.setActor(AsText(journal.actor));
    to.setAction(AsText(journal.action));
    to.setImage(journal.image.value);
    to.setReconstruction(journal.reconstruction.value);
    to.setDetail(AsText(journal.detail));
  });
}

Status Decode(std::string_view value, uint64_t sequence, JournalRecord* journal) {
  return ReadMessage<schema::Journal>(value, [&](schema::Journal::Reader from) {
    journal->sequence = sequence;
    journal->time_unix_s = from.getTimeUnixS();
    journal->actor = FromText(from.getActor());
    journal->action = FromText(from.getAction());
    journal->image = ImageId(from.getImage());
    journal->reconstruction = ReconstructionId(from.getReconstruction());
    journal->detail = FromText(from.getDetail());
    return Damaged(Check(*journal));
  });
}

Result<std::string> EncodeWords(std::span<const WordId> words) {
  VEDUTA_RETURN_IF_ERROR(CheckWords(words));
  return std::string(reinterpret_cast<const char*>(words.data()), words.size_bytes());
}

Status DecodeWords(std::string_view value, std::vector<WordId>* words) {
  if (!CopyRows(value.data(), value.size(), words)) return BadRows("words");
  return Damaged(CheckWords(*words));
}

Result<std::string> EncodeImages(std::span<const ImageId> images) {
  VEDUTA_RETURN_IF_ERROR(CheckImages(images));
  return std::string(reinterpret_cast<const char*>(images.data()), images.size_bytes());
}

Status DecodeImages(std::string_view value, std::vector<ImageId>* images) {
  if (!CopyRows(value.data(), value.size(), images)) return BadRows("images");
  return Damaged(CheckImages(*images));
}

std::string EncodeU32(uint32_t value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

Status DecodeU32(std::string_view value, uint32_t* number) {
  if (value.size() != sizeof(*number))
    return Status::Corruption("a number of " + std::to_string(value.size()) + " bytes");
  std::memcpy(number, value.data(), sizeof(*number));
  return Status::Ok();
}

}  // namespace veduta
