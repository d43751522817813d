// SPDX-License-Identifier: Apache-2.0
// Goal: every struct that the door answers with becomes the JSON that docs/json.md describes: each
//   field under its key, in the order of the page, null where there is nothing.
// Method: structs filled with values that no two fields share, compared with the text that is
//   expected; the types of the keys are those of tests/cli/json_test.py.
#include <gtest/gtest.h>

#include <limits>

#include "cli/wire/added_json.h"
#include "cli/wire/answers_json.h"
#include "cli/wire/dense_json.h"
#include "cli/wire/removal_json.h"

namespace veduta {
namespace {

ReconstructionAnswer SomeReconstruction() {
  ReconstructionAnswer r;
  r.id = ReconstructionId(3);
  r.images = 12;
  r.points = 1000;
  r.observations = 4000;
  r.reprojection_error_px_mean = 0.5;
  r.geometry_version = 7;
  r.depth_maps = 5;
  r.tiles = 2;
  r.triangles = 900;
  return r;
}

constexpr char kReconstruction[] =
    R"({"id":3,"images":12,"points":1000,"observations":4000,"reprojection_error_px_mean":0.5,)"
    R"("geometry_version":7,"depth_maps":5,"tiles":2,"triangles":900,"merged_into":null,)"
    R"("dissolved":false})";

HypothesisAnswer SomeHypothesis() {
  HypothesisAnswer h;
  h.a = ReconstructionId(3);
  h.b = ReconstructionId(5);
  h.reason = "pairs contradict it";
  h.common_points = 24;
  h.pairs_for = 2;
  h.pairs_against = 4;
  h.matches_for = 90;
  h.matches_against = 210;
  h.parts_judged = 33;
  h.parts_missing = 11;
  h.scale = 0.5;
  h.pose = {{0.5, 0.5, 0.5, -0.5}, {1, 2, 3}, {9, 9, 9}};
  h.image = ImageId(8);
  h.unsure = {ImageId(4), ImageId(8)};
  h.judgments = 6;
  h.due = true;
  h.time_unix_s = 1700000000;
  return h;
}

constexpr char kHypothesis[] =
    R"({"kind":"merge","a":3,"b":5,"reason":"pairs contradict it","common_points":24,)"
    R"("pairs_for":2,"pairs_against":4,"matches_for":90,"matches_against":210,)"
    R"("parts_judged":33,"parts_missing":11,"scale":0.5,"rotation_wxyz":[0.5,0.5,0.5,-0.5],)"
    R"("translation":[1.0,2.0,3.0],"image":8,"unsure":[4,8],"judgments":6,"due":true,)"
    R"("time":1700000000})";

TEST(JsonLine, IsOneLineOfUtf8) {
  EXPECT_EQ(JsonLine(Json::object({{"name", "a\nb\x1b\"\\"}})), R"({"name":"a\nb\u001b\"\\"})");
  EXPECT_EQ(JsonLine(Json("caf\xe9")), "\"caf\xef\xbf\xbd\"");
  EXPECT_EQ(JsonLine(Json("caf\xc3\xa9")), "\"caf\xc3\xa9\"");
  EXPECT_EQ(JsonLine(Json(std::numeric_limits<double>::quiet_NaN())), "null");
}

TEST(JsonLine, NumbersComeBackAsTheyWere) {
  for (const double value : {0.1, 1.0 / 3, 1e-300, 123456789.123456789, -0.0}) {
    EXPECT_EQ(Json::parse(JsonLine(Json(value))).get<double>(), value);
  }
  const uint64_t large = std::numeric_limits<uint64_t>::max();
  EXPECT_EQ(Json::parse(JsonLine(Json(large))).get<uint64_t>(), large);
}

TEST(Ids, AreNumbersOrNull) {
  EXPECT_EQ(JsonLine(ToJson(ImageId(7))), "7");
  EXPECT_EQ(JsonLine(ToJson(ImageId())), "null");
  EXPECT_EQ(JsonLine(ToJson(std::vector<ImageId>{})), "[]");
  EXPECT_EQ(JsonLine(ToJson(std::vector{ImageId(7), ImageId(9)})), "[7,9]");
}

TEST(Answers, Reconstruction) {
  EXPECT_EQ(JsonLine(ToJson(SomeReconstruction())), kReconstruction);
  ReconstructionAnswer gone = SomeReconstruction();
  gone.merged_into = ReconstructionId(1);
  gone.merged_scale = 2;
  gone.merged_pose = {{0.5, 0.5, 0.5, -0.5}, {1, 2, 3}, {9, 9, 9}};
  EXPECT_EQ(JsonLine(ToJson(gone)["merged_into"]),
            R"({"reconstruction":1,"scale":2.0,"rotation_wxyz":[0.5,0.5,0.5,-0.5],)"
            R"("translation":[1.0,2.0,3.0]})");
}

TEST(Answers, Upload) {
  const UploadAnswer upload = {7, "a.jpg", "anna", "phone", "00ff", 123, 1'700'000'000};
  EXPECT_EQ(JsonLine(ToJson(upload)),
            R"({"upload":7,"image":"a.jpg","contributor":"anna","camera":"phone",)"
            R"("photo":"00ff","bytes":123,"time":1700000000,"contribution":null})");
}

TEST(Answers, Status) {
  StatusAnswer status;
  status.images = 20;
  status.placed = 12;
  status.unsure = 7;
  status.postponed = 5;
  status.rejected = 3;
  status.cameras = 2;
  status.uploads = 9;
  status.backlog = 4;
  status.vocabulary_generation = 1;
  status.total_bytes = 123456;
  status.storage = {1, 2, 3, 4, 5, 6, 7};
  const std::string counts =
      R"({"images":20,"placed":12,"unsure":7,"postponed":5,"rejected":3,"cameras":2,"uploads":9,)"
      R"("backlog":4,)"
      R"("vocabulary_generation":1,"bytes":123456,)"
      R"("storage":{"log_bytes":1,"flush_bytes":2,"compaction_bytes":3,"blob_bytes":4,)"
      R"("blob_copied_bytes":5,"cache_hits":6,"cache_misses":7},"reconstructions":[)";
  EXPECT_EQ(JsonLine(ToJson(status)), counts + R"(],"open_hypotheses":0,"doubtful_seams":[]})");
  status.reconstructions = {SomeReconstruction(), SomeReconstruction()};
  status.open_hypotheses = 30;
  status.doubtful_seams = {SomeHypothesis()};
  EXPECT_EQ(JsonLine(ToJson(status)), counts + kReconstruction + "," + kReconstruction +
                                          R"(],"open_hypotheses":30,"doubtful_seams":[)" +
                                          kHypothesis + "]}");
}

TEST(Answers, ReconstructionWithItsHypotheses) {
  const std::string plain = kReconstruction;
  EXPECT_EQ(JsonLine(ReconstructionJson(SomeReconstruction(), {})),
            plain.substr(0, plain.size() - 1) + R"(,"hypotheses":[]})");
  EXPECT_EQ(JsonLine(ReconstructionJson(SomeReconstruction(), {SomeHypothesis()})["hypotheses"]),
            std::string("[") + kHypothesis + "]");
  HypothesisAnswer removed = SomeHypothesis();
  removed.image = {};
  EXPECT_TRUE(ToJson(removed)["image"].is_null());
}

ImageAnswer SomeImage() {
  ImageAnswer image;
  image.id = ImageId(8);
  image.name = "a.jpg";
  image.verdict = Verdict::kPostponed;
  image.reason = Reason::kNoGoodTriple;
  image.detail = "3 neighbours";
  image.camera = CameraId(2);
  image.width_px = 640;
  image.height_px = 480;
  image.orientation = 6;
  image.size_bytes = 5000;
  image.sha256 = "ab12";
  image.contributor = "anna";
  image.time_unix_s = 1700000000;
  image.features = 900;
  image.observations = 300;
  return image;
}

TEST(Answers, ImageWithoutAPose) {
  const std::string reason = ReasonSentence(Reason::kNoGoodTriple, "3 neighbours");
  EXPECT_EQ(JsonLine(ToJson(SomeImage())),
            R"({"image":"a.jpg","id":8,"verdict":"postponed","reason":")" + reason +
                R"(","reconstruction":null,"may_stand_in":[],"camera":2,"width":640,"height":480,)"
                R"("orientation":6,"bytes":5000,"sha256":"ab12","contributor":"anna",)"
                R"("time":1700000000,"features":900,"observations":300,"neighbors":[],)"
                R"("depth_map":null,"uncertainty":null,"hypotheses":[],"gps":null,"taken":null,)"
                R"("contribution":null,"on_earth":null,"hidden":false})");
}

TEST(Answers, ImageWithAll) {
  ImageAnswer image = SomeImage();
  image.verdict = Verdict::kPlaced;
  image.reconstruction = ReconstructionId(3);
  image.cam_from_world = PlainPose{{1, 0, 0, 0}, {4, 5, 6}, {-4, -5, -6}};
  image.neighbors = {{ImageId(9), "b.jpg", Verdict::kFounded, 55, 0}};
  image.depth_map = DepthMapAnswer{160, 120, 0.75, 2, 9, {"b.jpg", "c.jpg"}, 6};
  image.uncertainty = PoseUncertainty{{}, 0.25, 0.5, 0.75, 70, 8};
  image.hypotheses = {SomeHypothesis()};
  image.uncertainty->covariance[1][2] = 4;
  const std::string zeros = "[0.0,0.0,0.0,0.0,0.0,0.0]";
  const std::string uncertainty =
      R"({"center_stddev":0.5,"rotation_stddev_deg":0.25,"covariance":[)" + zeros +
      ",[0.0,0.0,4.0,0.0,0.0,0.0]," + zeros + "," + zeros + "," + zeros + "," + zeros +
      R"(],"error_px":0.75,"points":70,"images_held":8})";
  const Json json = ToJson(image);
  EXPECT_EQ(json["reconstruction"], 3);
  EXPECT_EQ(JsonLine(json["uncertainty"]), uncertainty);
  EXPECT_EQ(JsonLine(json["hypotheses"]), std::string("[") + kHypothesis + "]");
  EXPECT_EQ(JsonLine(json["neighbors"]),
            R"([{"id":9,"image":"b.jpg","matches":55,"verdict":"founded"}])");
  EXPECT_EQ(JsonLine(json["depth_map"]),
            R"({"width":160,"height":120,"known_share":0.75,"depth_near":2.0,"depth_far":9.0,)"
            R"("sensors":["b.jpg","c.jpg"],"geometry_version":6})");
  EXPECT_EQ(JsonLine(PoseJson(image)),
            R"({"image":"a.jpg","reconstruction":3,"rotation_wxyz":[1.0,0.0,0.0,0.0],)"
            R"("translation":[4.0,5.0,6.0],"center":[-4.0,-5.0,-6.0],"on_earth":null,)"
            R"("uncertainty":)" +
                uncertainty + "}");
}

TEST(Answers, Listed) {
  ListedImage image{ImageId(8), "a.jpg", "anna", Verdict::kPostponed, {}, false, false, 1, {}};
  EXPECT_EQ(JsonLine(ToJson(image)),
            R"({"id":8,"image":"a.jpg","contributor":"anna","verdict":"postponed",)"
            R"("reconstruction":null,"unsure":false,"hidden":false,"orientation":1,)"
            R"("rotation_wxyz":null,"center":null})");
  image.reconstruction = ReconstructionId(3);
  image.cam_from_world = PlainPose{{1, 0, 0, 0}, {4, 5, 6}, {-4, -5, -6}};
  EXPECT_EQ(JsonLine(ToJson(image)["rotation_wxyz"]), "[1.0,0.0,0.0,0.0]");
  EXPECT_EQ(JsonLine(ToJson(image)["center"]), "[-4.0,-5.0,-6.0]");
}

TEST(Answers, Small) {
  EXPECT_EQ(JsonLine(CandidatesJson({{ImageId(9), "b.jpg", Verdict::kPlaced, 0, 0.25}})),
            R"([{"id":9,"image":"b.jpg","score":0.25,"verdict":"placed"}])");
  EXPECT_EQ(JsonLine(CandidatesJson({})), "[]");
  EXPECT_EQ(JsonLine(ToJson(
                CameraAnswer{CameraId(1), "a", {8, 6, 5, 6, 4, 3, 0, 0, 4, 3}, "me", 2, 0.5})),
            R"({"id":1,"name":"a","size":"8x6","params":"5,6,4,3","source":"me","version":2,)"
            R"("focal_stddev_share":0.5})");
  EXPECT_EQ(JsonLine(ToJson(VocabularyAnswer{1, 2, 10, 3, 1000, 50000, 60, true})),
            R"({"generation":2,"branch":10,"depth":3,"words":1000,"training_descriptors":50000,)"
            R"("images_at_training":60,"imported":true})");
  EXPECT_EQ(JsonLine(ToJson(JournalAnswer{4, 1700000000, "anna", "add", ImageId(8), {}, "placed"})),
            R"({"sequence":4,"time":1700000000,"actor":"anna","action":"add","image":8,)"
            R"("reconstruction":null,"detail":"placed"})");
  EXPECT_EQ(JsonLine(ViolationsJson({})), R"({"sound":true,"violations":[]})");
  EXPECT_EQ(JsonLine(ViolationsJson({"a", "b"})), R"({"sound":false,"violations":["a","b"]})");
  EXPECT_EQ(JsonLine(DigestJson("63d5")), R"({"digest":"63d5"})");
}

TEST(Answers, Repair) {
  RepairAnswer repair;
  repair.is_repaired = true;
  repair.findings = {{"a", "b"}};
  repair.lost = {"c"};
  repair.kept_path = "d";
  EXPECT_EQ(JsonLine(ToJson(repair)),
            R"({"sound":false,"repaired":true,"rebuilt":false,)"
            R"("findings":[{"damage":"a","remedy":"b"}],"lost":["c"],"retried":[],)"
            R"("written_out":[],"kept_path":"d","report_path":"","photos_path":""})");
}

TEST(Answers, CameraFile) {
  CalibrationAnswer calibration;
  calibration.from = "2 photos of markers";
  calibration.model.width_px = 30;
  calibration.model.height_px = 20;
  calibration.is_good = true;
  calibration.intrinsic_names = {"fx", "fy", "cx", "cy", "k1", "k2", "u0", "v0"};
  calibration.intrinsics = {1, 2, 3, 4, 5, 6, 7, 8};
  calibration.sigmas = {0.5};
  calibration.error_px_mean = 0.25;
  calibration.error_px_rms = 0.5;
  calibration.distortion_sigma_px = 0.125;
  calibration.has_square_pixels = true;
  calibration.photos_used = 1;
  calibration.calibrated_photos = {{"a.jpg", 9, 1, 0.75, ""}, {"b.jpg", 0, 9, 80, "no plane"}};
  calibration.messages = {
      {false, true, "b.jpg: blurred"}, {false, false, "1 point left out"}, {true, false, "tilt"}};
  EXPECT_EQ(
      JsonLine(CameraFileJson(calibration)),
      R"({"format":"veduta camera","version":1,"width":30,"height":20,)"
      R"("intrinsics":{"fx":1.0,"fy":2.0,"cx":3.0,"cy":4.0,"k1":5.0,"k2":6.0,"u0":7.0,"v0":8.0},)"
      R"("standard_deviations":{"fx":0.5,"fy":0.0,"cx":0.0,"cy":0.0,"k1":0.0,"k2":0.0,"u0":0.0,)"
      R"("v0":0.0},"calibration":{"from":"2 photos of markers","status":"good","photos_used":1,)"
      R"("error_px_mean":0.25,"error_px_rms":0.5,"distortion_sigma_px":0.125,)"
      R"("square_pixels":true,"warnings":["tilt"],"notes":["1 point left out","b.jpg: blurred"],)"
      R"("photos":[{"name":"a.jpg","points":9,"points_left_out":1,"error_px_rms":0.75,)"
      R"("left_out":""},{"name":"b.jpg","points":0,"points_left_out":9,"error_px_rms":null,)"
      R"("left_out":"no plane"}]}})");
}

TEST(Added, Outcome) {
  AddOutcome outcome;
  outcome.name = "a.jpg";
  outcome.id = ImageId(8);
  outcome.verdict = Verdict::kMerged;
  outcome.reason = Reason::kJoinedReconstructions;
  outcome.detail = "1 and 2";
  outcome.reconstruction = ReconstructionId(1);
  outcome.neighbor_count = 5;
  outcome.inlier_count = 77;
  outcome.pairs_tried = 24;
  outcome.propagated = {ImageId(2), ImageId(4)};
  outcome.unplaced = {{ImageId(3), "it contradicts"}};
  outcome.split_off = {ReconstructionId(6)};
  outcome.times = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 55, 8.5};
  EXPECT_EQ(
      JsonLine(ToJson(outcome)),
      R"({"image":"a.jpg","id":8,"verdict":"merged","reason":")" +
          ReasonSentence(outcome.reason, "1 and 2") +
          R"(","replaced":false,"reconstruction":1,"camera":null,)"
          R"("neighbors":5,"inliers":77,"pairs_tried":24,)"
          R"("propagated":[2,4],"unplaced":[{"id":3,"why":"it contradicts"}],"split_off":[6],)"
          R"("damaged":[],"ms":{"decode":1.0,"undistort":2.0,"features":3.0,)"
          R"("retrieve":4.0,"match":5.0,"verify":6.0,"map":7.0,"adjust":8.0,"commit":9.0,)"
          R"("follow":10.0,"longest_step":8.5,"total":55.0}})");
  outcome.camera = "phone";
  EXPECT_EQ(ToJson(outcome)["camera"], "phone");
  outcome.duplicate = true;
  EXPECT_EQ(ToJson(outcome)["verdict"], "duplicate");
  EXPECT_EQ(ToJson(outcome)["reason"], "1 and 2");
}

TEST(Added, Localized) {
  LocalizedPhoto photo;
  photo.name = "a.jpg";
  photo.verdict = Verdict::kPlaced;
  photo.reason = Reason::kRegistered;
  photo.detail = "with 9";
  photo.stored = ImageId(7);
  photo.reconstruction = ReconstructionId(2);
  photo.cam_from_world = PlainPose{{0.5, 0.5, 0.5, -0.5}, {1, 2, 3}, {4, 5, 6}};
  photo.inlier_count = 77;
  photo.neighbor_count = 5;
  photo.pairs_tried = 24;
  photo.support = {{ImageId(3), "c.jpg", 80}};
  photo.damaged = {{ImageId(9), "its features"}};
  photo.times = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 55, 8.5};
  EXPECT_EQ(JsonLine(ToJson(photo)),
            R"({"image":"a.jpg","verdict":"localized","reason":")" +
                ReasonSentence(photo.reason, "with 9") +
                R"(","stored":7,"reconstruction":2,"pose":{"rotation_wxyz":[0.5,0.5,0.5,-0.5],)"
                R"("translation":[1.0,2.0,3.0],"center":[4.0,5.0,6.0]},"on_earth":null,)"
                R"("uncertainty":null,)"
                R"("camera":null,"neighbors":5,"inliers":77,"pairs_tried":24,)"
                R"("support":[{"id":3,"image":"c.jpg","points":80}],)"
                R"("damaged":[{"id":9,"what":"its features"}],)"
                R"("ms":{"decode":1.0,"undistort":2.0,"features":3.0,"retrieve":4.0,"match":5.0,)"
                R"("verify":6.0,"map":7.0,"adjust":8.0,"commit":9.0,"follow":10.0,)"
                R"("longest_step":8.5,"total":55.0}})");
  photo.uncertainty.emplace();
  EXPECT_EQ(ToJson(photo)["uncertainty"], ToJson(*photo.uncertainty));
  photo.camera =
      EstimatedCamera{{600, 400, 500, 500, 300, 200, 0.5, 0, 300, 200}, 0.01, 0.25, 0.125};
  EXPECT_EQ(JsonLine(ToJson(photo)["camera"]),
            R"({"size":"600x400","params":")" + CameraParamsText(photo.camera->model) +
                R"(","focal":500.0,"focal_stddev":5.0,"k1":0.5,"k1_stddev":0.25,)"
                R"("k2":0.0,"k2_stddev":0.125})");
  photo.cam_from_world.reset();
  photo.verdict = Verdict::kPostponed;
  EXPECT_EQ(ToJson(photo)["verdict"], "refused");
  EXPECT_TRUE(ToJson(photo)["pose"].is_null());
  photo.verdict = Verdict::kRejected;
  EXPECT_EQ(ToJson(photo)["verdict"], "rejected");
  photo.failure = Status::IoError("the disk");
  EXPECT_EQ(ToJson(photo)["verdict"], "failed");
  EXPECT_EQ(ToJson(photo)["reason"], "the disk");
}

TEST(Added, FollowUps) {
  FollowUp step;
  step.kind = FollowUpKind::kAdjustment;
  step.reconstruction = ReconstructionId(2);
  step.ms = 2.5, step.turn_ms = 1.5;
  EXPECT_EQ(JsonLine(ToJson(step)),
            R"({"step":"adjustment","image":null,"reconstruction":2,"other":null,)"
            R"("merged_into":null,"placed":[],"unplaced":[],"split_off":[],"ms":2.5,)"
            R"("turn_ms":1.5,"error":null})");
  step.unplaced = {{ImageId(5), "parts are missing"}};
  step.split_off = {ReconstructionId(7)};
  EXPECT_EQ(JsonLine(ToJson(step)["unplaced"]), R"([{"id":5,"why":"parts are missing"}])");
  EXPECT_EQ(JsonLine(ToJson(step)["split_off"]), "[7]");
  step = {};
  step.image = ImageId(5);
  step.placed = {ImageId(5), ImageId(6)};
  step.status = Status::IoError("the disk is full");
  EXPECT_EQ(JsonLine(ToJson(step)),
            R"({"step":"propagation","image":5,"reconstruction":null,"other":null,)"
            R"("merged_into":null,"placed":[5,6],"unplaced":[],"split_off":[],)"
            R"("ms":0.0,"turn_ms":0.0,"error":"the disk is full"})");
  step = {};
  step.kind = FollowUpKind::kJudgment;
  step.reconstruction = ReconstructionId(2);
  step.other = ReconstructionId(3);
  step.merged_into = ReconstructionId(4);
  EXPECT_EQ(JsonLine(ToJson(step)),
            R"({"step":"judgment","image":null,"reconstruction":2,"other":3,"merged_into":4,)"
            R"("placed":[],"unplaced":[],"split_off":[],"ms":0.0,"turn_ms":0.0,"error":null})");
  EXPECT_EQ(FollowUpWord(FollowUpKind::kVocabulary), "vocabulary");
}

TEST(Dense, Report) {
  DensifyReport report;
  report.reconstruction = ReconstructionId(1);
  report.device = "C++";
  report.voxel_size = 0.25;
  report.depth_side_px = 512;
  report.sensor_count = 2;
  report.depths = {1, 2, 3, 999, 4};
  report.volume.units = 17;
  report.colors.computed = 6;
  report.without_depth = {{ImageId(3), "c.jpg", "no sensor"}};
  report.tiles = 10;
  report.vertices = 11;
  report.triangles = 12;
  const std::string none = R"({"computed":0,"kept":0,"removed":0,"ms":0.0})";
  EXPECT_EQ(JsonLine(ToJson(report)),
            R"({"reconstruction":1,"device":"C++","voxel_size":0.25,"depth_side_px":512,)"
            R"("sensor_count":2,"without_depth":[{"id":3,"image":"c.jpg","reason":"no sensor"}],)"
            R"("depth_maps":{"computed":1,"kept":2,"removed":3,"ms":4.0},"checks":)" +
                none + R"(,"volume":)" + none + R"(,"blocks_changed":17,"fusion":)" + none +
                R"(,"surface":)" + none + R"(,"exposures":)" + none +
                R"(,"colors":{"computed":6,"kept":0,"removed":0,"ms":0.0},)"
                R"("tiles":10,"vertices":11,"triangles":12})");
}

TEST(Dense, Devices) {
  EXPECT_EQ(JsonLine(ToJson(DeviceList{})), R"({"devices":[]})");
  DeviceList list;
  list.devices = {{0, "a", "p", "1.0", DeviceKind::kCpu, 4, 1000, 10},
                  {1, "b", "q", "2.0", DeviceKind::kGpu, 64, 2000, 20}};
  list.chosen = 1;
  EXPECT_EQ(JsonLine(ToJson(list)),
            R"({"devices":[{"index":0,"name":"a","platform":"p","driver":"1.0","kind":"cpu",)"
            R"("compute_units":4,"memory_bytes":1000,"chosen":false},{"index":1,"name":"b",)"
            R"("platform":"q","driver":"2.0","kind":"gpu","compute_units":64,)"
            R"("memory_bytes":2000,"chosen":true}]})");
}

TEST(Removal, Answer) {
  RemoveAnswer answer;
  answer.uploads = 6;
  answer.removed = {{ImageId(4), "a.jpg", ReconstructionId(2), 77, {ImageId(5)}, true}};
  answer.copies = {"/copy"};
  const std::string removed =
      R"({"removed":[{"image":"a.jpg","id":4,"reconstruction":2,"observations":77,"unplaced":[5],)"
      R"("was_dense":true}],"uploads":6,"purged":)";
  EXPECT_EQ(JsonLine(ToJson(answer)), removed + R"(true,"why_not":null,"copies":["/copy"]})");
  answer.purged = Status::Busy("read by somebody");
  EXPECT_EQ(JsonLine(ToJson(answer)),
            removed + R"(false,"why_not":"read by somebody","copies":["/copy"]})");
}

TEST(Removal, Forbidden) {
  ForbiddenAnswer pair;
  pair.image_a = ImageId(1);
  pair.image_b = ImageId(2);
  pair.name_a = "a.jpg";
  pair.name_b = "b.jpg";
  pair.time_unix_s = 9;
  pair.actor = "bea";
  pair.reason = "two towers";
  EXPECT_EQ(JsonLine(ToJson(pair)),
            R"({"kind":"pair","a":1,"b":2,"image_a":"a.jpg","image_b":"b.jpg","time":9,)"
            R"("actor":"bea","reason":"two towers"})");
  ForbiddenAnswer merge;
  merge.kind = ForbidKind::kMerge;
  merge.reconstruction_a = ReconstructionId(3);
  merge.reconstruction_b = ReconstructionId(4);
  EXPECT_EQ(JsonLine(ToJson(merge)),
            R"({"kind":"merge","a":3,"b":4,"image_a":null,"image_b":null,"time":0,"actor":"",)"
            R"("reason":""})");
  ForbiddenAnswer pose;
  pose.kind = ForbidKind::kPose;
  pose.image_a = ImageId(5);
  pose.name_a = "c.jpg";
  EXPECT_EQ(JsonLine(ToJson(pose)),
            R"({"kind":"pose","a":5,"b":null,"image_a":"c.jpg","image_b":null,"time":0,"actor":"",)"
            R"("reason":""})");
}

TEST(Dense, Outputs) {
  EXPECT_EQ(JsonLine(ToJson(ExportedModel{ReconstructionId(1), "out/0", 2, 3, 4, 5})),
            R"({"reconstruction":1,"folder":"out/0","images":2,"points":3,"vertices":4,)"
            R"("triangles":5,"on_earth":false})");
  EXPECT_EQ(JsonLine(ToJson(RenderReport{0.5, 7, 6})),
            R"({"covered_share":0.5,"error_median":7.0,"error_median_balanced":6.0})");
}

TEST(JsonShapes, OfCamerasThatACityBeginsWith) {
  FirstCamera camera;
  camera.photos = 14;
  camera.why_not = "too few fit";
  const Json unknown = ToJson(camera);
  EXPECT_EQ(JsonLine(unknown),
            R"({"camera":null,"photos":14,"params":null,"focal_stddev_share":null,)"
            R"("why_not":"too few fit"})");
  EXPECT_EQ(FirstCameraText(unknown),
            "the camera of 14 photos could not be calibrated: too few fit");
  camera.name = "phone";
  camera.model = {640, 480, 500, 501, 319.5, 239.5, 0, 0, 319.5, 239.5};
  camera.focal_stddev_share = 0.0025;
  const Json known = ToJson(camera);
  EXPECT_EQ(known["camera"], "phone");
  EXPECT_EQ(known["focal_stddev_share"], 0.0025);
  EXPECT_EQ(FirstCameraText(known),
            "the camera of 14 photos is 'phone' now: " + known["params"].get<std::string>() +
                ", focal length to 0.25 %");
}

}  // namespace
}  // namespace veduta
