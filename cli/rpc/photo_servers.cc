// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/photo_servers.h"

#include <utility>
#include <variant>

#include "cli/rpc/answer_messages.h"
#include "cli/rpc/ticket_server.h"
#include "cli/wire/place_text.h"

namespace veduta {
namespace {

// How long all of a photo may take to come, as by HTTP.
constexpr kj::Duration kPhotoTime = 10 * kj::MINUTES;

// How long a photo is held after the last question about it, as a connection may rest.
constexpr kj::Duration kRestTime = 10 * kj::MINUTES;

// Candidates that are told where no number is given, and at most: as by HTTP.
constexpr uint32_t kCandidatesDefault = 20, kCandidatesMax = 100'000;

template <typename T>
struct OfSnapshot {
  T answer;
  uint64_t snapshot = 0;
};

}  // namespace

ArrivingPhoto::ArrivingPhoto(const Caller& caller)
    : thing_(TakeOne(caller.session().things, "uploads and other things are held by you")),
      whole_{{}, caller.NewShare()},
      deadline_(caller.session()
                    .timer.afterDelay(kPhotoTime)
                    .then([this] {
                      is_late_ = true;
                      whole_ = {};
                    })
                    .eagerlyEvaluate(nullptr)) {}

void ArrivingPhoto::CheckOpen() const {
  if (is_taken_) kj::throwFatalException(Failure(409, "the photo was complete before"));
  if (is_late_) kj::throwFatalException(Failure(408, "the photo came too slowly"));
}

void ArrivingPhoto::Append(kj::ArrayPtr<const uint8_t> chunk) {
  CheckOpen();
  const uint64_t total = whole_.bytes.size() + chunk.size();
  if (chunk.size() > rpc::CHUNK_BYTES_MAX) {
    kj::throwFatalException(
        Failure(413, "a chunk has at most " + std::to_string(rpc::CHUNK_BYTES_MAX) + " bytes"));
  }
  if (total > kRpcPhotoBytesMax) {
    kj::throwFatalException(
        Failure(413, "the photo is larger than " + std::to_string(kRpcPhotoBytesMax) + " bytes"));
  }
  if (!whole_.share->Grow(total)) {
    whole_.bytes = {};
    kj::throwFatalException(Failure(429,
                                    "the photos that are arriving fill the memory, or yours half "
                                    "of it, and nothing of this is stored"));
  }
  whole_.bytes.insert(whole_.bytes.end(), chunk.begin(), chunk.end());
}

ArrivingPhoto::Whole ArrivingPhoto::Take() {
  CheckOpen();
  if (whole_.bytes.empty())
    kj::throwFatalException(Failure(400, "there is no photo: it has no bytes"));
  is_taken_ = true;
  deadline_ = kj::READY_NOW;
  return std::move(whole_);
}

kj::Promise<void> UploadServer::write(WriteContext context) {
  photo_.Append(context.getParams().getChunk());
  return kj::READY_NOW;
}

kj::Promise<void> UploadServer::done(DoneContext context) {
  context.allowCancellation();
  HttpRequest sender = caller_.Check("POST", {"v1", "photos"}, title_.contributor);
  ArrivingPhoto::Whole whole = photo_.Take();
  // Shared, since tasks are copied.
  const auto photo =
      std::make_shared<PhotoSubmission>(PhotoSubmission{{title_.name, "", std::move(whole.bytes)},
                                                        title_.camera,
                                                        title_.contributor,
                                                        title_.contribution});
  auto paf = kj::newPromiseAndFulfiller<void>();
  auto before = std::exchange(caller_.session().stored, kj::mv(paf.promise));
  auto stored = before.then(
      [this, context, sender = std::move(sender), photo, share = std::move(whole.share)]() mutable {
        return Store(context, std::move(sender), photo, share);
      });
  // Also where the call is cancelled.
  return stored.attach(kj::defer([next = kj::mv(paf.fulfiller)]() mutable { next->fulfill(); }));
}

kj::Promise<void> UploadServer::Store(DoneContext context, HttpRequest sender,
                                      const std::shared_ptr<PhotoSubmission>& photo,
                                      const std::shared_ptr<DividedShare>& share) {
  using Accepted = std::variant<uint64_t, HttpAnswer>;
  return caller_
      .Ask<Accepted>([sender = std::move(sender), photo, share,
                      service = &caller_.service()](Engine*) -> Result<Accepted> {
        return service->AcceptPhoto(sender, std::move(*photo));
      })
      .then([this, context](Accepted accepted) mutable {
        if (const auto* const refusal = std::get_if<HttpAnswer>(&accepted))
          kj::throwFatalException(FailureOf(*refusal));
        const uint64_t number = std::get<uint64_t>(accepted);
        context.getResults().setNumber(number);
        context.getResults().setTicket(kj::heap<TicketServer>(caller_, number));
      });
}

kj::Promise<void> ExaminationServer::write(WriteContext context) {
  photo_.Append(context.getParams().getChunk());
  return kj::READY_NOW;
}

std::function<PhotoSource()> ExaminationServer::Photo() {
  if (was_dropped_) {
    kj::throwFatalException(
        Failure(408, "nothing was asked about the photo for 10 minutes: send it again"));
  }
  if (!whole_) whole_ = std::make_shared<const ArrivingPhoto::Whole>(photo_.Take());
  rest_ = caller_.session()
              .timer.afterDelay(kRestTime)
              .then([this] {
                was_dropped_ = true;
                whole_ = nullptr;  // questions that are at work hold what they need
              })
              .eagerlyEvaluate(nullptr);
  return [name = name_, whole = whole_]() -> PhotoSource { return {name, "", whole->bytes}; };
}

kj::Promise<void> ExaminationServer::localize(LocalizeContext context) {
  context.allowCancellation();
  const Sight sight = caller_.Check("POST", {"v1", "localize"}).sight;
  const auto params = context.getParams();
  const std::string place = TextOf(params.getPlace());
  const std::optional<GeoPosition> near_place = place.empty() ? std::nullopt : ParsePlace(place);
  if (!place.empty() && !near_place) {
    kj::throwFatalException(FailureOf(Status::InvalidArgument(
        "the place is '" + place + "', and must be LATITUDE,LONGITUDE in degrees")));
  }
  using Answer = OfSnapshot<LocalizedPhoto>;
  return caller_
      .Ask<Answer>(
          [photo = Photo(), camera = TextOf(params.getCamera()), near = TextOf(params.getNear()),
           near_place, sight](Engine* engine) -> Result<Answer> {
            const Questions ask = engine->Ask(sight);
            const LocalizeRequest request{photo(), camera, near, near_place};
            Answer answer{{}, ask.snapshot()};
            VEDUTA_RETURN_IF_ERROR(
                ask.Localize({&request, 1},
                             [&](const LocalizedPhoto& localized) { answer.answer = localized; }));
            VEDUTA_RETURN_IF_ERROR(answer.answer.failure);
            return answer;
          },
          WorkKind::kLong)
      .then([context](const Answer& answer) mutable {
        Write(answer.answer, context.getResults().initLocalized());
        context.getResults().setSnapshot(answer.snapshot);
      });
}

kj::Promise<void> ExaminationServer::candidates(CandidatesContext context) {
  context.allowCancellation();
  const Sight sight = caller_.Check("POST", {"v1", "candidates"}).sight;
  const auto params = context.getParams();
  const uint32_t count = params.getCount() == 0 ? kCandidatesDefault : params.getCount();
  if (count > kCandidatesMax)
    kj::throwFatalException(Failure(400, "at most 100000 candidates are told"));
  using Answer = OfSnapshot<std::vector<NeighborAnswer>>;
  return caller_
      .Ask<Answer>(
          [photo = Photo(), camera = TextOf(params.getCamera()), count,
           sight](Engine* engine) -> Result<Answer> {
            const Questions ask = engine->Ask(sight);
            VEDUTA_ASSIGN_OR_RETURN(auto ranked, ask.Rank(photo(), camera, count));
            return Answer{std::move(ranked), ask.snapshot()};
          },
          WorkKind::kLong)
      .then([context](const Answer& answer) mutable {
        const auto size = static_cast<unsigned>(answer.answer.size());
        Write(answer.answer, context.getResults().initCandidates(size));
        context.getResults().setSnapshot(answer.snapshot);
      });
}

}  // namespace veduta
