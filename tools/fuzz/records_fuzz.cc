// SPDX-License-Identifier: Apache-2.0
// Decode of every record that is stored, and the readers of keys. The first byte chooses the kind,
// the rest is the value. What is decoded must be fit to be stored again.
#include <array>

#include "storage/records/border_record.h"
#include "storage/records/camera_record.h"
#include "storage/records/contribution_record.h"
#include "storage/records/dense_settings.h"
#include "storage/records/depth_record.h"
#include "storage/records/earth_record.h"
#include "storage/records/forbidden_record.h"
#include "storage/records/hidden_record.h"
#include "storage/records/hypothesis_record.h"
#include "storage/records/image_record.h"
#include "storage/records/journal_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/pair_record.h"
#include "storage/records/partial_upload_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/point_block.h"
#include "storage/records/pose_record.h"
#include "storage/records/reconstruction_record.h"
#include "storage/records/report_record.h"
#include "storage/records/state_record.h"
#include "storage/records/submap_record.h"
#include "storage/records/tile_record.h"
#include "storage/records/token_record.h"
#include "storage/records/token_use_record.h"
#include "storage/records/upload_record.h"
#include "storage/records/vocabulary_record.h"
#include "storage/records/write_ahead_mark.h"
#include "tests/storage/dense_samples.h"
#include "tests/storage/samples.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {
namespace {

constexpr const char* kFitToStore = "a record that is read can be written";
constexpr const char* kFitToRead = "a record that is written can be read";

// Calls decode(value, &record), and again on what an accepted record is written as.
template <typename Record, typename DecodeIt, typename EncodeIt>
void RoundTrip(std::string_view value, Record record, DecodeIt&& decode, EncodeIt&& encode) {
  if (!decode(value, &record).ok()) return;
  const Result<std::string> written = encode(record);
  Expect(written.status(), kFitToStore);
  Record again = record;
  Expect(decode(*written, &again), kFitToRead);
  const Result<std::string> rewritten = encode(again);
  Expect(rewritten.ok() && *rewritten == *written, "equal records are equal bytes");
}

// Records whose Decode takes nothing but the value.
template <typename Record>
void Plain(std::string_view value, Record record) {
  RoundTrip(
      value, std::move(record), [](std::string_view v, Record* r) { return Decode(v, r); },
      [](const Record& r) { return Encode(r); });
}
// Records whose Decode takes what their key says.
template <typename Record, typename... Key>
void Keyed(std::string_view value, Key... key) {
  RoundTrip(
      value, Record(), [&](std::string_view v, Record* r) { return Decode(v, key..., r); },
      [](const Record& r) { return Encode(r); });
}

void Observations(std::string_view value) {
  using Record = std::vector<Observation>;
  RoundTrip(
      value, Record(), [](std::string_view v, Record* r) { return Decode(v, r); },
      [](const Record& r) { return Encode(std::span<const Observation>(r)); });
}

void Words(std::string_view value) {
  RoundTrip(value, std::vector<WordId>(), DecodeWords,
            [](const std::vector<WordId>& r) { return EncodeWords(r); });
}

void Postings(std::string_view value) {
  RoundTrip(value, std::vector<ImageId>(), DecodeImages,
            [](const std::vector<ImageId>& r) { return EncodeImages(r); });
}

void Settings(std::string_view value) {
  Plain(value, DenseSettings{.reconstruction = kCity});
}

ForbiddenRecord SampleForbidden() {
  return {ForbiddenKind::kPair, 1, 2, 1'700'000'000, "anna", "two towers"};
}

SubmapRecord SampleSubmap() {
  SubmapRecord record;
  record.id = SubmapId(2);
  record.reconstruction = ReconstructionId(3);
  record.images = {ImageId(1), ImageId(7)};
  record.images_at_adjustment = 1;
  record.motion = Sim3{2, Eigen::Quaterniond::Identity(), {1, 2, 3}};
  return record;
}

SubmapBorder SampleBorder() {
  SubmapBorder border;
  border.id = SubmapId(2);
  border.views = {{0, ImageId(1), 1, 2}, {0, ImageId(7), 3, 4}, {1, ImageId(1), 5, 6}};
  border.evidence = {{ImageId(1), ImageId(9), 1, 2, 3, 4}};
  border.fragments = {{ImageId(1), ImageId(1)}, {ImageId(7), ImageId(1)}};
  return border;
}

UploadRecord SampleUpload() {
  UploadRecord upload;
  upload.number = 1;
  upload.name = "1.jpg";
  upload.contributor = "anna";
  upload.photo = SampleHash(1);
  return upload;
}

GroundPoint SampleGroundPoint() {
  return {"corner", {47.07, 15.44, 350}, 0.05, {{ImageId(1), 2, 3}, {ImageId(7), 4, 5}}};
}

TokenRecord SampleToken() {
  return {1, "anna", Role::kCurator, {1, 2, 3}, 1'700'000'000, 0, 0, {5, 6, 7}};
}

HiddenRecord SampleHidden() {
  return {HiddenKind::kImage, 4, 1'700'000'000, "kai", "asked"};
}

ReportRecord SampleReport() {
  return {1,      ImageId(4),    ReportReason::kPrivacy, "my window",
          "vera", 1'700'000'000, ReportState::kOpen,     "",
          0};
}

PartialUploadRecord SamplePartialUpload() {
  PartialUploadRecord partial;
  partial.id.fill(7);
  partial.name = "1.jpg";
  partial.length_bytes = 100;
  partial.received_bytes = partial.last_piece_bytes = 50;
  partial.piece_count = 1;
  return partial;
}

ContributionRecord SampleContribution() {
  return {1, "anna", "a walk", "CC0", 1'700'000'000, 0, 3};
}

ContributedPhoto SampleContributed() {
  ContributedPhoto photo;
  photo.contribution = 1;
  photo.upload = 2;
  photo.fate = ContributionFate::kStored;
  photo.image = ImageId(3);
  return photo;
}

ReconstructionRecord SampleOnEarth() {
  ReconstructionRecord record = SampleReconstruction(1, 0);
  record.georeference.version = 2;
  record.georeference.images_at_look = 12;
  record.georeference.place.emplace().fixes = {12, 11, 3.5};
  return record;
}

HypothesisRecord SampleHypothesis() {
  HypothesisRecord record;
  record.a = ReconstructionId(1);
  record.b = ReconstructionId(2);
  record.common_point_count = 24;
  record.images = {ImageId(3), ImageId(8)};
  return record;
}

// Every reader of keys on the same bytes: none may read past them.
void Keys(std::string_view key) {
  ContentHash hash;
  uint64_t number = 0;
  uint32_t id = 0;
  ImageId image;
  ReconstructionId reconstruction;
  GridPlace place;
  ParseHashKey(key, &hash);
  ParsePhotoMarkKey(key, &hash);
  (void)ParseId(key, &id).ok();
  (void)ParseJournalKey(key, &number).ok();
  UploadEntry entry{};
  (void)ParseUploadKey(key, &entry, &number).ok();
  (void)DecodeLastUpload(key, &number).ok();
  ForbiddenRecord forbidden;
  (void)ParseForbiddenKey(key, &forbidden).ok();
  GroundPoint point;
  (void)ParseGroundPointKey(key, &point).ok();
  TokenRecord token;
  (void)ParseTokenKey(key, &token).ok();
  TokenUse use;
  (void)ParseTokenUseKey(key, &use).ok();
  HiddenRecord hidden;
  (void)ParseHiddenKey(key, &hidden).ok();
  ReportRecord report;
  (void)ParseReportKey(key, &report).ok();
  PartialUploadId partial{};
  (void)ParsePartialUploadKey(key, &partial).ok();
  (void)ParsePieceKey(key, &partial, &id).ok();
  ContributionRecord contribution;
  (void)ParseContributionKey(key, &contribution).ok();
  ContributedPhoto contributed;
  (void)ParseContributedPhotoKey(key, &contributed).ok();
  HypothesisRecord hypothesis;
  (void)ParseHypothesisKey(key, &hypothesis).ok();
  SubmapRecord submap;
  (void)ParseSubmapKey(key, &submap).ok();
  SubmapBorder border;
  (void)ParseBorderKey(key, &border).ok();
  (void)KeyText(key).size();
  (void)PrefixEnd(key).size();
  if (key.empty()) return;  // the entry's number led to these readers
  (void)ParseDenseKey(key, &image).ok();
  (void)ParseDenseKey(key, &image, &number).ok();
  (void)ParseDenseKey(key, &reconstruction).ok();
  (void)ParseDenseKey(key, &reconstruction, &place).ok();
}

using Kind = void (*)(std::string_view);
constexpr std::array<Kind, 32> kKinds = {
    [](std::string_view v) { Keyed<CameraRecord>(v, CameraId(1)); },
    [](std::string_view v) { Keyed<ImageRecord>(v, ImageId(1)); },
    [](std::string_view v) { Keyed<JournalRecord>(v, uint64_t{1}); },
    [](std::string_view v) { Keyed<PairRecord>(v, ImageId(1), ImageId(2)); },
    [](std::string_view v) { Keyed<PairNeighbor>(v, ImageId(2)); },
    [](std::string_view v) { Plain(v, Features()); },
    [](std::string_view v) { Keyed<PoseRecord>(v, ImageId(1)); },
    Observations,
    [](std::string_view v) { Keyed<PointBlock>(v, ImageId(1)); },
    [](std::string_view v) { Keyed<ReconstructionRecord>(v, ReconstructionId(1)); },
    [](std::string_view v) { Plain(v, DatabaseState()); },
    Words,
    Postings,
    Settings,
    [](std::string_view v) { Plain(v, SampleDepth(1)); },
    [](std::string_view v) { Plain(v, SampleChecked(1, 4)); },
    [](std::string_view v) { Plain(v, DepthPixels()); },
    [](std::string_view v) {
      Plain(v, SampleTile({1, 2, 3}));
    },
    [](std::string_view v) { Plain(v, SampleForbidden()); },
    [](std::string_view v) { Plain(v, SampleHypothesis()); },
    [](std::string_view v) { Plain(v, SampleSubmap()); },
    [](std::string_view v) { Plain(v, SampleBorder()); },
    [](std::string_view v) { Keyed<UploadRecord>(v, uint64_t{1}); },
    [](std::string_view v) { Plain(v, SampleGroundPoint()); },
    [](std::string_view v) { Plain(v, SampleToken()); },
    [](std::string_view v) { Keyed<ReconstructionRecord>(v, ReconstructionId(1)); },
    [](std::string_view v) { Plain(v, SamplePartialUpload()); },
    [](std::string_view v) { Plain(v, SampleContribution()); },
    [](std::string_view v) { Plain(v, SampleContributed()); },
    [](std::string_view v) { Plain(v, TokenUse()); },
    [](std::string_view v) { Plain(v, SampleHidden()); },
    [](std::string_view v) { Plain(v, SampleReport()); }};

std::string Bytes(const Result<std::string>& encoded) {
  Expect(encoded.status(), "a seed is a record");
  return *encoded;
}

std::vector<std::string> Values() {
  CameraRecord camera{CameraId(1), "phone", {640, 480, 500, 501, 320, 240}, "a person"};
  JournalRecord journal{1, 1'700'000'000, "anna", "add", ImageId(1), ReconstructionId(1), "63"};
  SeededRandom random(1);
  const std::vector<Observation> observations = {{0, {ImageId(1), 1}}, {5, {ImageId(2), 3}}};
  const std::vector<WordId> words = {0, 3, 70000};
  const std::vector<ImageId> images = {ImageId(1), ImageId(9)};
  return {Bytes(Encode(camera)),
          Bytes(Encode(SampleImage(1))),
          Bytes(Encode(journal)),
          Bytes(Encode(SamplePair(1, 2, 5))),
          Bytes(Encode(PairNeighbor{ImageId(2), 40, PairGeometry::kPlanar})),
          Bytes(Encode(SampleFeatures(1, 3))),
          Bytes(Encode(PoseRecord{ImageId(1), ReconstructionId(1), SampleRigid(&random)})),
          Bytes(Encode(std::span<const Observation>(observations))),
          Bytes(Encode(SampleBlock(1, 4))),
          Bytes(Encode(SampleReconstruction(1, 3))),
          Bytes(Encode(SampleState(40))),
          Bytes(EncodeWords(words)),
          Bytes(EncodeImages(images)),
          Bytes(Encode(DenseSettings{kCity, 0.05, 512, 2})),
          Bytes(Encode(SampleDepth(1))),
          Bytes(Encode(SampleChecked(1, 4))),
          Bytes(Encode(SamplePixels())),
          Bytes(Encode(SampleTile({1, 2, 3}))),
          Bytes(Encode(SampleForbidden())),
          Bytes(Encode(SampleHypothesis())),
          Bytes(Encode(SampleSubmap())),
          Bytes(Encode(SampleBorder())),
          Bytes(Encode(SampleUpload())),
          Bytes(Encode(SampleGroundPoint())),
          Bytes(Encode(SampleToken())),
          Bytes(Encode(SampleOnEarth())),
          Bytes(Encode(SamplePartialUpload())),
          Bytes(Encode(SampleContribution())),
          Bytes(Encode(SampleContributed())),
          Bytes(Encode(TokenUse{1, 2, 3, 4, 5})),
          Bytes(Encode(SampleHidden())),
          Bytes(Encode(SampleReport()))};
}

}  // namespace

std::vector<std::string> Seeds() {
  std::vector<std::string> seeds = Values();
  Expect(seeds.size() == kKinds.size(), "every kind has a seed");
  for (size_t i = 0; i < seeds.size(); ++i) seeds[i].insert(0, 1, static_cast<char>(i));
  const char keys = static_cast<char>(kKinds.size());
  seeds.push_back(keys + TileKey(kCity, {1, -2, 3}));
  seeds.push_back(keys + CheckedDepthKey(ImageId(1), 7));
  seeds.push_back(keys + PhotoMarkKey(SampleHash(1)));
  seeds.push_back(keys + ForbiddenKey(ForbiddenKind::kMerge, 1, 2));
  seeds.push_back(keys + HypothesisKey(ReconstructionId(1), ReconstructionId(2)));
  seeds.push_back(keys + SubmapKey(SubmapId(3)));
  seeds.push_back(keys + BorderKey(SubmapId(3)));
  seeds.push_back(keys + UploadBytesKey(7));
  seeds.push_back(keys + GroundPointKey("corner"));
  seeds.push_back(keys + TokenKey(7));
  seeds.push_back(keys + PieceKey(SamplePartialUpload().id, 3));
  seeds.push_back(keys + ContributedPhotoKey(1, 2));
  return seeds;
}

void DecodeOne(uint8_t kind, std::string_view value) {
  const size_t chosen = kind % (kKinds.size() + 1);
  if (chosen == kKinds.size()) return Keys(value);
  kKinds[chosen](value);
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size > 0) veduta::fuzz::DecodeOne(data[0], veduta::fuzz::Text(data + 1, size - 1));
  return 0;
}
