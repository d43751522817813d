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
#include <utility>
#include <vector>

#include "engine/door/answers.h"
#include "engine/door/backup.h"
#include "engine/door/calibration.h"
#include "engine/door/contributing.h"
#include "engine/door/dense.h"
#include "engine/door/earth.h"
#include "engine/door/engine_options.h"
#include "engine/door/model_import.h"
#include "engine/door/moderation.h"
#include "engine/door/questions.h"
#include "engine/door/repair.h"
#include "engine/door/submission.h"
#include "engine/door/tokens.h"

namespace veduta {

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

  // What whoever has this sight is told; by default all.
  Questions Ask(const Sight& sight = {}) const;

  // kAlreadyExists when the name is in use with other intrinsics; the same again is a no-op.
  Result<CameraId> AddCamera(const std::string& name, const CameraModel& model,
                             const std::string& source);

  // While nothing is placed: calibrates, adds and names the cameras of photos that name none, by
  // their own photos (four of one EXIF or size), else by all, else with one for each photo. Takes
  // as long as adding 40 photos four to twenty times. All cameras are added at once. Where the same
  // photos come again, since AddPhotos was interrupted, they have the cameras of before.
  Result<std::vector<FirstCamera>> CalibrateFirst(std::span<PhotoSubmission> photos,
                                                  std::stop_token stop = {});
  // The same of photos that wait on the disk since their camera cannot be told (Ticket::Wait): the
  // name of a camera that is found is kept with each of its photos, and Resume adds them.
  Result<std::vector<FirstCamera>> CalibrateWaiting(std::stop_token stop = {});

  // Puts a photo on the disk and in line, and returns: it is applied in its turn, and where the
  // process ends before that, once it is resumed. Contributors take turns; the journal records the
  // order in which photos were applied. The answer comes with the photo's own commit; what follows
  // from it is done when nobody waits. kNotFound for an unknown camera or file.
  Result<Ticket> Submit(PhotoSubmission photo, AnswerCallback answered = {});
  // Puts a photo in line that waits on the disk. One that an earlier engine has applied, and that
  // still waits since the process was killed then, is answered at once by what became of it.
  // kNotFound where it does not wait any more, kAlreadyExists where it is in line already.
  Result<Ticket> Resume(uint64_t upload, AnswerCallback answered = {});

  // A photo that comes in parts: what has come is on the disk when ContinueUpload returns, over
  // kills as well. kBusy where more is on its way than may be; kNotFound for an unknown camera or
  // contribution.
  Result<PartialUploadAnswer> BeginUpload(const PartialUploadRequest& request,
                                          const PartialUploadLimits& limits);
  // The bytes from `offset` on; none change nothing. With the last ones the photo gets in line as
  // by Submit, once, in the write that gives its parts up, and `answered` is kept for it.
  // kAlreadyExists where other bytes come next, kInvalidArgument for more than were announced.
  Result<PartialUploadAnswer> ContinueUpload(const std::string& id, uint64_t offset,
                                             std::span<const uint8_t> bytes,
                                             AnswerCallback answered = {});
  // Forgets it, and the bytes that have come; a photo that is in line stays there. kNotFound.
  Status AbandonUpload(const std::string& id);
  // All that no byte has come of since then. How many those were that had not arrived.
  Result<size_t> AbandonUploadsBefore(int64_t time_unix_s);

  // Photos of one contributor that are to be seen as one; its number, which no other one gets.
  // Submit takes photos for it until it is closed. kNotFound; closing once more does nothing.
  Result<uint32_t> OpenContribution(const ContributionRequest& request);
  Status CloseContribution(uint32_t number, const std::string& actor);

  // Adds photos in their order and returns when all are done. Whatever follows from a photo is done
  // before the next one is applied, so the same list gives the same digest; `report` is called from
  // the calling thread, once a photo and in order, after that; photos whose camera is unknown and
  // cannot be estimated yet are tried again after the others, and reported then. `followed` is told
  // of every step that followed, and of its failure, which fails no photo. A photo that cannot be
  // judged (as one whose file cannot be read) is reported with a `failure` and not stored; the
  // others go on. A stop request finishes the photo at hand: kCancelled. Any other error means that
  // the photos not reported are not stored.
  Status AddPhotos(std::span<const PhotoSubmission> photos,
                   const std::function<void(const AddOutcome&)>& report, std::stop_token stop = {},
                   const std::function<void(const FollowUp&)>& followed = {});

  // Makes a reconstruction of a model of COLMAP, in the model's own frame: its photos are added in
  // the model's order and compared as others are, get the model's poses in one commit, as far as
  // our evidence agrees with them, and then what follows is done as by Settle: the reconstruction
  // is adjusted and doubted like any other. Photos that the evidence contradicts are placed like
  // others, or wait. One that is stored already, by whomever, is not stored again; it gets the
  // model's pose where it has none. `report` is told of each photo that was added. Run again after
  // a kill or a stop it goes on. The commit computes in a turn of the writer, some 0.1 s for each
  // photo. kInvalidArgument for a damaged model, or one with a lens that ours cannot express;
  // kNotFound; kCancelled after a stop request.
  Result<ImportAnswer> Import(const ImportRequest& request, std::stop_token stop = {},
                              const std::function<void(const AddOutcome&)>& report = {},
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

  // Withholds photos, or a contribution with all of its photos, from those whose Sight is without
  // what is hidden; the map, and its digest, stay as they are. One commit. Once more changes
  // nothing. Reports of what is hidden count as resolved. kNotFound, and nothing is hidden.
  Status Hide(const HideRequest& request);
  // Takes it back. kNotFound for a photo or a contribution that is not hidden by itself.
  Status Unhide(const HideRequest& request);
  // Somebody complains of a photo: the report's number. One who has an open report of the photo
  // gets that one's. kNotFound; kBusy where kOpenReportsMax wait.
  Result<uint32_t> Report(const ReportRequest& request, const Sight& sight = {});
  // The photo stays as it is. kNotFound; kAlreadyExists where the report was resolved before.
  Status DismissReport(uint32_t number, const std::string& actor);

  // Takes surveyed points in and looks for the place of each reconstruction on the earth, in one
  // commit; answers what is known then. Otherwise places are looked for by what follows from
  // photos, by where these say they were taken. The frames of reconstructions stay.
  // kInvalidArgument names the line of the file; kNotFound where it names no photo of the city.
  Result<GeoreferenceAnswer> Georeference(const GeoreferenceRequest& request);

  // A token lets its owner ask the daemon for what its role may; one that is revoked does not any
  // more, from the next question on. kNotFound for a number that was never given.
  Result<NewToken> CreateToken(const TokenRequest& request);
  Status RevokeToken(uint32_t number, const std::string& actor);
  // Remembers what tokens have used of their quotas. Not durable by itself: a killed process loses
  // none of it, a power cut may. Waits for nobody.
  Status NoteTokenUse(std::span<const TokenUse> uses);

  // Trains a vocabulary from the stored photos now, and switches to it. kInvalidArgument for a
  // shape outside its bounds; kBusy where somebody else has switched meanwhile; kCancelled where it
  // is stopped before the switch: then the vocabulary is the one from before.
  Status TrainVocabulary(const VocabularyRequest& request = {}, std::stop_token stop = {});
  Status ImportVocabulary(const std::string& path, std::stop_token stop = {});

  // The dense pass over one or all reconstructions: depth maps and surfaces of what is stale, in
  // pieces, each a commit. kCancelled after a stop request: what is finished is stored. One pass
  // runs at a time: kBusy.
  Result<std::vector<DensifyReport>> Densify(const DensifyRequest& request,
                                             std::stop_token stop = {});

  // Adds a consistent backup to a folder of them, while others write. Files that the last backup
  // has are not read again; all others are checked by RocksDB's checksums and copied, so that the
  // backups share nothing with the database. Where that fails, is stopped or killed, the older ones
  // are as they were. kCorruption names what is damaged; kBusy while another one is made;
  // kInvalidArgument for a folder of something else; kIoError; kCancelled.
  Result<BackupReport> Backup(const BackupRequest& request, std::stop_token stop = {});
  // A consistent copy that opens on its own: linked where possible, and read once by checksums.
  // Others write while it is read. Deleted where it cannot be read: the error says what is damaged;
  // and where it is stopped: kCancelled.
  Status Copy(const std::string& folder, std::stop_token stop = {});
  // Processes that have ended on photos they had to decode, since the engine was opened: by the
  // photo, and killed from outside. Both 0 where photos are decoded in this process.
  std::pair<uint64_t, uint64_t> DecoderDeaths() const;
  // Closes and opens the files again, after a failed write. Does not wait for readers: Questions
  // asked before answer kBusy from then on, as all do where it fails, until it is called again.
  Status Reopen();

 private:
  friend struct EngineParts;
  Engine();
  std::shared_ptr<EngineParts> parts_;
};

// What is in a folder of backups: as the backups themselves tell, or by reading all files of all of
// them. What is damaged is named, and is no failure. kNotFound, kBusy, kIoError, kCancelled.
Result<BackupList> ListBackups(const std::string& folder);
Result<BackupList> CheckBackups(const std::string& folder, std::stop_token stop = {});
// Deletes all but the newest `keep`, at least 1, and the files that none of these has; how many.
Result<uint32_t> ThinBackups(const std::string& folder, uint32_t keep);
// Makes a database of a backup, 0 for the newest, where nothing is yet. Each file is compared with
// its hash, and the database is opened once, before it gets its name: whatever fails leaves
// nothing there. kNotFound; kAlreadyExists; kCorruption names what is damaged.
Result<BackupAnswer> RestoreBackup(const std::string& folder, uint32_t number,
                                   const std::string& path, std::stop_token stop = {});
// The OpenCL devices, and which one `wanted` ("" or "auto": the default) means.
Result<DeviceList> ListDevices(const std::string& wanted);
// The formats that Export takes.
std::vector<std::string> ExportFormats();

}  // namespace veduta
