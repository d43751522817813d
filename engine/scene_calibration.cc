// SPDX-License-Identifier: Apache-2.0
#include "engine/scene_calibration.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "engine/camera/calibration/calibration_advice.h"
#include "engine/camera/projection.h"
#include "engine/ingest/pair_verifier.h"
#include "engine/lens_scene.h"
#include "engine/parts.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Standard deviation of the focal length over itself, up to which it counts as known, and beyond
// which it counts as open. Chosen by hand.
constexpr double kGoodShareMax = 0.003, kKnownShareMax = 0.03;
// Points of a reconstruction that may say what the camera is. Chosen by hand.
constexpr size_t kPointsMin = 100;
// Memory for what the features are extracted with; there is no lens to undo yet.
constexpr size_t kTableBytes = 1 << 20;

// A folder of its own among the system's temporary files, deleted with everything in it.
class TemporaryFolder final {
 public:
  static Result<TemporaryFolder> Make() {
    std::error_code error;
    std::string path = std::filesystem::temp_directory_path(error) / "veduta-calibrate-XXXXXX";
    if (error || mkdtemp(path.data()) == nullptr)
      return Status::IoError("calibrate: no folder can be made among the temporary files");
    return TemporaryFolder(std::move(path));
  }
  TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  TemporaryFolder& operator=(TemporaryFolder&&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  const std::string& path() const { return path_; }

 private:
  explicit TemporaryFolder(std::string path) : path_(std::move(path)) {}
  std::string path_;
};

CameraModel FirstGuess(uint32_t width_px, uint32_t height_px, double focal_px) {
  CameraModel camera;
  camera.width_px = width_px, camera.height_px = height_px;
  camera.fx = camera.fy = focal_px;
  camera.cx = camera.u0 = 0.5 * (width_px - 1);
  camera.cy = camera.v0 = 0.5 * (height_px - 1);
  return camera;
}

struct PhotoSize {
  uint32_t width_px = 64, height_px = 64;  // of a camera of which no photo can be read
  bool is_known = false;
  uint32_t side_px() const { return std::max(width_px, height_px); }
};

// What every trial begins with.
struct Trials {
  std::span<const PhotoSource> photos;
  std::span<const uint32_t> cameras;  // of the photos
  uint32_t camera_count = 1;
  uint32_t thread_count = 1;
  std::stop_token stop;
  const SceneCalibrationOptions& options;
};

// What the search for a first focal length works on: photos as they were taken.
struct Scanned {
  std::vector<PhotoSize> sizes;  // of the cameras
  std::vector<std::shared_ptr<const ImageFeatures>> images;
  std::vector<CalibrationWarning> notes;  // on photos that cannot be used
};

// The first photo of each camera, and of the others the first ones up to so many; ascending.
std::vector<size_t> ListToScan(std::span<const uint32_t> cameras, size_t count_max) {
  std::vector<size_t> chosen, others;
  std::set<uint32_t> met;
  for (size_t i = 0; i < cameras.size(); ++i)
    (met.insert(cameras[i]).second ? chosen : others).push_back(i);
  for (size_t i = 0; i < others.size() && chosen.size() < count_max; ++i)
    chosen.push_back(others[i]);
  std::ranges::sort(chosen);
  return chosen;
}

Result<Scanned> ReadToScan(const Trials& trials, const PhotoDecoder& decoder, ThreadPool* pool) {
  const std::vector<size_t> chosen = ListToScan(trials.cameras, trials.options.scanned_photos_max);
  UndistortCache tables(kTableBytes);
  const PhotoPreparer preparer(nullptr, &tables, PrepareOptions(), decoder);
  std::vector<PreparedPhoto> photos(chosen.size());
  pool->ParallelFor(chosen.size(), [&](size_t i) {
    photos[i] = preparer.Extract(trials.photos[chosen[i]], std::nullopt);
  });
  Scanned scanned;
  scanned.sizes.resize(trials.camera_count);
  for (size_t i = 0; i < chosen.size(); ++i) {
    PreparedPhoto& photo = photos[i];
    if (!photo.failure.ok() || photo.reason != Reason::kNone) {
      const std::string why = photo.failure.ok() ? photo.detail : photo.failure.message();
      scanned.notes.push_back({CalibrationAdvice::kPhotoLeftOut, photo.name + ": " + why});
      continue;
    }
    PhotoSize& size = scanned.sizes[trials.cameras[chosen[i]]];
    if (!size.is_known) {
      size = {photo.width_px, photo.height_px, true};
    } else if (photo.width_px != size.width_px || photo.height_px != size.height_px) {
      return Status::InvalidArgument(
          photo.name + " is " + std::to_string(photo.width_px) + "x" +
          std::to_string(photo.height_px) + ", the photos before it are " +
          std::to_string(size.width_px) + "x" + std::to_string(size.height_px) +
          ": calibrate the photos of each camera, each zoom and each size by themselves");
    }
    const ImageId id(static_cast<uint32_t>(scanned.images.size() + 1));
    VEDUTA_ASSIGN_OR_RETURN(
        auto image,
        ImageFeatures::Make(id, FirstGuess(photo.width_px, photo.height_px, photo.width_px),
                            std::make_shared<const Features>(std::move(photo.features)),
                            IngestOptions().matched_count_max, ImageFeatures::Packing::kKept));
    scanned.images.push_back(std::move(image));
  }
  return scanned;
}

CenteredMatches MatchCentered(const ImageFeatures& a, const ImageFeatures& b) {
  const Eigen::Vector2d middle(0.5 * (a.width_px - 1), 0.5 * (a.height_px - 1));
  std::vector<DescriptorMatch> matches =
      MatchMutual(*a.Packed(), *b.Packed(), {.ratio_max = PairOptions().ratio_max});
  std::ranges::stable_sort(matches, {}, [](const DescriptorMatch& m) {
    return static_cast<double>(m.distance_squared) / std::max(1u, m.second_distance_squared);
  });
  CenteredMatches centered;
  for (const DescriptorMatch& m : matches) {
    const Keypoint &at_a = a.features->keypoints[m.a], &at_b = b.features->keypoints[m.b];
    centered.a.push_back(Eigen::Vector2d(at_a.x_px, at_a.y_px) - middle);
    centered.b.push_back(Eigen::Vector2d(at_b.x_px, at_b.y_px) - middle);
  }
  return centered;
}

// Focal lengths of one camera to begin with, over the longer side, the best first.
std::vector<double> ScanFocals(const Scanned& scanned, const SceneCalibrationOptions& options,
                               ThreadPool* pool) {
  const double side_px = scanned.sizes.front().side_px();
  std::vector<std::pair<size_t, size_t>> two;
  for (size_t j = 1; j < scanned.images.size(); ++j) {
    for (size_t i = 0; i < j; ++i) two.emplace_back(i, j);
  }
  std::vector<CenteredMatches> pairs(two.size());
  pool->ParallelFor(two.size(), [&](size_t i) {
    pairs[i] = MatchCentered(*scanned.images[two[i].first], *scanned.images[two[i].second]);
  });
  std::ranges::stable_sort(pairs, std::greater<>(),
                           [](const CenteredMatches& pair) { return pair.a.size(); });
  if (pairs.size() > options.scanned_pairs_max) pairs.resize(options.scanned_pairs_max);
  std::vector<double> focals = RankFocalLengths(pairs, side_px, options.scan, pool);
  if (focals.size() > options.starts_max) focals.resize(options.starts_max);
  for (double& focal : focals) focal /= side_px;
  return focals;
}

// A reconstruction that was made of the photos with some cameras.
struct TrialScene {
  LensScene lens;
  std::map<uint32_t, std::string> refused;  // photos that are none, or cannot be read, and why
};

// How much less sure a trial of several cameras may be of where its views stand than a city: with
// lenses that are only guessed, nothing is sure. Chosen by hand.
constexpr double kUnsureTimes = 4;

void AllowUnsure(MapperOptions* mapper) {
  mapper->deviation_share_max *= kUnsureTimes;
  mapper->founding.deviation_share_max *= kUnsureTimes;
  mapper->founding.network_deviation_share_max *= kUnsureTimes;
}

Result<TrialScene> BuildScene(const Trials& trials, const std::vector<CameraModel>& cameras) {
  VEDUTA_ASSIGN_OR_RETURN(const TemporaryFolder folder, TemporaryFolder::Make());
  EngineOptions options;
  options.create = true;
  options.sync = false;
  options.thread_count = trials.thread_count;
  EngineTuning tuning;
  tuning.decoder = trials.options.decoder;
  if (cameras.size() > 1) AllowUnsure(&tuning.ingest.mapper);
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Engine> engine,
                          EngineParts::Open(folder.path() + "/city", options, tuning));
  for (size_t i = 0; i < cameras.size(); ++i)
    VEDUTA_RETURN_IF_ERROR(engine->AddCamera(std::to_string(i), cameras[i], "sought").status());
  std::vector<PhotoSubmission> photos;
  for (size_t i = 0; i < trials.photos.size(); ++i) {
    photos.push_back({trials.photos[i], std::to_string(trials.cameras[i]), "calibrate"});
    photos.back().photo.name = std::to_string(i);
  }
  std::map<uint32_t, std::string> refused;
  uint32_t index = 0;
  const auto report = [&](const AddOutcome& outcome) {
    if (!outcome.failure.ok()) refused[index] = outcome.failure.message();
    if (outcome.verdict == Verdict::kRejected) refused[index] = outcome.detail;
    ++index;
  };
  VEDUTA_RETURN_IF_ERROR(engine->AddPhotos(photos, report, trials.stop));
  VEDUTA_ASSIGN_OR_RETURN(LensScene scene,
                          ReadLensScene(*engine, cameras, trials.options.points_max));
  return TrialScene{std::move(scene), std::move(refused)};
}

Status TooLittle(const std::vector<CalibrationWarning>& notes) {
  std::string message =
      "too few of the photos fit together to tell their camera; take ten or more of one place from "
      "different places, a step or two apart, each showing much of what the one before shows";
  for (const CalibrationWarning& note : notes) message += "\n  " + note.text;
  return Status::InvalidArgument(std::move(message));
}

// Focal lengths over the longer side that are tried for several cameras, whose own differ: from
// wide telephones to what sees 36 degrees. Two views of different cameras do not tell them. Chosen
// by hand.
constexpr double kFocalsOfSeveral[] = {0.65, 0.75, 0.85, 0.97, 1.1, 1.25, 1.45};

// The focal lengths of the cameras, over the longer side, as their photos tell them, and the median
// of these for the others; empty where none tells any.
std::vector<double> ToldFocals(const Trials& trials) {
  std::vector<double> focals(trials.camera_count), told;
  for (size_t i = 0; i < trials.options.told_focal_shares.size() && i < focals.size(); ++i) {
    focals[i] = trials.options.told_focal_shares[i];
    if (focals[i] > 0) told.push_back(focals[i]);
  }
  if (told.empty()) return {};
  std::ranges::replace(focals, 0, MedianOf(told));
  return focals;
}

Result<TrialScene> TryFocals(const Trials& trials, const Scanned& scanned,
                             const std::vector<double>& focals) {
  std::vector<CameraModel> guesses;
  for (size_t i = 0; i < focals.size(); ++i) {
    const PhotoSize& size = scanned.sizes[i];
    guesses.push_back(FirstGuess(size.width_px, size.height_px, focals[i] * size.side_px()));
  }
  return BuildScene(trials, guesses);
}

bool IsEnough(const TrialScene& trial, const SceneCalibrationOptions& options) {
  return trial.lens.photos.size() >= options.images_min &&
         trial.lens.scene.points.size() >= kPointsMin;
}

// A reconstruction in which enough photos are placed: with what the photos tell, where that places
// half of them; otherwise for one camera by the first focal length of the scan that gives one, and
// for several the one with most photos.
Result<std::optional<TrialScene>> Begin(const Trials& trials, const Scanned& scanned,
                                        ThreadPool* pool) {
  std::optional<TrialScene> best;
  if (const std::vector<double> told = ToldFocals(trials); !told.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(TrialScene trial, TryFocals(trials, scanned, told));
    const size_t count = trial.lens.photos.size();
    if (IsEnough(trial, trials.options)) best = std::move(trial);
    if (best && 2 * count >= trials.photos.size()) return best;
  }
  std::vector<double> focals(std::begin(kFocalsOfSeveral), std::end(kFocalsOfSeveral));
  if (trials.camera_count == 1) focals = ScanFocals(scanned, trials.options, pool);
  for (const double focal : focals) {
    const std::vector<double> same(trials.camera_count, focal);
    VEDUTA_ASSIGN_OR_RETURN(TrialScene trial, TryFocals(trials, scanned, same));
    if (!IsEnough(trial, trials.options)) continue;
    const size_t count = trial.lens.photos.size();
    if (!best || count > best->lens.photos.size()) best = std::move(trial);
    if (trials.camera_count == 1 || count == trials.photos.size()) break;
  }
  return best;
}

// Takes over what the adjustment has found of the cameras, where that is known to some percent, and
// for the others the median of their focal lengths over the longer side. Of each camera whether it
// is known.
std::vector<bool> TakeOver(const AdjustedLens& adjusted, std::vector<CameraModel>* cameras) {
  std::vector<bool> is_known(cameras->size());
  std::vector<double> focals;
  const auto side_px = [](const CameraModel& c) { return std::max(c.width_px, c.height_px); };
  for (size_t i = 0; i < adjusted.scene.cameras.size(); ++i) {
    const CameraModel& camera = adjusted.scene.scene.cameras[i];
    if (!(adjusted.FocalShare(i) <= kKnownShareMax) || !CheckCamera(camera).ok()) continue;
    is_known[adjusted.scene.cameras[i]] = true;
    (*cameras)[adjusted.scene.cameras[i]] = camera;
    focals.push_back(camera.fx / side_px(camera));
  }
  if (focals.empty()) return is_known;
  const double focal = MedianOf(focals);
  for (size_t i = 0; i < cameras->size(); ++i) {
    CameraModel& camera = (*cameras)[i];
    if (!is_known[i])
      camera = FirstGuess(camera.width_px, camera.height_px, focal * side_px(camera));
  }
  return is_known;
}

std::string PercentText(double share) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.2g %%", 100 * share);
  return text;
}

// What is told of each photo of a camera, and of all of them.
void TellErrors(const AdjustedLens& adjusted, size_t camera, const TrialScene& trial,
                const Trials& trials, Calibration* made) {
  const LensScene& scene = adjusted.scene;
  std::map<uint32_t, uint32_t> places;  // of the camera's photos
  for (uint32_t i = 0; i < trials.photos.size(); ++i) {
    if (trials.cameras[i] != scene.cameras[camera]) continue;
    places[i] = static_cast<uint32_t>(made->photos.size());
    const auto refused = trial.refused.find(i);
    made->photos.push_back({.name = trials.photos[i].name,
                            .why_left_out = refused == trial.refused.end()
                                                ? "it does not fit to the others"
                                                : refused->second});
  }
  double sum = 0, square_sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < scene.observations.size(); ++i) {
    const PlaneObservation& seen = scene.observations[i];
    if (scene.scene.CameraOf(seen.view) != camera) continue;
    const Eigen::Vector2d& residual = adjusted.made.residuals_px[i];
    const uint32_t at = places.at(scene.photos[seen.view]);
    CalibrationPhoto& photo = made->photos[at];
    photo.why_left_out.clear();
    ++photo.used_count, ++count;
    photo.error_px_rms += residual.squaredNorm();
    sum += residual.norm(), square_sum += residual.squaredNorm();
    made->residuals.push_back({at, seen.point, seen.px, residual, true});
  }
  for (CalibrationPhoto& photo : made->photos)
    photo.error_px_rms = std::sqrt(photo.error_px_rms / std::max(1u, photo.used_count));
  made->error_px_mean = sum / static_cast<double>(std::max<size_t>(1, count));
  made->error_px_rms = std::sqrt(square_sum / static_cast<double>(std::max<size_t>(1, count)));
}

Calibration CalibrationOf(const AdjustedLens& adjusted, size_t camera, const TrialScene& trial,
                          const Trials& trials, double scanned_focal_px) {
  Calibration made;
  made.model = adjusted.scene.scene.cameras[camera];
  made.covariance = adjusted.made.covariances[camera];
  made.focal_search_px = scanned_focal_px;
  TellErrors(adjusted, camera, trial, trials, &made);
  made.distortion_sigma_px = LargestDistortionSigma(made.model, made.covariance);
  for (const CalibrationPhoto& photo : made.photos) {
    if (!photo.why_left_out.empty())
      made.warnings.push_back(
          {CalibrationAdvice::kPhotoLeftOut, photo.name + ": left out: " + photo.why_left_out});
  }
  made.status = CalibrationStatus::kGood;
  if (adjusted.FocalShare(camera) > kGoodShareMax) {
    made.status = CalibrationStatus::kUncertain;
    made.warnings.push_back(
        {CalibrationAdvice::kFocalLength,
         "The focal length is known to " + PercentText(adjusted.FocalShare(camera)) +
             " only. Add photos from more places, nearer and farther, or calibrate with printed "
             "markers."});
  }
  return made;
}

Result<std::vector<Result<Calibration>>> CalibrationsOf(const AdjustedLens& adjusted,
                                                        const std::vector<bool>& is_known,
                                                        const TrialScene& trial,
                                                        const Trials& trials,
                                                        const std::vector<CameraModel>& scanned) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<uint32_t> many,
                          ListManyLensed(adjusted.scene, trials.options.images_min));
  // What was adjusted with one that is none is wrong in all.
  if (!many.empty()) {
    const Status wrong = Status::InvalidArgument(
        "one by one the photos want other focal lengths than together: calibrate those of each "
        "camera and each zoom by themselves, or take more from other sides");
    return std::vector<Result<Calibration>>(trials.camera_count, wrong);
  }
  std::vector<Result<Calibration>> made(trials.camera_count, TooLittle({}));
  for (size_t i = 0; i < adjusted.scene.cameras.size(); ++i) {
    const uint32_t camera = adjusted.scene.cameras[i];
    if (is_known[camera])
      made[camera] = CalibrationOf(adjusted, i, trial, trials, scanned[camera].fx);
  }
  return made;
}

// Whether no focal length that is known has moved much.
bool IsAtRest(const std::vector<CameraModel>& before, const std::vector<CameraModel>& after,
              const std::vector<bool>& is_known, double rest_share) {
  for (size_t i = 0; i < after.size(); ++i) {
    if (is_known[i] && std::abs(std::log(after[i].fx / before[i].fx)) > rest_share) return false;
  }
  return true;
}

}  // namespace

Status SceneCalibrationOptions::Check() const {
  OptionBounds bounds;
  for (const double share : told_focal_shares) bounds.AtLeast("told_focal_shares", share, 0);
  return bounds.AtLeast("photos_max", photos_max, 4)
      .AtLeast("scanned_photos_max", scanned_photos_max, 2)
      .AtLeast("scanned_pairs_max", scanned_pairs_max, 1)
      .AtLeast("starts_max", starts_max, 1)
      .AtLeast("images_min", images_min, 4)
      .AtLeast("rounds_max", rounds_max, 1)
      .FiniteAbove("rest_share", rest_share, 0)
      .AtLeast("points_max", points_max, 100)
      .Part("scan", scan.Check())
      .status();
}

Result<std::vector<Result<Calibration>>> CalibrateCamerasByScene(
    std::span<const PhotoSource> photos, std::span<const uint32_t> cameras, uint32_t thread_count,
    std::stop_token stop, const SceneCalibrationOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  if (cameras.size() != photos.size() || photos.empty())
    return Status::InvalidArgument("calibrate: no photos, or not a camera for each");
  ThreadPool pool(thread_count - 1);
  const size_t used = std::min<size_t>(photos.size(), options.photos_max);
  photos = photos.first(used), cameras = cameras.first(used);
  const uint32_t camera_count = *std::ranges::max_element(cameras) + 1;
  const Trials trials{photos, cameras, camera_count, thread_count, std::move(stop), options};
  VEDUTA_ASSIGN_OR_RETURN(
      const Scanned scanned,
      ReadToScan(trials, options.decoder ? *options.decoder : DecoderInProcess(), &pool));
  VEDUTA_ASSIGN_OR_RETURN(std::optional<TrialScene> trial, Begin(trials, scanned, &pool));
  if (!trial) return TooLittle(scanned.notes);
  const std::vector<CameraModel> first = trial->lens.scene.cameras;
  std::vector<CameraModel> found = first;
  for (uint32_t round = 1;; ++round) {
    const std::vector<CameraModel> before = found;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<AdjustedLens> adjusted,
                            AdjustLens(std::move(trial->lens), options.images_min));
    if (!adjusted || !adjusted->made.is_determined) return TooLittle(scanned.notes);
    const std::vector<bool> is_known = TakeOver(*adjusted, &found);
    if (std::ranges::find(is_known, true) == is_known.end()) return TooLittle(scanned.notes);
    if (IsAtRest(before, found, is_known, options.rest_share) || round >= options.rounds_max)
      return CalibrationsOf(*adjusted, is_known, *trial, trials, first);
    VEDUTA_ASSIGN_OR_RETURN(*trial, BuildScene(trials, found));
  }
}

Result<Calibration> CalibrateByScene(std::span<const PhotoSource> photos, uint32_t thread_count,
                                     std::stop_token stop, const SceneCalibrationOptions& options) {
  if (photos.empty()) return TooLittle({});
  const std::vector<uint32_t> one(photos.size(), 0);
  VEDUTA_ASSIGN_OR_RETURN(
      std::vector<Result<Calibration>> made,
      CalibrateCamerasByScene(photos, one, thread_count, std::move(stop), options));
  return std::move(made.front());
}

}  // namespace veduta
