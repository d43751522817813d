// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one door to a database of a city's photographs. A program that embeds Veduta includes this
// header and nothing else (docs/embedding.md).
//
// One handle, which many threads share. Everything that writes goes through one writer inside, a
// piece at a time, first come first served: photos, the steps that follow from them, cameras,
// vocabularies, the dense pass, backups take turns. Vocabularies, the adjustment of a large
// reconstruction as a whole and the dense pass are computed without a turn, and take one for each
// commit. Readers never wait. Callbacks come outside of locks and turns, and may use the engine.
//
// Every function is thread-safe. Errors: kNotFound and kInvalidArgument name the thing and what to
// do; kBusy when another process writes to the database; kCorruption names family and key; kIoError
// has the operating system's word. After a failed write all later ones fail until Reopen.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "engine/door/answers.h"
#include "engine/door/calibration.h"
#include "engine/door/dense.h"
#include "engine/door/earth.h"
#include "engine/door/engine_options.h"
#include "engine/door/repair.h"
#include "engine/door/submission.h"
#include "engine/door/tokens.h"

namespace veduta {

struct EngineParts;  // what the rooms behind the door work with: engine/parts.h

// Questions to one snapshot of the city. Answers own what they hold. Cheap to make; holding one
// keeps the disk space of what was deleted since.
class Questions final {
 public:
  ~Questions();
  Questions(Questions&&) noexcept;
  Questions& operator=(Questions&&) noexcept;

  uint64_t snapshot() const;  // its name; greater after each commit

  // O(reconstructions); after a dense pass also O(depth maps + tiles), of each of which a record is
  // read. No walk over images.
  Result<StatusAnswer> Status() const;
  // By its name, by contributor and name with a slash between, by "#" and its number, or by 8 and
  // more digits of its photo's SHA-256 in hexadecimal. kNotFound names it; kInvalidArgument says
  // which images it may mean, if several. The same wherever a photo is asked for by a text.
  Result<ImageAnswer> Image(const std::string& name) const;
  // At most `count_max` images, ascending ids from `first` on.
  Result<std::vector<ListedImage>> Images(ImageId first, uint32_t count_max) const;
  // The photo as it came, and a JPEG of it whose longer side has `side_px` at most, 1 to
  // kThumbnailSideMax: as long as decoding it takes. kNotFound for a rejected one.
  Result<PhotoFile> Photo(const std::string& name) const;
  Result<PhotoFile> Thumbnail(const std::string& name, uint32_t side_px) const;
  // How sure its pose is; nothing where it has none, or too little is seen to tell. Computed anew
  // each time: it reads the features of every image that sees a point of this one.
  Result<std::optional<PoseUncertainty>> Uncertainty(const std::string& name) const;
  // The verified neighbours of a stored image, most matches first.
  Result<std::vector<NeighborAnswer>> Neighbors(const std::string& name) const;
  // Ranked candidates for a photo that is not stored, best first; `camera` (a name; empty: none)
  // undistorts it.
  Result<std::vector<NeighborAnswer>> Rank(const PhotoSource& photo, const std::string& camera,
                                           uint32_t count_max) const;
  // Where photos were taken that are not added, each by itself: what is asked changes nothing. A
  // pose is refused where adding the photo would refuse it, with the same reason. `report` is
  // called in the order of the photos, from any thread, one call at a time. Photos are worked on
  // side by side, with the features of each in memory. kNotFound for an unknown camera, and nothing
  // is reported, nor where a request is wrong; kCancelled after a stop request: those reported are
  // done.
  veduta::Status Localize(std::span<const LocalizeRequest> photos,
                          const std::function<void(const LocalizedPhoto&)>& report,
                          std::stop_token stop = {}) const;
  // Living reconstructions, largest first, then ascending ids.
  Result<std::vector<ReconstructionAnswer>> Reconstructions() const;
  // Also one that was merged away: `merged_into` says where it went.
  Result<ReconstructionAnswer> Reconstruction(ReconstructionId id) const;
  Result<PointCloud> Points(ReconstructionId id) const;  // of a living one
  // Merges that are proposed and not believed yet, ascending ids: those of a reconstruction, or all
  // where `id` is not valid().
  Result<std::vector<HypothesisAnswer>> Hypotheses(ReconstructionId id = {}) const;
  Result<std::vector<CameraAnswer>> Cameras() const;  // ascending ids
  // kNotFound lists the cameras there are.
  Result<CameraAnswer> Camera(const std::string& name) const;
  // kNotFound while there is none.
  Result<VocabularyAnswer> Vocabulary() const;
  // The active tree as a file that ImportVocabulary takes.
  veduta::Status ExportVocabulary(const std::string& path) const;
  Result<std::vector<ForbiddenAnswer>> Forbidden() const;  // what people have forbidden
  // Where the city is on the earth, and the surveyed points that tell it.
  Result<GeoreferenceAnswer> Georeference() const;
  // Submitted photos that wait on the disk, in line or not; ascending numbers.
  Result<std::vector<UploadAnswer>> Uploads() const;
  Result<std::vector<TokenAnswer>> Tokens() const;  // all that were ever made; ascending numbers
  // Whose token this text is; nothing where it is none, or is not good any more. In constant time
  // for its secret.
  Result<std::optional<TokenAnswer>> CheckToken(const std::string& text) const;
  // At most `count_max` entries from `first` on.
  Result<std::vector<JournalAnswer>> Journal(uint64_t first, uint32_t count_max) const;

  // A sentence for each violated invariant; empty when the database is sound. Parses every value:
  // one that cannot be read is a violation, and the others are checked all the same. Works on a
  // database that is open for reading, beside a writer. O(database); a deep one also takes as long
  // as extracting the features of all photos.
  Result<std::vector<std::string>> Verify(const VerifyRequest& request) const;
  // One hash over the logical content, in hexadecimal: equal for equal cities.
  Result<std::string> Digest() const;

  // Writes every living reconstruction for other programs into FOLDER/0, FOLDER/1, ..., largest
  // first. kAlreadyExists when the folder exists and is not empty.
  Result<std::vector<ExportedModel>> Export(const ExportRequest& request) const;
  // A picture of a surface, or of points where there is none. The report is of `compare`.
  Result<RenderReport> Render(const RenderRequest& request) const;
  // The surface of a living reconstruction as OGC 3D Tiles 1.1 (TilesetAnswer), and one of its
  // contents. kNotFound, saying what to do, where there is none yet or it has changed since.
  Result<TilesetAnswer> Tileset(ReconstructionId id) const;
  Result<std::vector<uint8_t>> SurfaceTile(ReconstructionId id, const std::string& name) const;

 private:
  friend class Engine;
  friend struct EngineParts;
  struct View;
  explicit Questions(std::unique_ptr<View> view);
  std::unique_ptr<View> view_;
};

class Engine final {
 public:
  static Result<std::unique_ptr<Engine>> Open(const std::string& path,
                                              const EngineOptions& options = {});
  // Finds what is damaged in a database that no program has open for writing, and with `apply`
  // makes a sound one of it. It writes a new database beside, checks it, and exchanges the two: the
  // damaged one is kept until the user deletes it, and the disk has to hold both. A repair that
  // was killed is finished, or begun anew, by the next one. Photos whose bytes are whole are there
  // afterwards; what is lost is named. kBusy, kNotFound, kIoError.
  static Result<RepairAnswer> Repair(const std::string& path, const RepairRequest& request);

  // Finishes the piece at hand; photos whose turn has not come are cancelled (those of Submit wait
  // on, on the disk), and so are AddPhotos and Settle where they run. Tickets and Questions may be
  // used afterwards; the files stay open until the last Questions goes. No other function of the
  // engine may be running.
  ~Engine();

  Questions Ask() const;

  // kAlreadyExists when the name is in use with other intrinsics; the same again is a no-op.
  Result<CameraId> AddCamera(const std::string& name, const CameraModel& model,
                             const std::string& source);

  // While nothing is placed: calibrates, adds and names the cameras of photos that name none, each
  // by its photos together (four at least, of one EXIF or, where they tell nothing, of one size).
  // Takes as long as adding some 40 photos four times. kCancelled: cameras that were added stay.
  Result<std::vector<FirstCamera>> CalibrateFirst(std::span<PhotoSubmission> photos,
                                                  std::stop_token stop = {});

  // Puts a photo on the disk and in line, and returns: it is applied in its turn, and where the
  // process ends before that, once it is resumed. Contributors take turns; the journal records the
  // order in which photos were applied. The answer comes with the photo's own commit; what follows
  // from it is done when nobody waits. kNotFound for an unknown camera or file.
  Result<Ticket> Submit(PhotoSubmission photo, AnswerCallback answered = {});
  // Puts a photo in line that waits on the disk. kNotFound where it does not wait any more,
  // kAlreadyExists where it is in line already.
  Result<Ticket> Resume(uint64_t upload, AnswerCallback answered = {});

  // Adds photos in their order and returns when all are done. Whatever follows from a photo is done
  // before the next one is applied, so the same list gives the same digest; `report` is called from
  // the calling thread, once a photo and in order, after that. `followed` is told of every step
  // that followed, and of its failure, which fails no photo. A photo that cannot be judged (its
  // file cannot be read, the memory is too short, what it needs is damaged) is reported with a
  // `failure` and not stored; the others go on. A stop request finishes the photo at hand:
  // kCancelled. Any other error means that the photos not reported are not stored.
  Status AddPhotos(std::span<const PhotoSubmission> photos,
                   const std::function<void(const AddOutcome&)>& report, std::stop_token stop = {},
                   const std::function<void(const FollowUp&)>& followed = {});

  // Does everything that follows from the photos there are, and tries steps that have failed once
  // more. Returns the first failure of a step, after all that can be done is done. `followed` is
  // also told of steps that failed since the last Settle when nobody waited. Also rewrites the
  // files where a killed Remove has left bytes in them, and opens them again as Remove does: kBusy
  // while somebody asks an earlier state.
  Status Settle(std::stop_token stop = {},
                const std::function<void(const FollowUp&)>& followed = {});

  // Takes photos out with everything that was derived from them, each in a commit of its own, and
  // then rewrites the files without their bytes; `report` is told of each from the calling thread.
  // What stood on them heals; Settle tries photos again that lost their pose. The journal keeps who
  // and when and why, and the photos' numbers alone. Copies elsewhere are out of reach, and named.
  // At the end the files are closed and opened again, as by Reopen, for RocksDB forgets the photos'
  // names then. Without photos and contributor it only finishes the rewriting that an earlier one
  // has left. kNotFound, and nothing is removed, for an unknown photo; kBusy while a dense pass or
  // another removal runs; kCancelled after a stop request: those reported are gone.
  Result<RemoveAnswer> Remove(const RemoveRequest& request, std::stop_token stop = {},
                              const std::function<void(const RemovedPhoto&)>& report = {});
  // A fact that a person states and that placing photos obeys from then on: a forbidden pair is
  // deleted where there is one, and never verified again; a forbidden merge is not made; a photo
  // whose pose is forbidden loses it, with what cannot stand without it, and gets none again.
  // kNotFound; kInvalidArgument where the two are one.
  Status Forbid(const ForbidRequest& request);
  // Takes it back; kNotFound where it was not stated. A photo whose pose was forbidden is tried
  // again by what follows from photos (Settle).
  Status Allow(const ForbidRequest& request);

  // Takes surveyed points in and looks for the place of each reconstruction on the earth, in one
  // commit; answers what is known then. Otherwise places are looked for by what follows from
  // photos, by where these say they were taken. The frames of reconstructions stay.
  // kInvalidArgument names the line of the file; kNotFound where it names no photo of the city.
  Result<GeoreferenceAnswer> Georeference(const GeoreferenceRequest& request);

  // A token lets its owner ask the daemon for what its role may; one that is revoked does not any
  // more, from the next question on. kNotFound for a number that was never given.
  Result<NewToken> CreateToken(const TokenRequest& request);
  Status RevokeToken(uint32_t number, const std::string& actor);

  // Trains a vocabulary from the stored photos now, and switches to it. kInvalidArgument for a
  // shape outside its bounds; kBusy where somebody else has switched meanwhile.
  Status TrainVocabulary(const VocabularyRequest& request = {});
  Status ImportVocabulary(const std::string& path);

  // The dense pass over one or all reconstructions: depth maps and surfaces of what is stale, in
  // pieces, each a commit. kCancelled after a stop request: what is finished is stored. One pass
  // runs at a time: kBusy.
  Result<std::vector<DensifyReport>> Densify(const DensifyRequest& request,
                                             std::stop_token stop = {});

  // A consistent copy that opens on its own: linked where possible, and read once by checksums.
  // Others write while it is read. Deleted where it cannot be read: the error says what is damaged.
  Status Backup(const std::string& folder);
  // Closes and opens the files again, after a failed write: what the disk holds is then known. Does
  // not wait for readers; Questions asked before answer kIoError from then on.
  Status Reopen();

 private:
  friend struct EngineParts;
  Engine();
  std::shared_ptr<EngineParts> parts_;
};

// The OpenCL devices, and which one `wanted` ("" or "auto": the default) means.
Result<DeviceList> ListDevices(const std::string& wanted);
// The formats that Export takes.
std::vector<std::string> ExportFormats();

}  // namespace veduta
