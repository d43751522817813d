// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/city_server.h"

#include <string>
#include <vector>

#include "cli/rpc/answer_messages.h"
#include "cli/rpc/journal_follower.h"
#include "cli/rpc/photo_servers.h"
#include "cli/rpc/point_reader_server.h"
#include "cli/rpc/ticket_server.h"
#include "cli/service/photo_name.h"

namespace veduta {
namespace {

// Of names and other texts of a question. Chosen by hand: paths of files fit.
constexpr size_t kTextBytesMax = 4096;

// A text of a question. Throws 400.
std::string ShortText(capnp::Text::Reader text, const char* what) {
  if (text.size() > kTextBytesMax) {
    kj::throwFatalException(Failure(400, std::string("the ") + what + " is longer than " +
                                             std::to_string(kTextBytesMax) + " bytes"));
  }
  return TextOf(text);
}

// Why no pose is told of an image.
std::string WhyNoPose(const ImageAnswer& image) {
  return image.name + " has no pose that could be told: " +
         (image.cam_from_world ? "it may stand at another place as well that looks alike"
                               : ReasonSentence(image.reason, image.detail));
}

struct FoundPoints {
  std::shared_ptr<HeldPoints> points;
  uint64_t snapshot = 0;
};

}  // namespace

kj::Promise<void> GateServer::login(LoginContext context) {
  Caller caller(session_, ShortText(context.getParams().getToken(), "token"));
  caller.LogIn();
  context.getResults().setCity(kj::heap<CityServer>(caller));
  context.getResults().setVersion(rpc::VERSION);
  return kj::READY_NOW;
}

CityServer::CityServer(Caller caller)
    : caller_(std::move(caller)),
      thing_(TakeOne(caller_.session().things, "uploads and other things are held by you")) {}

kj::Promise<void> CityServer::status(StatusContext context) {
  context.allowCancellation();
  const Sight sight = caller_.Check("GET", {"v1", "status"}).sight;
  return caller_.Ask<StatusAnswer>([sight](Engine* engine) { return engine->Ask(sight).Status(); })
      .then([context](const StatusAnswer& status) mutable {
        Write(status, context.getResults().initStatus());
      });
}

kj::Promise<void> CityServer::addPhoto(AddPhotoContext context) {
  const auto params = context.getParams();
  PhotoTitle title{ShortText(params.getName(), "name"), ShortText(params.getCamera(), "camera"),
                   ShortText(params.getContributor(), "contributor"), params.getContribution()};
  const HttpRequest sender = caller_.Check("POST", {"v1", "photos"}, title.contributor);
  std::string contributor = sender.who.empty() ? "anonymous" : sender.who;
  if (title.contribution != 0) {
    const auto of_all = ValueOrThrow(caller_.service().Ask({}).Contribution(title.contribution));
    if (sender.may_name_others) contributor = of_all.contributor;
  }
  if (title.contributor.empty()) title.contributor = contributor;
  if (title.name.empty()) kj::throwFatalException(Failure(400, "the photo has no name"));
  Status named = CheckPhotoName(title.name);
  if (named.ok()) named = CheckName("the name of a contributor", title.contributor);
  // The owner may have files of any name.
  if (!named.ok() && !caller_.session().is_of_owner) kj::throwFatalException(FailureOf(named));
  context.getResults().setUpload(kj::heap<UploadServer>(caller_, std::move(title)));
  return kj::READY_NOW;
}

kj::Promise<void> CityServer::findUpload(FindUploadContext context) {
  const uint64_t number = context.getParams().getNumber();
  const HttpRequest request = caller_.Check("GET", {"v1", "uploads", std::to_string(number)});
  const HttpAnswer found = caller_.service().AnswerOnUpload(number, request.sight);
  if (found.code != 200) kj::throwFatalException(FailureOf(found));
  context.getResults().setTicket(kj::heap<TicketServer>(caller_, number));
  return kj::READY_NOW;
}

kj::Promise<void> CityServer::pose(PoseContext context) {
  const std::string photo = ShortText(context.getParams().getPhoto(), "photo");
  const Sight sight = caller_.Check("GET", {"v1", "photos", photo, "pose"}).sight;
  const auto tell = [](const ImageAnswer& image, PoseContext* asked) {
    if (!image.may_stand_in.empty() || !image.cam_from_world)
      kj::throwFatalException(Failure(404, WhyNoPose(image)));
    auto results = asked->getResults();
    Write(*image.cam_from_world, image.reconstruction, results.initPose());
    if (image.on_earth) Write(*image.on_earth, results.initOnEarth());
    results.setSnapshot(image.snapshot);
  };
  const Questions ask = caller_.service().Ask(sight);
  if (ask.TellsImagesAtOnce()) {
    tell(ValueOrThrow(ask.Image(photo)), &context);
    return kj::READY_NOW;
  }
  return caller_
      .Ask<ImageAnswer>([sight, photo](Engine* engine) { return engine->Ask(sight).Image(photo); })
      .then([context, tell](const ImageAnswer& image) mutable { tell(image, &context); });
}

kj::Promise<void> CityServer::neighbors(NeighborsContext context) {
  const std::string photo = ShortText(context.getParams().getPhoto(), "photo");
  const Sight sight = caller_.Check("GET", {"v1", "photos", photo, "neighbors"}).sight;
  const Questions ask = caller_.service().Ask(sight);
  const auto neighbors = ValueOrThrow(ask.Neighbors(photo));
  auto results = context.getResults();
  Write(neighbors, results.initNeighbors(static_cast<unsigned>(neighbors.size())));
  results.setSnapshot(ask.snapshot());
  return kj::READY_NOW;
}

kj::Promise<void> CityServer::examine(ExamineContext context) {
  std::string name = ShortText(context.getParams().getName(), "name");
  caller_.Check("POST", {"v1", "localize"});
  if (name.empty()) name = "the photo";
  context.getResults().setExamination(kj::heap<ExaminationServer>(caller_, std::move(name)));
  return kj::READY_NOW;
}

kj::Promise<void> CityServer::reconstructions(ReconstructionsContext context) {
  context.allowCancellation();
  const Sight sight = caller_.Check("GET", {"v1", "reconstructions"}).sight;
  using Answer = std::pair<std::vector<ReconstructionAnswer>, uint64_t>;
  return caller_
      .Ask<Answer>([sight](Engine* engine) -> Result<Answer> {
        const Questions ask = engine->Ask(sight);
        VEDUTA_ASSIGN_OR_RETURN(auto list, ask.Reconstructions());
        return Answer{std::move(list), ask.snapshot()};
      })
      .then([context](const Answer& answer) mutable {
        Write(answer.first,
              context.getResults().initReconstructions(static_cast<unsigned>(answer.first.size())));
        context.getResults().setSnapshot(answer.second);
      });
}

kj::Promise<void> CityServer::points(PointsContext context) {
  context.allowCancellation();
  const uint32_t number = context.getParams().getReconstruction();
  const Sight sight =
      caller_.Check("GET", {"v1", "reconstructions", std::to_string(number), "points"}).sight;
  if (number == 0) kj::throwFatalException(Failure(404, "there is no reconstruction 0"));
  const auto share = caller_.NewShare();
  return caller_
      .Ask<FoundPoints>(
          [number, share, sight](Engine* engine) -> Result<FoundPoints> {
            const Questions ask = engine->Ask(sight);
            const ReconstructionId id(number);
            // Room is asked for before the memory is taken.
            VEDUTA_ASSIGN_OR_RETURN(const ReconstructionAnswer known, ask.Reconstruction(id));
            if (!share->Grow(known.points * (sizeof(std::array<float, 3>) + 3)))
              return Status::Busy(
                  "the points that are being read fill the memory, or yours half of it: finish "
                  "with some");
            VEDUTA_ASSIGN_OR_RETURN(auto cloud, ask.Points(id));
            return FoundPoints{std::make_shared<HeldPoints>(HeldPoints{std::move(cloud), share}),
                               ask.snapshot()};
          },
          WorkKind::kLong)
      .then([this, context](FoundPoints found) mutable {
        auto results = context.getResults();
        results.setCount(found.points->cloud.positions.size());
        results.setGeometryVersion(found.points->cloud.geometry_version);
        results.setSnapshot(found.snapshot);
        results.setPoints(kj::heap<PointReaderServer>(caller_, std::move(found.points)));
      });
}

kj::Promise<void> CityServer::journal(JournalContext context) {
  context.allowCancellation();
  const Sight sight = caller_.Check("GET", {"v1", "journal"}).sight;
  const uint64_t first = context.getParams().getFrom();
  const uint32_t count = context.getParams().getCount();
  if (count > kEntriesMax)
    kj::throwFatalException(Failure(400, "at most 256 entries are told at once"));
  return caller_
      .Ask<JournalPage>([first, count, sight](Engine* engine) {
        return ReadJournal(*engine, sight, first, count == 0 ? kEntriesMax : count);
      })
      .then([context](const JournalPage& read) mutable {
        auto results = context.getResults();
        Write(read.entries, results.initEntries(static_cast<unsigned>(read.entries.size())));
        results.setSnapshot(read.snapshot);
      });
}

kj::Promise<void> CityServer::follow(FollowContext context) {
  context.allowCancellation();
  const auto params = context.getParams();
  auto follower = kj::heap<JournalFollower>(caller_, params.getWatcher());
  auto telling = follower->Tell(params.getFrom());
  return telling.attach(kj::mv(follower));
}

}  // namespace veduta
