// SPDX-License-Identifier: Apache-2.0
#pragma once
// The dense half of the door (engine/engine.h): what Engine::Densify, Questions::Export,
// Questions::Render, ListDevices and ExportFormats do, as functions of what the engine holds.

#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/door/dense.h"
#include "engine/writer/claimable.h"
#include "engine/writer/writer.h"
#include "fusion/pass/view_loader.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

// Engine::Densify. First sweeps what belongs to reconstructions that were merged away, and again at
// the end if one was merged away meanwhile.
//
// views        what stored photos are read with.
// cache_bytes  DensePassTools; none: as usual.
// one_pass     one for each database: kBusy while another pass has claimed it.
//
// Errors: kInvalidArgument on bad options or a reconstruction that was merged; kNotFound when there
// is no such reconstruction, none at all, or no such device; kCancelled after a stop request. With
// the device "auto" and none that works, C++ does the work.
Result<std::vector<DensifyReport>> DensifyAll(Writer& writer, ThreadPool& pool, Claimable& one_pass,
                                              const DensifyRequest& request, std::stop_token stop,
                                              const ViewTools& views = {},
                                              std::optional<uint64_t> cache_bytes = std::nullopt);

// Questions::Export is ExportReconstructions of fusion/export/exporter.h, and ExportFormats is
// defined there too.

// Questions::Render. kInvalidArgument on a bad request; kNotFound when there is no such image or
// reconstruction, no pose, or nothing to draw; kIoError with the path.
Result<RenderReport> RenderToFile(std::shared_ptr<const Snapshot> snapshot, ThreadPool& pool,
                                  const RenderRequest& request);

// ListDevices of engine/engine.h. That no device is there is an answer (`why_none`); that the one
// asked for is not there is kNotFound.
Result<DeviceList> ListDevicesFor(const std::string& wanted);

}  // namespace veduta
