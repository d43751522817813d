// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/ticket_server.h"

#include <utility>

#include "cli/rpc/answer_messages.h"
#include "cli/service/told_upload.h"

namespace veduta {

TicketServer::TicketServer(Caller caller, uint64_t number)
    : caller_(std::move(caller)),
      number_(number),
      thing_(TakeOne(caller_.session().things, "uploads and other things are held by you")) {}

kj::Promise<void> TicketServer::verdict(VerdictContext context) {
  context.allowCancellation();
  const Sight sight = caller_.Check("GET", {"v1", "uploads", std::to_string(number_)}).sight;
  auto call = TakeOne(caller_.session().verdicts, "verdicts are waited for");
  const auto told = std::make_shared<UploadNews>();
  auto paf = kj::newPromiseAndCrossThreadFulfiller<bool>();
  const Sender<bool> sender(kj::mv(paf.fulfiller));
  const auto unknown = caller_.service().intake()->Await(
      number_,
      [sender, told](const UploadNews& news) {
        *told = news;
        sender(true);
      },
      std::weak_ptr<const void>(call));
  if (unknown) kj::throwFatalException(FailureOf(*unknown));
  return paf.promise.then([this, context, call, told, sight](bool) mutable {
    const Questions ask = caller_.service().Ask(sight);
    const UploadNews news = ValueOrThrow(ToldOf(ask, *told));
    if (!news.ended) {
      kj::throwFatalException(Failure(503, "the photo is on the disk as upload " +
                                               std::to_string(number_) +
                                               " and waits for its turn, which cannot come now" +
                                               (news.why_not.empty() ? "" : ": " + news.why_not)));
    }
    const AddOutcome outcome = ValueOrThrow(*news.ended);
    if (!outcome.failure.ok()) kj::throwFatalException(FailureOf(outcome.failure));
    Write(outcome, context.getResults().initOutcome());
    context.getResults().setSnapshot(ask.snapshot());
  });
}

}  // namespace veduta
