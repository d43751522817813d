// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/orders/order_run.h"

#include <chrono>
#include <iomanip>
#include <mutex>
#include <sstream>
#include <thread>

#include "engine/engine.h"
#include "storage/base/median.h"

namespace veduta::orders {
namespace {

constexpr const char* kCamera = "camera";

Status AddAll(Engine& engine, const PhotoOrder& order, const std::string& camera, OrderRun* run) {
  std::vector<PhotoSubmission> submissions;
  for (const OrderedPhoto& photo : order.photos)
    submissions.push_back({{photo.name, photo.path, {}}, camera, "orders"});
  const auto begin = std::chrono::steady_clock::now();
  if (camera.empty()) VEDUTA_RETURN_IF_ERROR(engine.CalibrateFirst(submissions).status());
  Status followed;
  const Status added = engine.AddPhotos(
      submissions,
      [&](const AddOutcome& outcome) {
        if (!outcome.failure.ok()) {
          ++run->failed;
          if (run->failure.empty()) run->failure = outcome.failure.message();
        }
      },
      {},
      [&](const FollowUp& step) {
        if (!step.status.ok() && followed.ok()) followed = step.status;
      });
  run->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return added.ok() ? followed : added;
}

// What all contributors have in common.
struct Answers {
  std::mutex mutex;
  std::vector<double> seconds;
  Status failure;
};

void SubmitShare(Engine& engine, const PhotoOrder& order, const std::string& camera,
                 uint32_t contributor, uint32_t count, Answers* answers) {
  for (size_t i = contributor; i < order.photos.size(); i += count) {
    const OrderedPhoto& photo = order.photos[i];
    const auto begin = std::chrono::steady_clock::now();
    const Result<Ticket> ticket = engine.Submit(
        {{photo.name, photo.path, {}}, camera, "contributor " + std::to_string(contributor)});
    const Status status = ticket.ok() ? ticket->Wait().status() : ticket.status();
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
    const std::lock_guard lock(answers->mutex);
    answers->seconds.push_back(took.count());
    if (!status.ok() && answers->failure.ok()) answers->failure = status;
  }
}

Status SubmitAll(Engine& engine, const PhotoOrder& order, const std::string& camera,
                 uint32_t contributors, OrderRun* run) {
  const auto begin = std::chrono::steady_clock::now();
  Answers answers;
  std::vector<std::thread> threads;
  for (uint32_t c = 0; c < contributors; ++c)
    threads.emplace_back([&, c] { SubmitShare(engine, order, camera, c, contributors, &answers); });
  for (std::thread& thread : threads) thread.join();
  const Status settled = engine.Settle();
  run->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  run->answer_median_s = QuantileInPlace(answers.seconds, 0.5);
  run->answer_p99_s = QuantileInPlace(answers.seconds, 0.99);
  run->answer_most_s = QuantileInPlace(answers.seconds, 1.0);
  return answers.failure.ok() ? settled : answers.failure;
}

Status ReadPoses(const Questions& questions, const PhotoOrder& order, OrderRun* run) {
  VEDUTA_ASSIGN_OR_RETURN(const StatusAnswer status, questions.Status());
  run->placed = static_cast<uint32_t>(status.placed);
  run->postponed = static_cast<uint32_t>(status.postponed);
  run->rejected = static_cast<uint32_t>(status.rejected);
  for (const OrderedPhoto& photo : order.photos) {
    const Result<ImageAnswer> image = questions.Image(photo.name);
    if (image.status().code() == StatusCode::kNotFound) continue;  // failed, or rejected
    VEDUTA_RETURN_IF_ERROR(image.status());
    if (!image->cam_from_world) continue;
    const PlainPose& pose = *image->cam_from_world;
    const auto& q = pose.rotation_wxyz;
    PlacedPhoto placed;
    placed.name = photo.name;
    placed.reconstruction = image->reconstruction.value;
    placed.cam_from_world.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    placed.cam_from_world.translation = Eigen::Vector3d(pose.translation.data());
    run->poses.push_back(std::move(placed));
  }
  return {};
}

Status Run(const PhotoOrder& order, const std::optional<CameraModel>& camera, uint32_t threads,
           uint32_t contributors, const std::string& folder, OrderRun* run) {
  EngineOptions options;
  options.create = true;
  options.sync = false;
  options.thread_count = threads;
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Engine> engine,
                          Engine::Open(folder + "/database", options));
  if (camera)
    VEDUTA_RETURN_IF_ERROR(engine->AddCamera(kCamera, *camera, "veduta-bench-orders").status());
  const std::string name = camera ? kCamera : "";
  const Status added = contributors == 0 ? AddAll(*engine, order, name, run)
                                         : SubmitAll(*engine, order, name, contributors, run);
  VEDUTA_RETURN_IF_ERROR(ReadPoses(engine->Ask(), order, run));
  return added;
}

}  // namespace

OrderRun RunOrder(const PhotoOrder& order, const std::optional<CameraModel>& camera,
                  uint32_t threads, uint32_t contributors, const std::string& folder) {
  OrderRun run;
  run.label = order.label;
  run.photos = static_cast<uint32_t>(order.photos.size());
  const Status status = Run(order, camera, threads, contributors, folder, &run);
  if (!status.ok()) run.failure = status.message();
  return run;
}

std::string RunText(const OrderRun& run) {
  std::ostringstream text;
  text << std::setprecision(17) << run.label << "\n"
       << run.failure << "\n"
       << run.kept << "\n"
       << run.photos << " " << run.placed << " " << run.postponed << " " << run.rejected << " "
       << run.failed << " " << run.seconds << " " << run.answer_median_s << " " << run.answer_p99_s
       << " " << run.answer_most_s << " " << run.poses.size() << "\n";
  for (const PlacedPhoto& placed : run.poses) {
    const Eigen::Quaterniond& q = placed.cam_from_world.rotation;
    const Eigen::Vector3d& t = placed.cam_from_world.translation;
    text << placed.reconstruction << " " << q.w() << " " << q.x() << " " << q.y() << " " << q.z()
         << " " << t.x() << " " << t.y() << " " << t.z() << " " << placed.name << "\n";
  }
  return text.str();
}

Result<OrderRun> ParseRun(const std::string& text) {
  std::istringstream lines(text);
  OrderRun run;
  size_t count = 0;
  std::getline(lines, run.label);
  std::getline(lines, run.failure);
  std::getline(lines, run.kept);
  lines >> run.photos >> run.placed >> run.postponed >> run.rejected >> run.failed >> run.seconds >>
      run.answer_median_s >> run.answer_p99_s >> run.answer_most_s >> count;
  for (size_t i = 0; lines && i < count; ++i) {
    PlacedPhoto placed;
    Eigen::Quaterniond& q = placed.cam_from_world.rotation;
    Eigen::Vector3d& t = placed.cam_from_world.translation;
    lines >> placed.reconstruction >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z();
    lines.ignore(1);
    std::getline(lines, placed.name);
    run.poses.push_back(std::move(placed));
  }
  if (!lines) return Status::Corruption("the text of a run of an order is cut short");
  return run;
}

}  // namespace veduta::orders
