# SPDX-License-Identifier: Apache-2.0
# The values of the database; keys and raw values are in storage/FORMAT.md. Fields are only ever
# added, with new numbers. What the key says is not repeated in the value. Bulk arrays are Data of
# fixed little-endian rows, so that reading one is a copy of memory; a comment says what a row is.
@0xa40a7d1c2f6b9e53;

using Cxx = import "/capnp/c++.capnp";
$Cxx.namespace("veduta::schema");

# Unit quaternion and translation of a_from_b.
struct Rigid {
  qw @0 :Float64;
  qx @1 :Float64;
  qy @2 :Float64;
  qz @3 :Float64;
  tx @4 :Float64;
  ty @5 :Float64;
  tz @6 :Float64;
}

struct State {
  nextImage @0 :UInt32;
  nextCamera @1 :UInt32;
  nextReconstruction @2 :UInt32;
  nextJournal @3 :UInt64;
  nextBlob @4 :UInt64;
  vocabularyGeneration @5 :UInt32;
  imagesAtVocabulary @6 :UInt32;
  vocabularyImported @7 :Bool;
  retrievableImageCount @8 :UInt32;
  pendingPropagation @9 :Data;  # rows: image u32
  # The counts mean something only where countsKnown is set: a program from before there were counts
  # writes the state without them.
  countsKnown @10 :Bool;
  imageCount @11 :UInt64;
  placedCount @12 :UInt64;
  postponedCount @13 :UInt64;
  rejectedCount @14 :UInt64;
  cameraCount @15 :UInt64;
  removedBytesLeft @16 :Bool;  # photos were removed, and files may still have their bytes
  locatedCount @17 :UInt64;
}

struct Forbidden {
  timeUnixS @0 :Int64;
  actor @1 :Text;
  reason @2 :Text;
}

struct Token {
  name @0 :Text;
  role @1 :UInt8;
  hash @2 :Data;  # 32 bytes
  createdUnixS @3 :Int64;
  expiresUnixS @4 :Int64;
  revokedUnixS @5 :Int64;
  photosPerDay @6 :UInt32;
  bytesPerDay @7 :UInt64;
  requestsPerSecond @8 :UInt32;
  isLink @9 :Bool;
  contribution @10 :UInt32;
  reconstruction @11 :UInt32;
}

struct TokenUse {
  timeUnixMs @0 :Int64;
  photos @1 :Float64;
  bytes @2 :Float64;
  reports @3 :Float64;
  contributions @4 :Float64;
}

struct Hidden {
  timeUnixS @0 :Int64;
  actor @1 :Text;
  reason @2 :Text;
}

struct Report {
  image @0 :UInt32;
  reason @1 :UInt8;
  text @2 :Text;
  reporter @3 :Text;
  timeUnixS @4 :Int64;
  state @5 :UInt8;
  resolver @6 :Text;
  resolvedUnixS @7 :Int64;
}

struct Hypothesis {
  kind @0 :UInt8;
  reason @1 :UInt8;
  aFromBScale @2 :Float64;
  aFromB @3 :Rigid;
  commonPointCount @4 :UInt32;
  agreeingPairs @5 :UInt32;
  contradictingPairs @6 :UInt32;
  agreeingMatches @7 :UInt64;
  contradictingMatches @8 :UInt64;
  judgedCells @9 :UInt32;
  missingCells @10 :UInt32;
  image @11 :UInt32;
  images @12 :Data;  # rows: image u32
  judgmentCount @13 :UInt32;
  due @14 :Bool;
  timeUnixS @15 :Int64;
  unsure @16 :Data;  # rows: image u32
  loopImages @17 :UInt32;
}

struct Submap {
  reconstruction @0 :UInt32;
  images @1 :Data;  # rows: image u32
  imagesAtAdjustment @2 :UInt32;
  moves @3 :Bool;  # the motion means something only where this is set
  motionScale @4 :Float64;
  motion @5 :Rigid;
}

struct SubmapBorder {
  views @0 :Data;  # rows: tie u32, image u32, x f32, y f32
  # rows: image a u32, image b u32, shared points, agreeing, contradicting and turned matches u32
  evidence @1 :Data;
  fragments @2 :Data;  # rows: image u32, head u32
}

struct Camera {
  name @0 :Text;
  source @1 :Text;
  widthPx @2 :UInt32;
  heightPx @3 :UInt32;
  fx @4 :Float64;
  fy @5 :Float64;
  cx @6 :Float64;
  cy @7 :Float64;
  k1 @8 :Float64;
  k2 @9 :Float64;
  u0 @10 :Float64;
  v0 @11 :Float64;
  isRefinable @12 :Bool;
  awaitedPhotos @13 :Data;  # rows: 32 bytes
  awaitedList @14 :Data;    # 32 bytes, or none
  toldFocalShare @15 :Float64;
  focalStddevShare @16 :Float64;
  version @17 :UInt32;
  refinedFromFx @18 :Float64;  # 0: it was not refined
  refinedFromFy @19 :Float64;
  refinedFromK1 @20 :Float64;
  refinedFromK2 @21 :Float64;
}

struct Image {
  name @0 :Text;
  photo @1 :Data;  # 32 bytes
  camera @2 :UInt32;
  widthPx @3 :UInt32;
  heightPx @4 :UInt32;
  sizeBytes @5 :UInt64;
  featureCount @6 :UInt32;
  contributor @7 :Text;
  timeUnixS @8 :Int64;
  verdict @9 :UInt8;
  reason @10 :UInt8;
  detail @11 :Text;
  gps @12 :Gps;
  taken @13 :Taken;
  mediaType @14 :Text;
  contribution @15 :UInt32;
  orientation @16 :UInt8;
}

struct Taken {
  localUnixS @0 :Int64;
  hasOffset @1 :Bool;
  offsetS @2 :Int32;
}

struct Gps {
  latitudeDeg @0 :Float64;
  longitudeDeg @1 :Float64;
  hasHeight @2 :Bool;
  heightM @3 :Float64;
  accuracyM @4 :Float64;
  hasHeading @5 :Bool;
  headingDeg @6 :Float64;
}

struct GeoPosition {
  latitudeDeg @0 :Float64;
  longitudeDeg @1 :Float64;
  heightM @2 :Float64;
}

struct GroundPoint {
  position @0 :GeoPosition;
  deviationM @1 :Float64;
  sightings @2 :Data;  # rows: image u32, 4 zero bytes, x f64, y f64
}

struct FitTally {
  used @0 :UInt32;
  agreeing @1 :UInt32;
  errorM @2 :Float64;
}

struct EarthPlace {
  origin @0 :GeoPosition;
  scale @1 :Float64;
  enuFromWorld @2 :Rigid;
  pivot @3 :Data;       # rows: f64, 3
  covariance @4 :Data;  # rows: f64, 28
  fixes @5 :FitTally;
  groundPoints @6 :FitTally;
}

struct Georeference {
  version @0 :UInt32;
  imagesAtLook @1 :UInt32;
  imagesAtAdjustment @2 :UInt32;
  place @3 :EarthPlace;
}

struct Features {
  # rows of 24 bytes: x, y, scale, angle, response f32; contrast sign i8; r, g, b u8
  keypoints @0 :Data;
  descriptors @1 :Data;  # rows of 128 bytes
}

struct PairNeighbor {
  matchCount @0 :UInt32;
  geometry @1 :UInt8;
}

struct Pair {
  geometry @0 :UInt8;
  bFromA @1 :Rigid;
  matches @2 :Data;  # rows: feature in a u32, feature in b u32
  focalAPx @3 :Float64;
  focalBPx @4 :Float64;
  k1A @5 :Float64;
  k2A @6 :Float64;
  k1B @7 :Float64;
  k2B @8 :Float64;
}

struct Reconstruction {
  mergedInto @0 :UInt32;
  mergedFromThisScale @1 :Float64;
  mergedFromThis @2 :Rigid;
  imageCount @3 :UInt32;
  pointCount @4 :UInt64;
  observationCount @5 :UInt64;
  reprojectionErrorPxSum @6 :Float64;
  geometryVersion @7 :UInt64;
  pointsGeneration @8 :UInt32;
  imagesAtAdjustment @9 :UInt32;
  dissolved @10 :Bool;
  georeference @11 :Georeference;
}

struct Pose {
  reconstruction @0 :UInt32;
  camFromWorld @1 :Rigid;
}

struct Observations {
  rows @0 :Data;  # rows: feature u32, point's home u32, point's ordinal u32
}

# Columns of equal length, one entry per point; the tracks lie end to end in trackElements.
struct PointBlock {
  nextOrdinal @0 :UInt32;
  ordinals @1 :Data;       # rows: u32
  positions @2 :Data;      # rows: x, y, z f64
  colors @3 :Data;         # rows: r, g, b u8
  errorsPx @4 :Data;       # rows: f32
  trackLengths @5 :Data;   # rows: u32
  trackElements @6 :Data;  # rows: image u32, feature u32
}

struct Journal {
  timeUnixS @0 :Int64;
  actor @1 :Text;
  action @2 :Text;
  image @3 :UInt32;
  reconstruction @4 :UInt32;
  detail @5 :Text;
}

# The dense pass.
struct DenseSettings {
  voxelSize @0 :Float64;
  depthSidePx @1 :UInt32;
  sensorCount @2 :UInt32;
}

# Size and pinhole of a depth map, and where it was seen from.
struct DepthGeometry {
  widthPx @0 :UInt32;
  heightPx @1 :UInt32;
  fx @2 :Float64;
  fy @3 :Float64;
  cx @4 :Float64;
  cy @5 :Float64;
  camFromWorld @6 :Rigid;
  depthNear @7 :Float64;
  depthFar @8 :Float64;
}

struct Depth {
  reconstruction @0 :UInt32;
  version @1 :UInt64;
  geometryVersion @2 :UInt64;
  geometry @3 :DepthGeometry;
  sensors @4 :Data;      # rows: image u32
  sensorPoses @5 :Data;  # rows: w, x, y, z of the unit quaternion, translation, f64
  knownCount @6 :UInt32;
  checkedVersion @7 :UInt64;
  gain @8 :Data;         # r, g, b f32
  exposureVersion @9 :UInt64;
}

struct CheckedDepth {
  reconstruction @0 :UInt32;
  geometry @1 :DepthGeometry;
  knownCount @2 :UInt32;
  blocks @3 :Data;     # rows: x, y, z i32, pixels u32
  neighbors @4 :Data;  # rows: image u32, 0 u32, version u64
}

struct DepthPixels {
  codes @0 :Data;       # rows: u16
  confidence @1 :Data;  # rows: u8
}

struct Tile {
  blocks @0 :UInt64;
  depths @1 :Data;  # rows: image u32, 0 u32, version u64
  volumeVersion @2 :UInt64;
  solutionVersion @3 :UInt64;
  meshVersion @4 :UInt64;
  colorVersion @5 :UInt64;
  triangleCount @6 :UInt64;
  vertexCount @7 :UInt64;
  firstRoundVersion @8 :UInt64;
  histogramVersion @9 :UInt64;
}

struct Upload {
  name @0 :Text;
  contributor @1 :Text;
  camera @2 :Text;
  photo @3 :Data;  # 32 bytes
  sizeBytes @4 :UInt64;
  timeUnixS @5 :Int64;
  contribution @6 :UInt32;
}

struct PartialUpload {
  name @0 :Text;
  contributor @1 :Text;
  camera @2 :Text;
  contribution @3 :UInt32;
  token @4 :UInt32;
  lengthBytes @5 :UInt64;
  receivedBytes @6 :UInt64;
  pieceCount @7 :UInt32;
  lastPieceBytes @8 :UInt64;
  begunUnixS @9 :Int64;
  touchedUnixS @10 :Int64;
  upload @11 :UInt64;
}

struct Contribution {
  contributor @0 :Text;
  comment @1 :Text;
  licence @2 :Text;
  openedUnixS @3 :Int64;
  closedUnixS @4 :Int64;
  photoCount @5 :UInt64;
}

struct ContributedPhoto {
  fate @0 :UInt8;
  image @1 :UInt32;
  verdict @2 :UInt8;
  reason @3 :UInt8;
  name @4 :Text;
}
