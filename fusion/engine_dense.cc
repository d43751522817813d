// SPDX-License-Identifier: Apache-2.0
// The members of the door that need the dense pass. The door's header lies below this folder; what
// it declares is defined where it is known how it is done.
#include "engine/parts.h"
#include "engine/query/invariants.h"
#include "fusion/dense_door.h"
#include "fusion/export/exporter.h"
#include "fusion/pass/dense_invariants.h"
#include "fusion/surface_tiles.h"
#include "storage/base/option_bounds.h"

namespace veduta {

Result<std::vector<DensifyReport>> Engine::Densify(const DensifyRequest& request,
                                                   std::stop_token stop) {
  const PhotoPreparer& preparer = *parts_->preparer;
  const ViewTools views{preparer.decoder(), &preparer.tables(),
                        [&](uint64_t bytes) { return preparer.TakeMemory(bytes); }};
  const uint64_t cache_bytes = parts_->options.surface_cache_bytes;
  return DensifyAll(*parts_->writer, *parts_->pool, parts_->dense_pass, request, std::move(stop),
                    views, cache_bytes - cache_bytes / kCoarseShare);
}

Result<std::vector<ExportedModel>> Questions::Export(const ExportRequest& request) const {
  return ExportReconstructions(*view_->snapshot, request);
}

Result<RenderReport> Questions::Render(const RenderRequest& request) const {
  return RenderToFile(view_->snapshot, *view_->parts->pool, request);
}

Result<TilesetAnswer> Questions::Tileset(ReconstructionId id) const {
  VEDUTA_RETURN_IF_ERROR(view_->RefuseUnseen(id));
  return MakeTileset(*view_->snapshot, id);
}

Result<SurfaceTileAnswer> Questions::SurfaceTile(ReconstructionId id,
                                                 const std::string& name) const {
  VEDUTA_RETURN_IF_ERROR(view_->RefuseUnseen(id));
  return MakeSurfaceTile(*view_->snapshot, id, name, &view_->caches->surfaces);
}

Status VerifyRequest::Check() const {
  return OptionBounds().AtLeast("count_max", count_max, 1).status();
}

Result<std::vector<std::string>> Questions::Verify(const VerifyRequest& request) const {
  VEDUTA_RETURN_IF_ERROR(OptionBounds().Part("VerifyRequest", request.Check()).status());
  const CheckOptions options{.count_max = request.count_max,
                             .deep = request.deep,
                             .preparer = view_->parts->preparer.get()};
  VEDUTA_ASSIGN_OR_RETURN(std::vector<std::string> violations,
                          FindViolations(*view_->snapshot, options));
  VEDUTA_ASSIGN_OR_RETURN(
      const std::vector<std::string> dense,
      FindDenseViolations(*view_->snapshot, options.count_max - violations.size()));
  violations.insert(violations.end(), dense.begin(), dense.end());
  return violations;
}

Result<DeviceList> ListDevices(const std::string& wanted) {
  return ListDevicesFor(wanted);
}

}  // namespace veduta
