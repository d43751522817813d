# SPDX-License-Identifier: Apache-2.0
# What the daemon (`veduta serve DB --listen ADDRESS`) answers by Cap'n Proto RPC (level 1, two
# parties, unpacked messages). docs/rpc.md shows how to use it.
#
# Version. `Gate.login` tells the version that the daemon speaks. Within one version, fields,
# methods and values of enums are only ever added, with new numbers, and none changes its meaning: a
# client of an older schema works on, and passes over values that it does not know. What cannot be
# done that way gets a new version, and a word in CHANGELOG.md.
#
# Units and frames. A world is the frame of one reconstruction; lengths in it have no unit, unless
# the reconstruction has a place on the earth. The camera looks along +z, x is to the right, y down.
# Pixels are those of the upright photo; the centre of the top-left one is (0, 0). Angles are in
# degrees, times in seconds since 1970 (UTC). Numbers of photos, reconstructions, uploads and of
# entries of the journal begin with 1; 0 stands for none. Text is UTF-8.
#
# Snapshots. Every answer about the city names the commit that it was read from, in `snapshot`; a
# later commit has a greater number as long as the daemon runs. All of one answer is of one commit.
#
# Photos are found by name, by contributor and name with a slash between, by "#" and the number, or
# by 8 and more digits of the SHA-256 of their bytes.
#
# Failures. A call that fails throws an exception whose text is the code and the phrase that HTTP
# has for it, then what is wrong and what to do: "404 Not Found: there is no image 'a.jpg'". 400:
# what was asked is wrong. 401: the token is none, or is good no more. 403: its role is not enough.
# 404: there is no such thing. 409: it came out of turn. 413: it is too large. 429 and 503, of the
# type overloaded: nothing was done or stored, and the text ends with ", try again in N s". 500: the
# disk or the database failed. A connection on which somebody breaks a limit of messages is closed.
@0xdd3ac4d8cb6f0c37;

using Cxx = import "/capnp/c++.capnp";
$Cxx.namespace("veduta::rpc");

const version :UInt32 = 1;
# The largest message that the daemon takes, and the largest chunk of a photo. Chunks of 64 KiB are
# as fast, and are also in time on slow lines: a message must be complete 30 s after its first byte.
const messageBytesMax :UInt32 = 1048576;
const chunkBytesMax :UInt32 = 524288;

# What a new connection gets. Whoever has not logged in after 15 s is disconnected.
interface Gate {
  # The city, for the owner of the token. While the database has no tokens, and for the owner of the
  # database by a Unix socket, the token is empty. 401.
  login @0 (token :Text) -> (city :City, version :UInt32);
}

# Who may call a method is told with it, by the least role that may. The token is looked at with
# each call: one that was revoked is good no more.
interface City {
  # Viewer.
  status @0 () -> (status :Status);

  # Contributor; a curator may name another `contributor` than the token's name. Takes the bytes of
  # a photo that will be called `name`. Without a `camera` it is found, or estimated. The photo is
  # put on the disk by Upload.done. 400 without a name, 429 where too many bytes are arriving.
  # `contribution` is the number of an open contribution (POST /v1/contributions), 0: of none. 404
  # where there is none of that number; Upload.done fails where it is closed, or somebody else's.
  addPhoto @1 (name :Text, camera :Text, contributor :Text, contribution :UInt32)
      -> (upload :Upload);

  # Contributor. What becomes of an upload that was accepted before, perhaps by another connection
  # or another daemon. 404 for one that waits no more and is not one of the last 10,000 that had
  # their turn since the daemon began.
  findUpload @2 (number :UInt64) -> (ticket :Ticket);

  # Viewer. 404 also where the photo has no pose; the text says why.
  pose @3 (photo :Text) -> (pose :Pose, onEarth :EarthPose, snapshot :UInt64);

  # Viewer. The verified neighbours of a stored photo, most matches first.
  neighbors @4 (photo :Text) -> (neighbors :List(Neighbor), snapshot :UInt64);

  # Viewer. Takes the bytes of a photo that is asked about and not stored.
  examine @5 (name :Text) -> (examination :Examination);

  # Viewer. The reconstructions that live, largest first.
  reconstructions @6 () -> (reconstructions :List(Reconstruction), snapshot :UInt64);

  # Viewer. The sparse points of a reconstruction, as of one commit, however long they are read.
  # `geometryVersion` grows whenever a pose or a point of the reconstruction moves.
  points @7 (reconstruction :UInt32)
      -> (points :PointReader, count :UInt64, geometryVersion :UInt64, snapshot :UInt64);

  # Viewer. At most `count` entries of the journal (0: 256, the most) from number `from` on.
  journal @8 (from :UInt64, count :UInt32) -> (entries :List(JournalEntry), snapshot :UInt64);

  # Viewer. Tells the watcher of every entry of the journal from number `from` on, those that are
  # there and then new ones within half a second, in order and none twice. The call lasts until it
  # is cancelled, or until it fails: then, and after a lost connection, one goes on from the `next`
  # that the watcher heard last, and misses nothing. A watcher that does not return from a call
  # within 60 s hears no more: 408.
  follow @9 (from :UInt64, watcher :Watcher) -> ();
}

# The bytes of a photo on their way to the daemon: all must have come 10 minutes after the first
# call. 413 for more than 128 MiB, 429 where the photos of all clients that are arriving take too
# much memory: then the whole photo is sent again.
interface PhotoSink {
  write @0 (chunk :Data) -> stream;
}

interface Upload extends(PhotoSink) {
  # Answers once the photo is on the disk: from then on a crash does not lose it. Photos of one
  # connection are put in line in the order in which they became complete. 429 where too many photos
  # wait for their turn. 409 when it is called twice.
  done @0 () -> (number :UInt64, ticket :Ticket);
}

# A photo that is on the disk and waits for its turn, or has had it.
interface Ticket {
  # Answers when the photo has had its turn. 503 where the turn cannot come now, since the disk
  # fails, the daemon closes or the photo's camera cannot be told yet: the photo waits on, and
  # City.findUpload finds it again.
  verdict @0 () -> (outcome :Outcome, snapshot :UInt64);
}

# A photo that is asked about. Questions may be asked as soon as the last chunk was written; no
# chunk can follow the first question. 10 minutes after the last question the photo is dropped: 408.
interface Examination extends(PhotoSink) {
  # Viewer. Where the photo was taken. `camera` is the name of a camera, empty: to be estimated. It
  # is sought first near the stored photo `near`, and near `place`, "LATITUDE,LONGITUDE" in degrees,
  # where these are not empty.
  localize @0 (camera :Text, near :Text, place :Text) -> (localized :Localized, snapshot :UInt64);
  # Viewer. The `count` stored photos that look most like it (0: 20), best first.
  candidates @1 (camera :Text, count :UInt32) -> (candidates :List(Neighbor), snapshot :UInt64);
}

interface PointReader {
  # The next points: at most `count`, and at most 4,096 (0: as many), none at the end. 16 bytes
  # each, little-endian: x, y, z in the world as 32-bit floats; red, green, blue (sRGB), 0. Those
  # that come first are an even sample of all.
  next @0 (count :UInt32) -> (points :Data);
}

# Implemented by the client.
interface Watcher {
  # Entries in ascending order; `next` is the number to go on from. Nothing more is told before this
  # returns.
  entries @0 (entries :List(JournalEntry), next :UInt64, snapshot :UInt64) -> ();
}

enum Verdict {
  rejected @0;   # of no use: the reason says why
  postponed @1;  # stored without a pose, and tried again when other photos help
  placed @2;
  founded @3;    # with earlier photos it began a new reconstruction
  merged @4;     # with it, reconstructions became one
  duplicate @5;  # the same bytes are stored already, as `id`
}

struct Status {
  snapshot @0 :UInt64;
  images @1 :UInt64;  # stored: placed, postponed or rejected
  placed @2 :UInt64;
  postponed @3 :UInt64;
  rejected @4 :UInt64;
  unsure @5 :UInt64;   # of the placed ones: no pose is told, for they may stand elsewhere
  cameras @6 :UInt64;
  uploads @7 :UInt64;  # photos that wait for their turn
  backlog @8 :UInt64;  # images that are to be tried again
  vocabularyGeneration @9 :UInt32;  # 0: there is no vocabulary yet
  openHypotheses @10 :UInt64;       # merges that are proposed and not believed yet
  totalBytes @11 :UInt64;           # on the disk
}

# What became of a photo that was sent.
struct Outcome {
  name @0 :Text;
  id @1 :UInt32;  # 0: nothing was stored
  verdict @2 :Verdict;
  reason @3 :Text;            # for people, with the numbers that decided
  reconstruction @4 :UInt32;  # that it has a pose in
  camera @5 :Text;            # that was found for it, where none was named
  neighbors @6 :UInt32;       # photos whose matches with it were verified
  inliers @7 :UInt32;         # matches that agree with the pose, or with the best pair
  pairsTried @8 :UInt32;
  replaced @9 :Bool;  # a duplicate of more pixels, whose bytes took the place of the stored ones
}

# x_camera = R(rotation) x_world + translation.
struct Pose {
  reconstruction @0 :UInt32;
  rotation @1 :Quaternion;  # unit
  translation @2 :Vector3;
  center @3 :Vector3;  # of the camera, in the world
}

struct Quaternion {
  w @0 :Float64;
  x @1 :Float64;
  y @2 :Float64;
  z @3 :Float64;
}

struct Vector3 {
  x @0 :Float64;
  y @1 :Float64;
  z @2 :Float64;
}

# Null where the place of the reconstruction on the earth is not known.
struct EarthPose {
  latitude @0 :Float64;   # degrees, WGS 84
  longitude @1 :Float64;
  heightM @2 :Float64;    # as the position of `veduta pose` has it
  headingDeg @3 :Float64; # of the optical axis: clockwise from true north,
  pitchDeg @4 :Float64;   # and above the horizon
  rollDeg @5 :Float64;    # of the camera about it, clockwise as the photographer sees it
  horizontalStddevM @6 :Float64;
  verticalStddevM @7 :Float64;
  headingStddevDeg @8 :Float64;
}

struct Neighbor {
  id @0 :UInt32;
  name @1 :Text;
  verdict @2 :Verdict;
  matches @3 :UInt32;  # verified; 0 for a candidate
  score @4 :Float64;   # similarity of a candidate; 0 for a neighbour
}

# Where a photo was taken that is not stored.
struct Localized {
  verdict @0 :Verdict;  # placed; postponed: no pose is believed; rejected
  reason @1 :Text;
  stored @2 :UInt32;    # the image whose bytes are the same; 0: none
  pose @3 :Pose;        # null where none is believed
  onEarth @4 :EarthPose;
  # How sure the pose is among the images around it: roots of expected squares. 0: not known.
  centerStddev @5 :Float64;
  rotationStddevDeg @6 :Float64;
  camera @7 :Camera;    # that was estimated; null where one was named, or the photo is stored
  inliers @8 :UInt32;
  neighbors @9 :UInt32;
  pairsTried @10 :UInt32;
  support @11 :List(Support);  # images that share points with it, most points first
}

# px of the upright photo; x_d = c + (x - c)(1 + k1 r^2 + k2 r^4), r = |x - c|, in normalised
# coordinates; c is (u0, v0).
struct Camera {
  widthPx @0 :UInt32;
  heightPx @1 :UInt32;
  fx @2 :Float64;
  fy @3 :Float64;
  cx @4 :Float64;
  cy @5 :Float64;
  k1 @6 :Float64;
  k2 @7 :Float64;
  u0 @8 :Float64;
  v0 @9 :Float64;
  focalStddevShare @10 :Float64;  # standard deviation of the focal length over itself
}

struct Support {
  id @0 :UInt32;
  name @1 :Text;
  points @2 :UInt32;  # that both see
}

struct Reconstruction {
  id @0 :UInt32;
  images @1 :UInt32;
  points @2 :UInt64;
  observations @3 :UInt64;  # features that see them
  reprojectionErrorPxMean @4 :Float64;
  geometryVersion @5 :UInt64;
}

struct JournalEntry {
  number @0 :UInt64;
  time @1 :Int64;
  actor @2 :Text;  # who did it
  action @3 :Text;
  image @4 :UInt32;
  reconstruction @5 :UInt32;
  detail @6 :Text;
}
