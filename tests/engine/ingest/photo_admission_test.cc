// SPDX-License-Identifier: Apache-2.0
// Goal: the same bytes are a duplicate, a name belongs to its photo unless that was rejected, and
//   what preparation rejected stays rejected.
// Method: prepared photos made by hand against a database of two images.
#include "engine/ingest/photo_admission.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

PreparedPhoto Prepared(const std::string& name, const std::string& content) {
  PreparedPhoto photo;
  photo.name = name;
  const std::vector<uint8_t> bytes(content.begin(), content.end());
  photo.hash = HashContent(bytes);
  photo.size_bytes = bytes.size();
  photo.width_px = 1000;
  photo.height_px = 800;
  photo.features.keypoints.resize(7);
  return photo;
}

// As preparation leaves a photo that is new.
void WriteAhead(SceneDatabase* scene, const std::string& content) {
  const std::vector<uint8_t> bytes(content.begin(), content.end());
  ASSERT_OK(scene->database()->WritePhotoAhead(HashContent(bytes), bytes, SampleFeatures(1, 7)));
}

Admission AdmitOk(const SceneDatabase& scene, const PreparedPhoto& photo,
                  const std::string& contributor = "berta") {
  auto admission = Admit(*scene.Snap(), photo, CameraId(1), contributor);
  EXPECT_OK(admission);
  return admission.ok() ? *admission : Admission();
}

TEST(PhotoAdmission, TellsNewFromKnown) {
  SceneDatabase scene;
  scene.AddImages(0, 2);  // image0 and image1, whose bytes are their names
  WriteAhead(&scene, "new");
  const Admission fresh = AdmitOk(scene, Prepared("new", "new"));
  EXPECT_EQ(fresh.outcome, AdmissionOutcome::kNew);
  EXPECT_FALSE(fresh.record.id.valid());
  EXPECT_EQ(fresh.record.name, "new");
  EXPECT_EQ(fresh.record.contributor, "berta");
  EXPECT_EQ(fresh.record.camera, CameraId(1));
  EXPECT_EQ(fresh.record.feature_count, 7u);
  EXPECT_EQ(fresh.record.size_bytes, 3u);

  const Admission same = AdmitOk(scene, Prepared("another name", "image1"));
  EXPECT_EQ(same.outcome, AdmissionOutcome::kDuplicate);
  EXPECT_EQ(same.stored.id, ImageId(2));
  EXPECT_EQ(AdmitOk(scene, Prepared("image1", "other bytes"), "anna").outcome,
            AdmissionOutcome::kNameTaken);
  EXPECT_EQ(AdmitOk(scene, Prepared("image1", "new")).outcome, AdmissionOutcome::kNew)
      << "anna's names are not berta's";

  PreparedPhoto blank = Prepared("blank", "blank");
  blank.reason = Reason::kNoTexture;
  EXPECT_EQ(AdmitOk(scene, blank).outcome, AdmissionOutcome::kRejected);
}

TEST(PhotoAdmission, ARejectedPhotosNameIsFree) {
  SceneDatabase scene;
  scene.AddImages(0, 1);
  ImageRecord rejected = *scene.Snap()->GetImage(ImageId(1));
  rejected.id = ImageId(2);
  rejected.name = "spoilt";
  rejected.photo = Prepared("", "spoilt").hash;
  rejected.verdict = Verdict::kRejected;
  rejected.reason = Reason::kUnreadable;
  const auto transaction = scene.database()->BeginTransaction();
  transaction->PutImage(rejected);
  ASSERT_OK(transaction->Commit());
  WriteAhead(&scene, "mended");
  const Admission mended = AdmitOk(scene, Prepared("spoilt", "mended"), "anna");
  EXPECT_EQ(mended.outcome, AdmissionOutcome::kNew);
  EXPECT_EQ(mended.record.id, ImageId(2));
  const Admission other = AdmitOk(scene, Prepared("spoilt", "mended"), "berta");
  EXPECT_EQ(other.outcome, AdmissionOutcome::kNew);
  EXPECT_FALSE(other.record.id.valid()) << "anna's rejected photo stays as it is";
}

TEST(PhotoAdmission, APhotoWhoseCopyWasRemovedIsOutdated) {
  SceneDatabase scene;
  scene.AddImages(0, 2);
  PreparedPhoto known = Prepared("another name", "image1");
  known.known = true;
  EXPECT_EQ(AdmitOk(scene, known).outcome, AdmissionOutcome::kDuplicate);
  const auto transaction = scene.database()->BeginTransaction();
  transaction->RemoveImage(ImageId(2));
  ASSERT_OK(transaction->Commit());
  EXPECT_EQ(AdmitOk(scene, known).outcome, AdmissionOutcome::kOutdated);
  // What it had written ahead went with its copy; prepared anew it is written ahead again.
  PreparedPhoto photo = Prepared("another name", "image1");
  EXPECT_EQ(AdmitOk(scene, photo).outcome, AdmissionOutcome::kOutdated);
  WriteAhead(&scene, "image1");
  EXPECT_EQ(AdmitOk(scene, photo).outcome, AdmissionOutcome::kNew);
}

}  // namespace
}  // namespace veduta
