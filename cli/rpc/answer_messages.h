// SPDX-License-Identifier: Apache-2.0
#pragma once
// The answers of the engine as messages of cli/rpc/veduta.capnp.

#include <string>
#include <vector>

#include "cli/rpc/veduta.capnp.h"
#include "engine/engine.h"

namespace veduta {

std::string TextOf(capnp::Text::Reader text);

void Write(const StatusAnswer& status, rpc::Status::Builder message);
void Write(const AddOutcome& outcome, rpc::Outcome::Builder message);
void Write(const PlainPose& pose, ReconstructionId reconstruction, rpc::Pose::Builder message);
void Write(const EarthPose& pose, rpc::EarthPose::Builder message);
void Write(const LocalizedPhoto& photo, rpc::Localized::Builder message);
void Write(const std::vector<NeighborAnswer>& neighbors,
           capnp::List<rpc::Neighbor>::Builder message);
void Write(const std::vector<ReconstructionAnswer>& reconstructions,
           capnp::List<rpc::Reconstruction>::Builder message);
void Write(const std::vector<JournalAnswer>& entries,
           capnp::List<rpc::JournalEntry>::Builder message);

}  // namespace veduta
