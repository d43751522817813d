// SPDX-License-Identifier: Apache-2.0
#include "engine/scene_calibration.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "engine/camera/calibration/calibration_advice.h"
#include "engine/camera/projection.h"
#include "engine/ingest/pair_verifier.h"
#include "engine/lens_scene.h"
#include "engine/parts.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

constexpr const char* kCameraName = "sought";
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

// What the search for a first focal length works on: photos as they were taken.
struct Scanned {
  uint32_t width_px = 0, height_px = 0;
  std::vector<std::shared_ptr<const ImageFeatures>> images;
  std::vector<CalibrationWarning> notes;  // on photos that cannot be used
};

Result<Scanned> ReadToScan(std::span<const PhotoSource> sources, const PhotoDecoder& decoder,
                           ThreadPool* pool) {
  UndistortCache tables(kTableBytes);
  const PhotoPreparer preparer(nullptr, &tables, PrepareOptions(), decoder);
  std::vector<PreparedPhoto> photos(sources.size());
  pool->ParallelFor(sources.size(),
                    [&](size_t i) { photos[i] = preparer.Extract(sources[i], std::nullopt); });
  Scanned scanned;
  for (PreparedPhoto& photo : photos) {
    if (!photo.failure.ok() || photo.reason != Reason::kNone) {
      const std::string why = photo.failure.ok() ? photo.detail : photo.failure.message();
      scanned.notes.push_back({CalibrationAdvice::kPhotoLeftOut, photo.name + ": " + why});
      continue;
    }
    if (scanned.images.empty()) {
      scanned.width_px = photo.width_px, scanned.height_px = photo.height_px;
    } else if (photo.width_px != scanned.width_px || photo.height_px != scanned.height_px) {
      return Status::InvalidArgument(
          photo.name + " is " + std::to_string(photo.width_px) + "x" +
          std::to_string(photo.height_px) + ", the photos before it are " +
          std::to_string(scanned.width_px) + "x" + std::to_string(scanned.height_px) +
          ": calibrate the photos of each camera, each zoom and each size by themselves");
    }
    const ImageId id(static_cast<uint32_t>(scanned.images.size() + 1));
    VEDUTA_ASSIGN_OR_RETURN(
        auto image,
        ImageFeatures::Make(id, FirstGuess(photo.width_px, photo.height_px, photo.width_px),
                            std::make_shared<const Features>(std::move(photo.features)),
                            IngestOptions().matched_count_max));
    scanned.images.push_back(std::move(image));
  }
  return scanned;
}

CenteredMatches MatchCentered(const ImageFeatures& a, const ImageFeatures& b) {
  const Eigen::Vector2d middle(0.5 * (a.width_px - 1), 0.5 * (a.height_px - 1));
  std::vector<DescriptorMatch> matches =
      MatchMutual(a.packed, b.packed, {.ratio_max = PairOptions().ratio_max});
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

// Focal lengths to begin with, the best first.
std::vector<double> ScanFocals(const Scanned& scanned, const SceneCalibrationOptions& options,
                               ThreadPool* pool) {
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
  return RankFocalLengths(pairs, std::max(scanned.width_px, scanned.height_px), options.scan, pool);
}

// A reconstruction that was made of the photos with some camera.
struct TrialScene {
  LensScene lens;
  std::map<uint32_t, std::string> refused;  // photos that are none, or cannot be read, and why
};

// What every trial begins with.
struct Trials {
  std::span<const PhotoSource> photos;
  uint32_t thread_count = 1;
  std::stop_token stop;
  const SceneCalibrationOptions& options;
};

Result<TrialScene> BuildScene(const Trials& trials, const CameraModel& camera) {
  VEDUTA_ASSIGN_OR_RETURN(const TemporaryFolder folder, TemporaryFolder::Make());
  EngineOptions options;
  options.create = true;
  options.sync = false;
  options.thread_count = trials.thread_count;
  EngineTuning tuning;
  tuning.decoder = trials.options.decoder;
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Engine> engine,
                          EngineParts::Open(folder.path() + "/city", options, tuning));
  VEDUTA_RETURN_IF_ERROR(engine->AddCamera(kCameraName, camera, "sought").status());
  std::vector<PhotoSubmission> photos;
  for (size_t i = 0; i < trials.photos.size(); ++i) {
    photos.push_back({trials.photos[i], kCameraName, "calibrate"});
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
                          ReadLensScene(*engine, camera, trials.options.points_max));
  return TrialScene{std::move(scene), std::move(refused)};
}

Status TooLittle(const std::vector<CalibrationWarning>& notes) {
  std::string message =
      "too few of the photos fit together to tell their camera; take ten or more of one place from "
      "different places, a step or two apart, each showing much of what the one before shows";
  for (const CalibrationWarning& note : notes) message += "\n  " + note.text;
  return Status::InvalidArgument(std::move(message));
}

// The first of the focal lengths with which enough photos are placed, with its reconstruction.
Result<std::optional<TrialScene>> Begin(const Trials& trials, const Scanned& scanned,
                                        ThreadPool* pool) {
  const SceneCalibrationOptions& options = trials.options;
  std::vector<double> focals = ScanFocals(scanned, options, pool);
  if (focals.size() > options.starts_max) focals.resize(options.starts_max);
  for (const double focal_px : focals) {
    const CameraModel guess = FirstGuess(scanned.width_px, scanned.height_px, focal_px);
    VEDUTA_ASSIGN_OR_RETURN(TrialScene trial, BuildScene(trials, guess));
    if (trial.lens.photos.size() >= options.images_min &&
        trial.lens.scene.points.size() >= kPointsMin)
      return std::optional(std::move(trial));
  }
  return std::optional<TrialScene>();
}

std::string PercentText(double share) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.2g %%", 100 * share);
  return text;
}

// What is told of each photo, and of all.
void TellErrors(const AdjustedLens& adjusted, const std::map<uint32_t, std::string>& why_refused,
                std::span<const PhotoSource> photos, Calibration* made) {
  const LensScene& scene = adjusted.scene;
  for (const PhotoSource& photo : photos) {
    const auto refused = why_refused.find(static_cast<uint32_t>(made->photos.size()));
    made->photos.push_back({.name = photo.name,
                            .why_left_out = refused == why_refused.end()
                                                ? "it does not fit to the others"
                                                : refused->second});
  }
  double sum = 0, square_sum = 0;
  for (size_t i = 0; i < scene.observations.size(); ++i) {
    const PlaneObservation& seen = scene.observations[i];
    const Eigen::Vector2d& residual = adjusted.made.residuals_px[i];
    const uint32_t at = scene.photos[seen.view];
    CalibrationPhoto& photo = made->photos[at];
    photo.why_left_out.clear();
    ++photo.used_count;
    photo.error_px_rms += residual.squaredNorm();
    sum += residual.norm(), square_sum += residual.squaredNorm();
    made->residuals.push_back({at, seen.point, seen.px, residual, true});
  }
  for (CalibrationPhoto& photo : made->photos)
    photo.error_px_rms = std::sqrt(photo.error_px_rms / std::max(1u, photo.used_count));
  const auto count = static_cast<double>(std::max<size_t>(1, scene.observations.size()));
  made->error_px_mean = sum / count;
  made->error_px_rms = std::sqrt(square_sum / count);
}

Calibration CalibrationOf(const AdjustedLens& adjusted,
                          const std::map<uint32_t, std::string>& why_refused,
                          std::span<const PhotoSource> photos, double scanned_focal_px) {
  Calibration made;
  made.model = adjusted.scene.scene.camera;
  made.covariance = adjusted.made.covariance;
  made.focal_search_px = scanned_focal_px;
  TellErrors(adjusted, why_refused, photos, &made);
  made.distortion_sigma_px = LargestDistortionSigma(made.model, made.covariance);
  for (const CalibrationPhoto& photo : made.photos) {
    if (!photo.why_left_out.empty())
      made.warnings.push_back(
          {CalibrationAdvice::kPhotoLeftOut, photo.name + ": left out: " + photo.why_left_out});
  }
  made.status = CalibrationStatus::kGood;
  if (adjusted.FocalShare() > kGoodShareMax) {
    made.status = CalibrationStatus::kUncertain;
    made.warnings.push_back(
        {CalibrationAdvice::kFocalLength,
         "The focal length is known to " + PercentText(adjusted.FocalShare()) +
             " only. Add photos from more places, nearer and farther, or calibrate with printed "
             "markers."});
  }
  return made;
}

}  // namespace

Status SceneCalibrationOptions::Check() const {
  return OptionBounds()
      .AtLeast("photos_max", photos_max, 4)
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

Result<Calibration> CalibrateByScene(std::span<const PhotoSource> photos, uint32_t thread_count,
                                     std::stop_token stop, const SceneCalibrationOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  ThreadPool pool(thread_count - 1);
  photos = photos.first(std::min<size_t>(photos.size(), options.photos_max));
  const Trials trials{photos, thread_count, std::move(stop), options};
  const auto to_scan = photos.first(std::min<size_t>(photos.size(), options.scanned_photos_max));
  VEDUTA_ASSIGN_OR_RETURN(
      const Scanned scanned,
      ReadToScan(to_scan, options.decoder ? *options.decoder : DecoderInProcess(), &pool));
  VEDUTA_ASSIGN_OR_RETURN(std::optional<TrialScene> trial, Begin(trials, scanned, &pool));
  if (!trial) return TooLittle(scanned.notes);
  const double scanned_focal_px = trial->lens.scene.camera.fx;
  for (uint32_t round = 1;; ++round) {
    const double before_px = trial->lens.scene.camera.fx;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<AdjustedLens> adjusted,
                            AdjustLens(std::move(trial->lens), options.images_min));
    if (!adjusted || !adjusted->made.is_determined || !(adjusted->FocalShare() <= kKnownShareMax))
      return TooLittle(scanned.notes);
    const CameraModel& camera = adjusted->scene.scene.camera;
    if (!CheckCamera(camera).ok()) return TooLittle(scanned.notes);
    if (std::abs(std::log(camera.fx / before_px)) <= options.rest_share ||
        round >= options.rounds_max)
      return CalibrationOf(*adjusted, trial->refused, photos, scanned_focal_px);
    VEDUTA_ASSIGN_OR_RETURN(*trial, BuildScene(trials, camera));
  }
}

}  // namespace veduta
