// SPDX-License-Identifier: Apache-2.0
#pragma once
// What can be asked of the city: a part of the one door, engine/engine.h, which includes it.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/door/answers.h"
#include "engine/door/calibration.h"
#include "engine/door/contributing.h"
#include "engine/door/dense.h"
#include "engine/door/earth.h"
#include "engine/door/moderation.h"
#include "engine/door/photo_search.h"
#include "engine/door/repair.h"
#include "engine/door/submission.h"
#include "engine/door/tokens.h"

namespace veduta {

struct EngineParts;  // what the rooms behind the door work with: engine/parts.h

// Questions to one snapshot of the city, by somebody of a certain Sight: what is not for them is in
// no answer but those of Digest, Verify, Export, Render, Tokens, Forbidden, Hidden and Reports,
// which are for owners and curators. Answers own what they hold. Cheap to make; holding one
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
  // Whether Image reads a few records. Otherwise, after a commit, the first one who asks waits for
  // a look over the whole city.
  bool TellsImagesAtOnce() const;
  // By its name, by contributor and name with a slash between, by "#" and its number, or by 8 and
  // more digits of its photo's SHA-256 in hexadecimal. kNotFound names it; kInvalidArgument says
  // which images it may mean, if several. The same wherever a photo is asked for by a text.
  Result<ImageAnswer> Image(const std::string& name) const;
  // At most `count_max` images, ascending ids from `first` on.
  Result<std::vector<ListedImage>> Images(ImageId first, uint32_t count_max) const;
  // Stored photos by when and where they were taken.
  Result<FoundPhotos> SearchPhotos(const PhotoSearch& search) const;
  // Of a city of at most kSearchedPhotosMax photos; of a larger one nothing is told.
  Result<PhotoExtent> Extent() const;
  // The photo as it came, and a JPEG of it whose longer side has `side_px` at most, 1 to
  // kThumbnailSideMax: as long as decoding it takes. kNotFound for a rejected one.
  Result<PhotoFile> Photo(const std::string& name) const;
  Result<PhotoFile> Thumbnail(const std::string& name, uint32_t side_px) const;
  // What came, where private areas of it were filled before it was stored (EngineOptions);
  // kNotFound where none were.
  Result<PhotoFile> Original(const std::string& name) const;
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
  // A photo that arrives in parts, and stays known for a while once it has arrived. kNotFound.
  Result<PartialUploadAnswer> PartialUpload(const std::string& id) const;
  // Contributions, ascending numbers from `first` on, at most `count_max`.
  Result<std::vector<ContributionAnswer>> Contributions(uint32_t first, uint32_t count_max) const;
  Result<ContributionAnswer> Contribution(uint32_t number) const;  // kNotFound
  // Reads a record for each of its photos, and all that wait or arrive.
  Result<ContributionSums> ContributionVerdicts(uint32_t number) const;
  // Ascending uploads from `first` on, at most `count_max`; those that arrive in parts are not
  // among them.
  Result<std::vector<ContributedPhotoAnswer>> ContributedPhotos(uint32_t number, uint64_t first,
                                                                uint32_t count_max) const;
  Result<std::vector<TokenAnswer>> Tokens() const;  // all that were ever made; ascending numbers
  // Whose token this text is; nothing where it is none, or is not good any more. In constant time
  // for its secret.
  Result<std::optional<TokenAnswer>> CheckToken(const std::string& text) const;
  Result<std::vector<TokenUse>> TokenUses() const;  // ascending numbers
  // What curators have hidden: images, then contributions; ascending numbers.
  Result<std::vector<HiddenAnswer>> Hidden() const;
  // What people have reported; ascending numbers. With `open_only` those that wait.
  Result<std::vector<ReportAnswer>> Reports(bool open_only) const;
  // Whether the image, or the photo that waits under that number, may be told; one that is not
  // there may, unless it was hidden before.
  Result<bool> Sees(ImageId image) const;
  Result<bool> SeesUpload(uint64_t number) const;
  // The outcome without what may not be told: of which photo the bytes are stored.
  Result<AddOutcome> Told(AddOutcome outcome) const;
  // At most `count_max` entries from `first` on. Of one about what may not be told, no more than
  // its number, time and action.
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
  // contents. kNotFound, saying what to do, where there is none yet or it has changed since. A
  // coarse content leaves out what is damaged; a fine one is kCorruption then.
  Result<TilesetAnswer> Tileset(ReconstructionId id) const;
  Result<SurfaceTileAnswer> SurfaceTile(ReconstructionId id, const std::string& name) const;

 private:
  friend class Engine;
  friend struct EngineParts;
  struct View;
  explicit Questions(std::unique_ptr<View> view);
  std::unique_ptr<View> view_;
};

}  // namespace veduta
