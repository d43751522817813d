// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that are stored already in another file: resized or encoded anew, as messengers do.

#include <optional>
#include <span>

#include "engine/camera/decoder.h"
#include "engine/ingest/counterparts.h"
#include "engine/mapping/pair_matches.h"
#include "engine/photo/image_features.h"
#include "storage/database.h"

namespace veduta {

// The new photo, as it is to be stored, with the features that its matches name.
struct NewPhoto {
  const ImageRecord& record;
  const CameraModel& camera;
  const ImageFeatures& features;
};

struct StoredDouble {
  ImageRecord image;
  double scale = 1;  // the new photo's width over that of the stored one
};

// Whether two photos match as one picture does with itself: their sizes, upright, have one ratio,
// and nearly all of the matches lie where that ratio puts them. `a` of a match is a feature of the
// first.
bool MatchAsOnePicture(const PictureCopy& first, const PictureCopy& second,
                       std::span<const FeatureMatch> matches);

// Whether two pictures (CV_8UC1, not empty) of about one shape show the same in all of their parts,
// but for their sizes, for brightness and contrast, and for what encoding does.
bool ShowTheSame(const cv::Mat& first, const cv::Mat& second);

// Of the stored photos that it has verified pairs with, the one whose picture the new photo shows,
// all of it: that with most matches. What somebody takes twice from a tripod are two photos, where
// anything has moved or where they say that they were taken at different times. Only where the
// matches say so are both photos decoded. kNoMemory; damaged photos are passed over. Deterministic.
Result<std::optional<StoredDouble>> FindDouble(const Snapshot& snapshot,
                                               const PhotoDecoder& decoder,
                                               ImageFeatureCache* features, const NewPhoto& photo,
                                               std::span<const PairMatches> pairs);

}  // namespace veduta
