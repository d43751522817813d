// SPDX-License-Identifier: Apache-2.0
#include "cli/service/dense_keeper.h"

#include <utility>
#include <vector>

#include "cli/service/niceness.h"
#include "storage/base/memory_shortage.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// How often it looks whether something has changed. Chosen by hand.
constexpr std::chrono::milliseconds kLook(500);
// Entries of the journal that are read at once. Chosen by hand.
constexpr uint32_t kEntriesMax = 1000;
// The dense city has time: whoever asks and whoever adds goes first.
constexpr int kNiceness = 15;

}  // namespace

Status DenseKeeping::Check() const {
  return OptionBounds()
      .Part("request", request.Check())
      .Between("pause_s", pause_s, 1, 86'400)
      .Between("patience_s", patience_s, pause_s, 86'400)
      .status();
}

DenseKeeper::DenseKeeper(Engine* engine, const DenseKeeping& options,
                         std::function<void(const Status&)> failed)
    : engine_(engine), options_(options), failed_(std::move(failed)) {
  if (options_.is_wanted) thread_ = std::jthread([this](std::stop_token stop) { Run(stop); });
}

DenseKeeper::~DenseKeeper() {
  thread_.request_stop();
  const std::lock_guard lock(mutex_);
  pass_.request_stop();
}

Status DenseKeeper::Pause(bool is_paused) {
  if (!options_.is_wanted) {
    return Status::InvalidArgument(
        "this daemon makes no dense city: begin it as 'veduta serve --dense'");
  }
  const std::lock_guard lock(mutex_);
  is_paused_ = is_paused;
  if (is_paused_) pass_.request_stop();
  changed_.notify_all();
  return Status::Ok();
}

DenseKeeper::Rest::Rest(DenseKeeper* keeper) : keeper_(keeper) {
  std::unique_lock lock(keeper_->mutex_);
  ++keeper_->rests_;
  keeper_->pass_.request_stop();
  keeper_->changed_.wait(lock, [&] { return !keeper_->is_at_work_; });
}

DenseKeeper::Rest::~Rest() {
  {
    const std::lock_guard lock(keeper_->mutex_);
    --keeper_->rests_;
  }
  keeper_->changed_.notify_all();
}

DenseKeeper::OthersPass::OthersPass(DenseKeeper* keeper, const std::stop_token& stop)
    : keeper_(keeper), on_stop_(stop, [pass = pass_]() mutable { pass.request_stop(); }) {
  std::unique_lock lock(keeper_->mutex_);
  if (keeper_->others_++ == 0) keeper_->pass_.request_stop();
  has_begun_ = keeper_->changed_.wait(
      lock, stop, [&] { return !keeper_->is_at_work_ && keeper_->rests_ == 0; });
  if (!has_begun_) return;
  keeper_->pass_ = pass_;
  keeper_->is_at_work_ = true;
}

DenseKeeper::OthersPass::~OthersPass() {
  {
    const std::lock_guard lock(keeper_->mutex_);
    --keeper_->others_;
    if (has_begun_) {
      keeper_->is_at_work_ = false;
      keeper_->stage_.clear();
      keeper_->done_ = keeper_->total_ = 0;
    }
  }
  keeper_->changed_.notify_all();
}

void DenseKeeper::Tell(std::string_view stage, size_t done, size_t total) {
  const std::lock_guard lock(mutex_);
  stage_ = stage;
  done_ = done;
  total_ = total;
}

Json DenseKeeper::ToJson() const {
  const std::lock_guard lock(mutex_);
  const char* state = "waiting";
  if (is_at_work_) {
    state = "working";
  } else if (!options_.is_wanted) {
    state = "off";
  } else if (is_paused_) {
    state = "paused";
  }
  return {{"state", state},    {"stage", stage_.empty() ? Json() : Json(stage_)},
          {"done", done_},     {"total", total_},
          {"passes", passes_}, {"why_not", why_not_.empty() ? Json() : Json(why_not_)}};
}

void DenseKeeper::Run(std::stop_token stop) {
  BeNicer(kNiceness);
  while (WaitUntilDue(stop)) Pass(stop);
}

Result<bool> DenseKeeper::HasChanged() {
  bool has_changed = false;
  for (;;) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<JournalAnswer> entries,
                            engine_->Ask().Journal(next_entry_, kEntriesMax));
    if (entries.empty()) return has_changed;
    for (const JournalAnswer& entry : entries) {
      has_changed = has_changed || entry.action != "densify";
      next_entry_ = entry.sequence + 1;
    }
  }
}

bool DenseKeeper::WaitUntilDue(const std::stop_token& stop) {
  const std::chrono::seconds pause(options_.pause_s), patience(options_.patience_s);
  std::optional<Clock::time_point> first, last;  // change since the last pass
  std::unique_lock lock(mutex_);
  if (!why_not_.empty() || pass_.stop_requested()) {  // what it has left undone is due
    first = last = Clock::now();
    changed_.wait_for(lock, stop, why_not_.empty() ? pause : patience, [] { return false; });
  }
  while (!stop.stop_requested()) {
    lock.unlock();
    const auto has_changed = CatchShortage("read the journal", [&] { return HasChanged(); });
    lock.lock();
    const Clock::time_point now = Clock::now();
    if (has_changed.ok() && *has_changed) {
      last = now;
      if (!first) first = now;
    }
    const bool may_begin = !is_paused_ && rests_ + others_ == 0;
    if (may_begin && first && (now - *last >= pause || now - *first >= patience)) return true;
    changed_.wait_for(lock, stop, kLook, [] { return false; });
  }
  return false;
}

void DenseKeeper::Pass(const std::stop_token& stop) {
  const auto placed = CatchShortage("ask what there is to make dense",
                                    [&] { return engine_->Ask().Reconstructions(); });
  if (placed.ok() && placed->empty()) return;
  std::stop_token pass;
  {
    const std::lock_guard lock(mutex_);
    if (stop.stop_requested() || is_paused_ || rests_ + others_ > 0) return;
    pass_ = std::stop_source();
    pass = pass_.get_token();
    is_at_work_ = true;
  }
  DensifyRequest request = options_.request;
  request.progress = [this](std::string_view stage, size_t done, size_t total) {
    Tell(stage, done, total);
  };
  Status ended = CatchShortage(
      "make the city dense", [&]() -> Status { return engine_->Densify(request, pass).status(); });
  if (ended.code() == StatusCode::kCancelled) ended = Status::Ok();  // what is left is due
  {
    const std::lock_guard lock(mutex_);
    is_at_work_ = false;
    stage_.clear();
    done_ = total_ = 0;
    why_not_ = ended.message();
    if (ended.ok() && !pass.stop_requested()) ++passes_;
  }
  changed_.notify_all();
  if (!ended.ok() && failed_) failed_(ended);
}

}  // namespace veduta
