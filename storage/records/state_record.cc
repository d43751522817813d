// SPDX-License-Identifier: Apache-2.0
#include "storage/records/state_record.h"

#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

Status Check(const DatabaseState& state) {
  if (state.next_image == 0) return Broken("next_image", 0, "1 or more");
  if (state.next_camera == 0) return Broken("next_camera", 0, "1 or more");
  if (state.next_reconstruction == 0) return Broken("next_reconstruction", 0, "1 or more");
  for (const ImageId image : state.pending_propagation) {
    VEDUTA_RETURN_IF_ERROR(CheckId("image in pending_propagation", image));
  }
  return Status::Ok();
}

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
    to.setRemovedBytesLeft(state.removed_bytes_left);
    to.setCountsKnown(state.counts.has_value());
    if (!state.counts) return;
    to.setImageCount(state.counts->images);
    to.setPlacedCount(state.counts->placed);
    to.setPostponedCount(state.counts->postponed);
    to.setRejectedCount(state.counts->rejected);
    to.setCameraCount(state.counts->cameras);
    to.setLocatedCount(state.counts->located);
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
    state->removed_bytes_left = from.getRemovedBytesLeft();
    state->counts.reset();
    if (from.getCountsKnown()) {
      state->counts = {.images = from.getImageCount(),
                       .placed = from.getPlacedCount(),
                       .postponed = from.getPostponedCount(),
                       .rejected = from.getRejectedCount(),
                       .cameras = from.getCameraCount(),
                       .located = from.getLocatedCount()};
    }
    return Damaged(Check(*state));
  });
}

}  // namespace veduta
