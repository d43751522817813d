// SPDX-License-Identifier: Apache-2.0
// veduta status DB [--json]; veduta reconstruction DB ID [--json]
#include "cli/command.h"
#include "cli/hypotheses.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

// One line, and a second one where the dense pass has made something of it.
void PrintReconstruction(const ReconstructionAnswer& r) {
  PrintLine(
      "reconstruction %u: %u images, %lu points, %lu observations, mean reprojection error %.3f px",
      r.id.value, r.images, r.points, r.observations, r.reprojection_error_px_mean);
  if (r.depth_maps > 0) {
    PrintLine("  dense: %lu depth maps, %lu tiles, %lu triangles", r.depth_maps, r.tiles,
              r.triangles);
  }
}

void PrintSeams(const StatusAnswer& status) {
  if (status.open_hypotheses == 0) return;
  PrintLine("merges that are proposed and not believed yet: %lu", status.open_hypotheses);
  for (const HypothesisAnswer& hypothesis : status.doubtful_seams) PrintHypothesis(hypothesis);
  if (status.open_hypotheses > status.doubtful_seams.size()) {
    PrintLine("  and %lu others, which rest on fewer common points",
              status.open_hypotheses - status.doubtful_seams.size());
  }
}

int PrintStatus(const std::string& db, bool json) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const Result<StatusAnswer> status = (*engine)->Ask().Status();
  if (!status.ok()) return Fail(status.status());
  if (json) {
    PrintJson(ToJson(*status));
    return kDone;
  }
  PrintLine("%lu images: %lu placed, %lu postponed, %lu rejected; %.1f MB", status->images,
            status->placed, status->postponed, status->rejected,
            static_cast<double>(status->total_bytes) / 1e6);
  if (status->unsure > 0) {
    PrintLine(
        "%lu of the placed photos may stand in another reconstruction as well, and no pose of "
        "them is told",
        status->unsure);
  }
  for (const ReconstructionAnswer& r : status->reconstructions) PrintReconstruction(r);
  PrintSeams(*status);
  if (status->uploads > 0) {
    PrintLine("%lu photos wait for their turn: `veduta serve` or `veduta settle` places them",
              status->uploads);
  }
  if (status->backlog > 0) {
    PrintLine("%lu postponed photos are still to be tried again", status->backlog);
  }
  return kDone;
}

int PrintOneReconstruction(const std::string& db, ReconstructionId id, bool json) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const Questions ask = (*engine)->Ask();
  const Result<ReconstructionAnswer> answer = ask.Reconstruction(id);
  if (!answer.ok()) return Fail(answer.status());
  const Result<std::vector<HypothesisAnswer>> hypotheses = ask.Hypotheses(answer->id);
  if (!hypotheses.ok()) return Fail(hypotheses.status());
  if (json) {
    PrintJson(ReconstructionJson(*answer, *hypotheses));
  } else if (answer->dissolved) {
    PrintLine("reconstruction %u was dissolved: all its images have lost their poses",
              answer->id.value);
  } else if (answer->merged_into.valid()) {
    PrintLine("reconstruction %u was merged into reconstruction %u, at scale %.6g",
              answer->id.value, answer->merged_into.value, answer->merged_scale);
  } else {
    PrintReconstruction(*answer);
    for (const HypothesisAnswer& hypothesis : *hypotheses) PrintHypothesis(hypothesis);
  }
  return kDone;
}

}  // namespace

void RegisterStatus(CLI::App* app, int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app->add_subcommand("status", "Counts, reconstructions, backlog");
  command->add_option("DB", *db, "Database")->required();
  command->add_flag("--json", *json, "JSON");
  command->callback([=] { *exit_code = PrintStatus(*db, *json); });
}

void RegisterReconstruction(CLI::App* app, int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto id = std::make_shared<uint32_t>(0);
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app->add_subcommand(
      "reconstruction", "One reconstruction; of one that was merged away, where it went");
  command->add_option("DB", *db, "Database")->required();
  command->add_option("ID", *id, "Its number, as `veduta status` lists it")
      ->required()
      ->check(AboveZero());
  command->add_flag("--json", *json, "JSON");
  command->callback(
      [=] { *exit_code = PrintOneReconstruction(*db, ReconstructionId(*id), *json); });
}

}  // namespace veduta
