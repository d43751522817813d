// SPDX-License-Identifier: Apache-2.0
#include "engine/first_cameras.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "engine/alike_photos.h"
#include "engine/journal/camera_entry.h"
#include "engine/photo/camera_group.h"
#include "engine/scene_calibration.h"
#include "engine/unnamed_camera.h"
#include "storage/model/awaited_photos.h"

namespace veduta {
namespace {

// Standard deviation of the focal length over itself, up to which a city begins with a camera:
// without one it cannot begin. Where none of several cameras is known as well, as of tourists'
// photos, all of them are taken that are known to the second: what grows on them refines them
// (lens_refinement.h). Chosen by hand; not measured.
constexpr double kFocalShareMax = 0.01, kRoughFocalShareMax = 0.03;
// Pixels: photos of one size that several cameras took fit a common one worse. Chosen by hand; not
// measured.
constexpr double kErrorPxMax = 1.5;

// Photos that one camera took, as far as they say.
struct Group {
  std::string name;        // CameraGroupOf; empty where they do not tell
  double focal_share = 0;  // FocalShareOf; 0 where they do not tell
  std::vector<size_t> photos;
};

// What the photos say that name no camera.
std::vector<PhotoFacts> LookAtPhotos(EngineParts* parts, std::span<const PhotoSubmission> photos) {
  std::vector<PhotoFacts> facts(photos.size());
  parts->pool->ParallelFor(photos.size(), [&](size_t i) {
    if (!photos[i].camera.empty()) return;
    Result<PhotoFacts> looked = parts->preparer->Look(photos[i].photo);
    if (looked.ok()) facts[i] = *std::move(looked);  // if not, adding the photo says why
  });
  return facts;
}

// What names all of them, in their order.
ContentHash ListOf(std::span<const PhotoFacts> facts) {
  ContentHasher hasher;
  for (const PhotoFacts& one : facts) hasher.Add(one.hash.bytes);
  return hasher.Finish();
}

// By what the photos say of themselves, otherwise by their size and their 35 mm equivalent: who
// sends photos together that tell nothing has mostly taken them with one camera. In the order of
// their first photos. A photo whose camera is known already, or that cannot be read, is in none.
Result<std::vector<Group>> GroupPhotos(EngineParts* parts, std::span<const PhotoFacts> facts) {
  std::vector<Group> groups;
  std::map<std::string, std::vector<size_t>> index;
  for (size_t i = 0; i < facts.size(); ++i) {
    if (facts[i].shape.empty()) continue;
    VEDUTA_ASSIGN_OR_RETURN(const auto known, FindUnnamedCamera(parts, facts[i]));
    if (known) continue;
    const double focal_share = facts[i].focal_share.value_or(0);
    std::string key = facts[i].camera_group + "\n" + facts[i].shape;
    // Who does not name the camera may tell all the same that there are several.
    if (facts[i].camera_group.empty()) key += "\n" + std::to_string(focal_share);
    std::vector<size_t>& of_key = index[key];
    const auto at = std::ranges::find_if(
        of_key, [&](size_t group) { return IsToldAlike(groups[group].focal_share, focal_share); });
    const size_t group = at != of_key.end() ? *at : groups.size();
    if (at == of_key.end()) {
      of_key.push_back(group);
      groups.push_back({facts[i].camera_group, focal_share, {}});
    }
    groups[group].photos.push_back(i);
  }
  return groups;
}

std::string SourceOf(const Calibration& made) {
  char share[32];
  std::snprintf(share, sizeof(share), "%.2g", 100 * made.Sigma(0) / made.model.fx);
  return "calibrated by " + std::to_string(made.UsedPhotoCount()) +
         " photos together, its focal length to " + share + " %";
}

// The group's name, or one that says its size; where that is taken, with a number.
std::string NameOf(const Group& group, const Calibration& made,
                   const std::set<std::string>& taken) {
  const std::string wanted =
      !group.name.empty() ? group.name : SilentGroupOf({made.model.width_px, made.model.height_px});
  return NumberedName(wanted, [&](const std::string& name) { return taken.contains(name); });
}

// What photos say of the camera of a group, and whether it does.
struct Judged {
  const Group* group = nullptr;
  std::optional<Calibration> made;
  std::string why_not;  // where there is none
};

Judged Judge(const Group& group, const Result<Calibration>& made, double focal_share_max) {
  Judged judged{&group, {}, {}};
  if (!made.ok()) {
    judged.why_not = made.status().message();
  } else if (made->Sigma(0) > focal_share_max * made->model.fx) {
    judged.why_not = made->warnings.back().text;
  } else if (made->error_px_rms > kErrorPxMax) {
    judged.why_not = "no one camera explains them; name the camera of each";
  } else {
    judged.made = *made;
  }
  return judged;
}

// The photos that were used of cameras that are known.
size_t CountUsed(std::span<const Judged> judged) {
  size_t count = 0;
  for (const Judged& one : judged) count += one.made ? one.made->UsedPhotoCount() : 0;
  return count;
}

// Stores the cameras that are known, all or none, and names them to the photos of their groups.
Result<std::vector<FirstCamera>> Store(EngineParts* parts, std::span<const Judged> judged,
                                       std::span<const PhotoFacts> facts,
                                       std::span<PhotoSubmission> photos) {
  Writer::Turn turn = parts->writer->Take();
  const std::unique_ptr<Transaction> transaction = turn.database().BeginTransaction();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, transaction->base()->GetState());
  VEDUTA_ASSIGN_OR_RETURN(const auto known, transaction->base()->ListCameras());
  std::set<std::string> names;
  for (const CameraRecord& camera : known) names.insert(camera.name);
  const ContentHash list = ListOf(facts);
  std::vector<FirstCamera> stored;
  for (const Judged& one : judged) {
    FirstCamera& first = stored.emplace_back();
    first.photos = static_cast<uint32_t>(one.group->photos.size());
    first.why_not = one.why_not;
    if (!one.made) continue;
    first.name = NameOf(*one.group, *one.made, names);
    first.model = one.made->model;
    first.focal_stddev_share = one.made->Sigma(0) / one.made->model.fx;
    names.insert(first.name);
    CameraRecord camera{CameraId(state.next_camera++), first.name, first.model, SourceOf(*one.made),
                        true};
    const auto awaited = std::make_shared<AwaitedPhotos>();
    for (const size_t i : one.group->photos) awaited->photos.push_back(facts[i].hash);
    awaited->list = list;
    camera.awaited = awaited;
    camera.told_focal_share = one.group->focal_share;
    camera.focal_stddev_share = first.focal_stddev_share;
    PutNewCamera(camera, &state, transaction.get());
  }
  if (names.size() == known.size()) return stored;  // none is known
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  for (size_t i = 0; i < judged.size(); ++i)
    for (const size_t photo : judged[i].group->photos) photos[photo].camera = stored[i].name;
  return stored;
}

// Names to the photos the cameras that await them, where they are those of a list that was begun;
// whether they are.
Result<bool> GoOn(EngineParts* parts, std::span<const PhotoFacts> facts,
                  std::span<PhotoSubmission> photos) {
  VEDUTA_ASSIGN_OR_RETURN(const auto cameras, parts->database->GetSnapshot()->ListCameras());
  const ContentHash list = ListOf(facts);
  const auto awaits = [&](const CameraRecord& camera) {
    return camera.awaited && camera.awaited->list == list;
  };
  if (std::ranges::none_of(cameras, awaits)) return false;
  for (size_t i = 0; i < photos.size(); ++i) {
    if (!photos[i].camera.empty() || facts[i].shape.empty()) continue;
    VEDUTA_ASSIGN_OR_RETURN(const auto camera, FindUnnamedCamera(parts, facts[i]));
    if (camera) photos[i].camera = camera->name;
  }
  return true;
}

// What all groups have in common.
struct Calibrating {
  EngineParts* parts;
  std::span<PhotoSubmission> photos;
  std::stop_token stop;
  std::optional<AlikePhotos> alike;  // where there are more photos than are used

  uint32_t thread_count() const { return static_cast<uint32_t>(parts->pool->thread_count() + 1); }
  SceneCalibrationOptions options() const {
    SceneCalibrationOptions options;
    options.decoder = parts->tuning.decoder;
    return options;
  }
};

// Of the photos those that are used: all where these are few; otherwise those that show one place,
// for in a city's photos those that come first may show nothing in common.
std::vector<size_t> ChoosePhotos(const Calibrating& all, const std::vector<size_t>& photos) {
  return all.alike ? all.alike->Choose(photos, all.options().photos_max) : photos;
}

Result<Judged> CalibrateGroup(const Calibrating& all, const Group& group,
                              const std::vector<size_t>& chosen) {
  SceneCalibrationOptions options = all.options();
  options.told_focal_shares = {group.focal_share};
  std::vector<PhotoSource> sources;
  for (const size_t photo : chosen) sources.push_back(all.photos[photo].photo);
  const Result<Calibration> made = CalibrateByScene(sources, all.thread_count(), all.stop, options);
  if (made.status().code() == StatusCode::kCancelled) return made.status();
  return Judge(group, made, kFocalShareMax);
}

// The cameras of photos of which no group tells its own alone: what they see of one place together
// says what each of them is.
Result<std::vector<Judged>> CalibrateTogether(const Calibrating& all,
                                              std::span<const Group> groups) {
  SceneCalibrationOptions options = all.options();
  std::vector<size_t> photos;
  std::map<size_t, size_t> group_of;
  for (size_t g = 0; g < groups.size(); ++g) {
    for (const size_t photo : groups[g].photos) {
      photos.push_back(photo);
      group_of[photo] = g;
    }
  }
  std::ranges::sort(photos);
  std::vector<size_t> chosen = ChoosePhotos(all, photos);
  if (chosen.size() < options.images_min) chosen = photos;
  if (chosen.size() > options.photos_max) chosen.resize(options.photos_max);
  std::vector<PhotoSource> sources;
  std::vector<uint32_t> cameras;
  std::map<size_t, uint32_t> numbers;  // of groups that have one of the photos
  for (const size_t photo : chosen) {
    sources.push_back(all.photos[photo].photo);
    const auto [at, is_new] =
        numbers.try_emplace(group_of[photo], static_cast<uint32_t>(numbers.size()));
    if (is_new) options.told_focal_shares.push_back(groups[at->first].focal_share);
    cameras.push_back(at->second);
  }
  const auto made =
      CalibrateCamerasByScene(sources, cameras, all.thread_count(), all.stop, options);
  if (made.status().code() == StatusCode::kCancelled) return made.status();
  const bool is_any_known_well =
      made.ok() && std::ranges::any_of(*made, [](const Result<Calibration>& one) {
        return one.ok() && one->Sigma(0) <= kFocalShareMax * one->model.fx;
      });
  const double focal_share_max = is_any_known_well ? kFocalShareMax : kRoughFocalShareMax;
  std::vector<Judged> judged;
  for (size_t g = 0; g < groups.size(); ++g) {
    const auto number = numbers.find(g);
    if (!made.ok()) {
      judged.push_back({&groups[g], {}, made.status().message()});
    } else if (number != numbers.end()) {
      judged.push_back(Judge(groups[g], (*made)[number->second], focal_share_max));
    }
  }
  return judged;
}

// Photos that tell nothing were perhaps taken by many cameras though they have one size: each by
// itself.
std::vector<Group> SplitNameless(std::span<const Group> groups) {
  std::vector<Group> split;
  for (const Group& group : groups) {
    if (!group.name.empty()) {
      split.push_back(group);
      continue;
    }
    for (const size_t photo : group.photos) split.push_back({{}, group.focal_share, {photo}});
  }
  std::ranges::sort(split, {}, [](const Group& group) { return group.photos.front(); });
  return split;
}

// How many photos the groups have. Looks which of them are alike where more of them are there than
// are used.
Result<size_t> LookWhereMany(std::span<const Group> groups, Calibrating* all) {
  size_t count = 0;
  std::vector<PhotoSource> sources(all->photos.size());  // those of no group have no bytes
  for (const Group& group : groups) {
    count += group.photos.size();
    for (const size_t photo : group.photos) sources[photo] = all->photos[photo].photo;
  }
  const SceneCalibrationOptions options = all->options();
  if (count <= options.photos_max) return count;
  VEDUTA_ASSIGN_OR_RETURN(
      all->alike,
      AlikePhotos::Look(sources, options.decoder ? *options.decoder : DecoderInProcess(),
                        all->parts->pool.get(), all->stop));
  return count;
}

// Whether nothing better is sought: one that says its name is known, or `used_min` photos that were
// used have a camera. Photos of one size that say nothing may be of many cameras, and a few of them
// fit a common one by chance.
bool IsSettled(std::span<const Judged> judged, size_t used_min) {
  return CountUsed(judged) >= used_min || std::ranges::any_of(judged, [](const Judged& one) {
           return one.made && !one.group->name.empty();
         });
}

// Each group by itself that has photos enough, and that looks like one place.
Result<std::vector<Judged>> CalibrateEach(const Calibrating& all, std::span<const Group> groups) {
  const size_t images_min = all.options().images_min;
  std::vector<Judged> judged;
  for (const Group& group : groups) {
    if (group.photos.size() < images_min) continue;
    const std::vector<size_t> chosen = ChoosePhotos(all, group.photos);
    // What does not look alike is tried together with the others.
    if (chosen.size() < images_min && groups.size() > 1) continue;
    VEDUTA_ASSIGN_OR_RETURN(
        Judged one, CalibrateGroup(all, group, chosen.size() < images_min ? group.photos : chosen));
    judged.push_back(std::move(one));
  }
  return judged;
}

// The cameras by each group for itself, by all groups together, or by each photo that says nothing
// for itself: the first that settles it, or the one that explains most photos. `split` receives the
// groups of the last.
Result<std::vector<Judged>> CalibrateBest(const Calibrating& all, std::span<const Group> groups,
                                          size_t photo_count, std::vector<Group>* split) {
  const size_t used_min = std::min<size_t>(photo_count, all.options().photos_max) / 2;
  VEDUTA_ASSIGN_OR_RETURN(std::vector<Judged> best, CalibrateEach(all, groups));
  if (IsSettled(best, used_min) || photo_count < all.options().images_min) return best;
  const auto is_better = [&](const std::vector<Judged>& other) {
    return CountUsed(other) > CountUsed(best) || (best.empty() && !other.empty());
  };
  if (groups.size() > 1) {
    VEDUTA_ASSIGN_OR_RETURN(std::vector<Judged> together, CalibrateTogether(all, groups));
    if (is_better(together)) best = std::move(together);
    if (IsSettled(best, used_min)) return best;
  }
  *split = SplitNameless(groups);
  if (split->size() == groups.size()) return best;
  VEDUTA_ASSIGN_OR_RETURN(std::vector<Judged> alone, CalibrateTogether(all, *split));
  if (is_better(alone)) best = std::move(alone);
  return best;
}

}  // namespace

Result<std::vector<FirstCamera>> CalibrateFirst(EngineParts* parts,
                                                std::span<PhotoSubmission> photos,
                                                std::stop_token stop) {
  VEDUTA_ASSIGN_OR_RETURN(const auto reconstructions,
                          parts->database->GetSnapshot()->ListReconstructions());
  if (std::ranges::any_of(reconstructions, &ReconstructionRecord::is_living))
    return std::vector<FirstCamera>();
  const std::vector<PhotoFacts> facts = LookAtPhotos(parts, photos);
  VEDUTA_ASSIGN_OR_RETURN(const bool goes_on, GoOn(parts, facts, photos));
  if (goes_on) return std::vector<FirstCamera>();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<Group> groups, GroupPhotos(parts, facts));
  Calibrating all{parts, photos, std::move(stop), {}};
  VEDUTA_ASSIGN_OR_RETURN(const size_t photo_count, LookWhereMany(groups, &all));
  std::vector<Group> split;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<Judged> best,
                          CalibrateBest(all, groups, photo_count, &split));
  return Store(parts, best, facts, photos);
}

Result<bool> AwaitsPhotos(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const auto cameras, snapshot.ListCameras());
  return std::ranges::any_of(cameras,
                             [](const CameraRecord& camera) { return camera.awaited != nullptr; });
}

Status EndAwaiting(EngineParts* parts, const std::set<ContentHash>& photos) {
  Writer::Turn turn = parts->writer->Take();
  const std::unique_ptr<Transaction> transaction = turn.database().BeginTransaction();
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, transaction->base()->GetState());
  VEDUTA_ASSIGN_OR_RETURN(auto cameras, transaction->base()->ListCameras());
  const auto is_there = [&](const ContentHash& photo) { return photos.contains(photo); };
  std::set<ContentHash> ended;  // lists
  for (const CameraRecord& camera : cameras) {
    if (camera.awaited && std::ranges::any_of(camera.awaited->photos, is_there))
      ended.insert(camera.awaited->list);
  }
  if (ended.empty()) return Status::Ok();
  for (CameraRecord& camera : cameras) {
    if (!camera.awaited || !ended.contains(camera.awaited->list)) continue;
    camera.awaited = nullptr;
    transaction->PutCamera(camera);
  }
  transaction->PutState(state);
  return transaction->Commit();
}

}  // namespace veduta
