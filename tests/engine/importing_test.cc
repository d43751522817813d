// SPDX-License-Identifier: Apache-2.0
// Goal: a model becomes a reconstruction in the model's own frame, which grows on as photos are
//   added; poses that the photos contradict are not believed; what is missing is named and nothing
//   outside of the folder is read; an import that was broken off goes on to the same database; and
//   photos that somebody has stored before are joined.
// Method: models in COLMAP's text are written with the true poses of a synthetic street, wrong ones
//   among them, beside photos on the disk. Poses are compared with the truth without an alignment.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iomanip>

#include "engine/photo_list.h"
#include "street_fixture.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

const std::vector<Stand>& Stands() {
  static const std::vector<Stand> stands = Walk(2, 0.8, 9);
  return stands;
}

std::vector<Stand> Part(size_t from, size_t to) {
  return {Stands().begin() + static_cast<std::ptrdiff_t>(from),
          Stands().begin() + static_cast<std::ptrdiff_t>(to)};
}

// What an image is called in the folder and in the model.
std::string FileOf(const Stand& stand) {
  return TakePhoto(stand).name;
}

// A model and its photos, in a folder of their own.
class Model {
 public:
  explicit Model(const std::vector<Stand>& stands) {
    fs::create_directories(photos());
    std::ofstream(model() + "/cameras.txt") << "4 PINHOLE 512 384 450 450 256 192\n";
    std::ofstream(model() + "/points3D.txt") << "1 0 0 0 0 0 0 0.5 1 0 2 0\n";
    for (const Stand& stand : stands) Add(FileOf(stand), stand, TakePhoto(stand).cam_from_world);
  }

  void Add(const std::string& name, const Stand& stand, const Rigid3& cam_from_world) {
    AddPose(name, cam_from_world);
    WritePhoto(name, TakePhoto(stand).jpeg);
  }
  void AddPose(const std::string& name, const Rigid3& cam_from_world) {
    const Eigen::Quaterniond& q = cam_from_world.rotation;
    const Eigen::Vector3d& t = cam_from_world.translation;
    std::ofstream file(model() + "/images.txt", std::ios::app);
    file << std::setprecision(17) << ++count_ << ' ' << q.w() << ' ' << q.x() << ' ' << q.y() << ' '
         << q.z() << ' ' << t.x() << ' ' << t.y() << ' ' << t.z() << " 4 " << name << "\n1 1 -1\n";
  }
  void WritePhoto(const std::string& name, const std::vector<uint8_t>& jpeg) const {
    fs::create_directories(fs::path(photos() + "/" + name).parent_path());
    std::ofstream(photos() + "/" + name, std::ios::binary)
        .write(reinterpret_cast<const char*>(jpeg.data()),
               static_cast<std::streamsize>(jpeg.size()));
  }

  std::string model() const { return folder_.path(); }
  std::string photos() const { return folder_ / "photos"; }
  ImportRequest Request(const std::string& contributor = "anna") const {
    return {model(), photos(), contributor};
  }

 private:
  TemporaryFolder folder_;
  int count_ = 0;
};

ImportAnswer Import(City* city, const Model& model, const std::string& contributor = "anna") {
  Result<ImportAnswer> answer = city->engine().Import(model.Request(contributor));
  EXPECT_OK(answer);
  EXPECT_TRUE(IsSound(city->Ask().snapshot()));
  return answer.ok() ? *answer : ImportAnswer();
}

// The largest distance of a camera from its true place, in the model's frame, and how many there
// are in the reconstruction.
std::pair<double, size_t> Error(const City& city, const std::vector<Stand>& stands,
                                ReconstructionId reconstruction) {
  double largest = 0;
  size_t count = 0;
  for (const Stand& stand : stands) {
    const auto image = city.Ask().FindImage(TakePhoto(stand).name);
    if (!image.ok()) continue;
    const auto pose = city.Ask().Pose(image->id);
    if (!pose.ok() || !*pose || (*pose)->reconstruction != reconstruction) continue;
    ++count;
    largest = std::max(
        largest,
        ((*pose)->cam_from_world.Center() - TakePhoto(stand).cam_from_world.Center()).norm());
  }
  return {largest, count};
}

constexpr double kErrorMaxM = 0.05;

TEST(Importing, AModelBecomesAReconstructionInItsFrame) {
  City city;
  const Model model(Stands());
  const ImportAnswer answer = Import(&city, model);
  EXPECT_EQ(answer.reconstruction, ReconstructionId(1));
  EXPECT_GT(answer.points, 500u);
  ASSERT_EQ(answer.photos.size(), 9u);
  for (const ImportedPhoto& photo : answer.photos) {
    EXPECT_TRUE(photo.was_given_pose) << photo.why_not;
    EXPECT_EQ(photo.reconstruction, ReconstructionId(1));
  }
  const auto [error_m, count] = Error(city, Stands(), ReconstructionId(1));
  EXPECT_EQ(count, 9u);
  EXPECT_LT(error_m, kErrorMaxM);
  const auto camera = city.parts().FindCamera("street");  // with the same intrinsics
  ASSERT_OK(camera);
  EXPECT_EQ(city.Ask().FindImage(FileOf(Stands()[0]))->camera, camera->id);
  std::vector<std::string> actions;
  ASSERT_OK(city.Ask().snapshot().ScanJournal(1, [&](const JournalRecord& entry) {
    if (entry.actor == "anna") actions.push_back(entry.action);
    return true;
  }));
  EXPECT_EQ(std::ranges::count(actions, "add"), 9);
  EXPECT_EQ(std::ranges::count(actions, "import"), 10);
}

TEST(Importing, TheSameAgainChangesNothing) {
  City city;
  const Model model(Stands());
  Import(&city, model);
  const std::string digest = city.Digest();
  const ImportAnswer again = Import(&city, model, "bea");
  EXPECT_FALSE(again.reconstruction.valid());
  for (const ImportedPhoto& photo : again.photos)
    EXPECT_EQ(photo.reconstruction, ReconstructionId(1));
  EXPECT_EQ(city.Digest(), digest);
  City other;
  Import(&other, model);
  EXPECT_EQ(other.Digest(), digest);
}

TEST(Importing, ItGrowsOnAsPhotosAreAdded) {
  City city;
  Import(&city, Model(Part(0, 6)));
  const std::vector<AddOutcome> added = city.Add(Part(6, 9));
  for (const AddOutcome& outcome : added)
    EXPECT_EQ(outcome.reconstruction, ReconstructionId(1)) << Told(added);
  const auto [error_m, count] = Error(city, Stands(), ReconstructionId(1));
  EXPECT_EQ(count, 9u);
  EXPECT_LT(error_m, 2 * kErrorMaxM);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Importing, APoseThatThePhotosContradictIsNotBelieved) {
  City city;
  Model model(Part(0, 4));
  Rigid3 wrong = TakePhoto(Stands()[4]).cam_from_world;
  wrong.rotation = wrong.rotation * Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY());
  wrong.translation += Eigen::Vector3d(0.5, 0.3, 0);
  model.Add(FileOf(Stands()[4]), Stands()[4], wrong);
  for (const Stand& stand : Part(5, 9))
    model.Add(FileOf(stand), stand, TakePhoto(stand).cam_from_world);
  const ImportAnswer answer = Import(&city, model);
  ASSERT_EQ(answer.photos.size(), 9u);
  for (size_t i = 0; i < 9; ++i)
    EXPECT_EQ(answer.photos[i].was_given_pose, i != 4) << i << ": " << answer.photos[i].why_not;
  // It is placed by what it sees instead.
  EXPECT_EQ(answer.photos[4].reconstruction, answer.reconstruction) << answer.photos[4].why_not;
  const auto [error_m, count] = Error(city, Stands(), answer.reconstruction);
  EXPECT_EQ(count, 9u);
  EXPECT_LT(error_m, kErrorMaxM);
}

TEST(Importing, AModelOfNothingButWrongPosesMakesNoReconstruction) {
  City city;
  Model model({});
  for (size_t i = 0; i < 6; ++i) {
    Rigid3 wrong;
    wrong.rotation = Eigen::AngleAxisd(0.7 * static_cast<double>(i), Eigen::Vector3d::UnitX());
    wrong.translation = Eigen::Vector3d(static_cast<double>(i * i), 2, 1);
    model.Add(FileOf(Stands()[i]), Stands()[i], wrong);
  }
  const ImportAnswer answer = Import(&city, model);
  EXPECT_FALSE(answer.reconstruction.valid());
  for (const ImportedPhoto& photo : answer.photos) EXPECT_FALSE(photo.was_given_pose);
  // They have found together as photos do that are added.
  EXPECT_GE(city.Counts().placed, 3u);
}

TEST(Importing, WhatIsMissingIsNamedAndNothingOutsideIsRead) {
  City city;
  Model model(Part(0, 5));
  const Rigid3 pose = TakePhoto(Stands()[5]).cam_from_world;
  model.Add("a photo, 100%.jpg", Stands()[5], pose);
  model.AddPose("gone.jpg", pose);
  model.AddPose("../outside.jpg", pose);
  model.AddPose("link.jpg", pose);
  model.AddPose("folder", pose);
  model.AddPose("text.jpg", pose);
  model.WritePhoto("../outside.jpg", TakePhoto(Stands()[6]).jpeg);
  fs::create_symlink(model.model() + "/outside.jpg", model.photos() + "/link.jpg");
  fs::create_directories(model.photos() + "/folder");
  model.WritePhoto("text.jpg", {'n', 'o'});
  const ImportAnswer answer = Import(&city, model);
  ASSERT_EQ(answer.photos.size(), 11u);
  EXPECT_TRUE(answer.photos[5].was_given_pose) << answer.photos[5].why_not;
  const auto why = [&](size_t i) { return answer.photos[i].why_not; };
  EXPECT_NE(why(6).find("no such file"), std::string::npos) << why(6);
  EXPECT_NE(why(7).find("leads out"), std::string::npos) << why(7);
  EXPECT_NE(why(8).find("leads out"), std::string::npos) << why(8);
  EXPECT_NE(why(9).find("not a file"), std::string::npos) << why(9);
  EXPECT_FALSE(why(10).empty());
  for (size_t i = 6; i < 11; ++i) EXPECT_FALSE(answer.photos[i].image.valid()) << i;
  EXPECT_EQ(city.Counts().images, 7u);  // the one that is no photo is known as such
  for (size_t i = 0; i < 6; ++i) EXPECT_TRUE(answer.photos[i].was_given_pose) << i << why(i);
}

TEST(Importing, NamesThatAreWrittenAsInAUrlAreFound) {
  City city;
  Model model(Part(0, 5));
  model.AddPose("a%20photo,%20100%25.jpg", TakePhoto(Stands()[5]).cam_from_world);
  model.WritePhoto("a photo, 100%.jpg", TakePhoto(Stands()[5]).jpeg);
  EXPECT_TRUE(Import(&city, model).photos[5].was_given_pose);
  EXPECT_OK(city.Ask().FindImage("a photo, 100%.jpg"));
}

TEST(Importing, OneThatWasBrokenOffGoesOn) {
  const Model model(Stands());
  City whole;
  Import(&whole, model);
  City city;
  std::stop_source stop;
  int added = 0;
  const auto broken_off =
      city.engine().Import(model.Request(), stop.get_token(), [&](const AddOutcome&) {
        if (++added == 4) stop.request_stop();
      });
  EXPECT_EQ(broken_off.status().code(), StatusCode::kCancelled);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  EXPECT_EQ(city.Counts().postponed, 4u);
  city.Reopen();
  Import(&city, model);
  EXPECT_EQ(city.Digest(), whole.Digest());
}

TEST(Importing, StoredPhotosAreTakenAsTheyAre) {
  City city;
  city.Add(Part(0, 5));
  ASSERT_EQ(city.Counts().placed, 5u);
  const ImportAnswer answer = Import(&city, Model(Part(3, 9)), "bea");
  ASSERT_EQ(answer.photos.size(), 6u);
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(answer.photos[i].was_given_pose, i >= 2) << i;
    EXPECT_TRUE(answer.photos[i].reconstruction.valid()) << i;
  }
  EXPECT_EQ(answer.photos[0].reconstruction, ReconstructionId(1));
  EXPECT_EQ(city.Counts().images, 9u);
  EXPECT_EQ(city.Ask().FindImage(FileOf(Stands()[3]))->contributor, "anna");
}

TEST(Importing, APhotoWhosePoseIsForbiddenGetsNone) {
  City city;
  city.Add(Part(2, 3));
  ASSERT_OK(city.engine().Forbid({ForbidKind::kPose, FileOf(Stands()[2]), "", "bea", "blurred"}));
  const ImportAnswer answer = Import(&city, Model(Stands()));
  EXPECT_FALSE(answer.photos[2].was_given_pose);
  EXPECT_FALSE(answer.photos[2].reconstruction.valid());
  EXPECT_EQ(city.Counts().placed, 8u);
}

TEST(Importing, WhatIsNoModelIsRefusedAndNothingIsStored) {
  City city;
  const Model model(Part(0, 5));
  ImportRequest request = model.Request();
  request.photos = model.model() + "/none";
  EXPECT_EQ(city.engine().Import(request).status().code(), StatusCode::kNotFound);
  request = model.Request();
  request.model = model.photos();
  EXPECT_EQ(city.engine().Import(request).status().code(), StatusCode::kNotFound);
  std::ofstream(model.model() + "/points3D.txt", std::ios::app) << "no point\n";
  EXPECT_EQ(city.engine().Import(model.Request()).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(city.Counts().images, 0u);
}

}  // namespace
}  // namespace veduta
