// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `dense`, entry 1: how a reconstruction is made dense. FORMAT.md, section "dense_settings".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/dense.h"

namespace veduta {

std::string DenseSettingsKey(ReconstructionId reconstruction);
Status ParseDenseKey(std::string_view key, ReconstructionId* reconstruction);

// Decode: the caller has set the reconstruction.
Status Check(const DenseSettings& settings);
Result<std::string> Encode(const DenseSettings& settings);
Status Decode(std::string_view value, DenseSettings* settings);

}  // namespace veduta
