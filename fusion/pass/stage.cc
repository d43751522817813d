// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/stage.h"

#include <set>
#include <tuple>

namespace veduta {
namespace {

bool IsSame(const TileRecord& a, const TileRecord& b) {
  const auto versions = [](const TileRecord& tile) {
    return std::tie(tile.blocks, tile.volume_version, tile.histogram_version,
                    tile.first_round_version, tile.solution_version, tile.mesh_version,
                    tile.color_version);
  };
  return versions(a) == versions(b);
}

}  // namespace

Status DensePass::Tell(std::string_view stage, size_t done, size_t total) const {
  if (tools_.progress) tools_.progress(stage, done, total);
  return CheckStop();
}

Status DensePass::CheckStop() const {
  return tools_.stop.stop_requested()
             ? Status::Cancelled("stopped on request: what is finished is stored")
             : Status::Ok();
}

MemoryBudget::Share DensePass::TakeMemory(uint64_t bytes) const {
  return tools_.views.take_memory ? tools_.views.take_memory(bytes) : MemoryBudget::Share();
}

Status DensePass::Commit(const Write& write) {
  Writer::Turn turn = tools_.writer.Take();
  const auto transaction = turn.database().BeginTransaction();
  const auto snapshot = turn.database().GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          snapshot->GetReconstruction(reconstruction()));
  if (!record.is_living()) {
    merged_into_ = record.merged_into;
    dissolved_ = record.is_dissolved;
    return Status::Cancelled(
        "reconstruction " + std::to_string(record.id.value) + " was " +
        (dissolved_ ? "dissolved" : "merged into " + std::to_string(merged_into_.value)) +
        " while the dense pass worked on it");
  }
  VEDUTA_RETURN_IF_ERROR(write(*snapshot, transaction.get()));
  return transaction->Commit();
}

Status DensePass::NoteOvertaken() {
  is_overtaken_ = true;
  return Status::Busy(
      "photos were taken out of reconstruction " + std::to_string(reconstruction().value) +
      " while the dense pass worked on it; what is finished is stored: do it again");
}

Status DensePass::CommitTile(const std::optional<TileRecord>& as_read, const GridPlace& place,
                             const Write& write) {
  return Commit([&](const Snapshot& now, Transaction* transaction) -> Status {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<TileRecord> tile,
                            now.dense().FindTile(surface(), place));
    if (tile.has_value() != as_read.has_value() || (tile && !IsSame(*tile, *as_read)))
      return NoteOvertaken();
    return write(now, transaction);
  });
}

Status DensePass::ExpectDepth(const Snapshot& now, const DepthRecord& as_read) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<DepthRecord> depth,
                          now.dense().FindDepth(as_read.image));
  const bool is_same = depth && depth->version == as_read.version &&
                       depth->checked_version == as_read.checked_version;
  return is_same ? Status::Ok() : NoteOvertaken();
}

Status SweepStale(DensePass* pass) {
  const auto snapshot = pass->GetSnapshot();
  std::set<DepthVersion> named;
  VEDUTA_RETURN_IF_ERROR(snapshot->dense().ScanDepths([&](const DepthRecord& depth) {
    named.insert({depth.image, 0, depth.checked_version});
    return true;
  }));
  std::vector<DepthVersion> stale;
  VEDUTA_RETURN_IF_ERROR(snapshot->dense().ScanCheckedDepths([&](const CheckedDepthRecord& depth) {
    // The pass over another reconstruction may have been killed, and then still has to withdraw
    // its superseded maps from its tiles.
    const bool is_own = depth.reconstruction == pass->reconstruction();
    const DepthVersion version{depth.image, 0, depth.version};
    if (is_own && !named.contains(version)) stale.push_back(version);
    return true;
  }));
  if (stale.empty()) return Status::Ok();
  return pass->Commit([&](const Snapshot&, Transaction* transaction) {
    for (const DepthVersion& depth : stale)
      transaction->dense().DeleteCheckedDepth(depth.image, depth.version);
    return Status::Ok();
  });
}

}  // namespace veduta
