// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/caller.h"

namespace veduta {

std::shared_ptr<BudgetShare> TakeOne(const std::shared_ptr<Budget>& budget, const char* what) {
  auto share = std::make_shared<BudgetShare>(budget);
  if (!share->Grow(1)) kj::throwFatalException(Failure(429, std::string("too many ") + what));
  return share;
}

void Caller::LogIn() {
  token_number_ = Check("GET", {"v1", "status"}).token_number;
  DividedShare& place = session_->place;
  if (!session_->is_of_owner && place.taken() == 0) {
    place.Name(HolderOf(Asking()));
    if (!place.Grow(1)) {
      kj::throwFatalException(
          Failure(429, "half of the connections are yours: come again when one of them has ended"));
    }
  }
  session_->has_logged_in = true;
}

HttpRequest Caller::Asking() const {
  HttpRequest request;
  request.is_of_owner = session_->is_of_owner;
  request.token_number = token_number_;
  return request;
}

std::shared_ptr<DividedShare> Caller::NewShare() const {
  return std::make_shared<DividedShare>(session_->shared.bytes, HolderOf(Asking()));
}

HttpRequest Caller::Check(const char* method, std::vector<std::string> path,
                          const std::string& contributor) const {
  HttpRequest request;
  request.method = method;
  request.path = std::move(path);
  request.token = token_;
  request.is_of_owner = session_->is_of_owner;
  if (!contributor.empty()) request.query["contributor"] = contributor;
  const auto refusal = service().Refuse(&request);
  service().NoteCall(request, refusal ? refusal->code : 200);
  if (refusal) {
    if (refusal->code == 401 && token_.empty())
      kj::throwFatalException(Failure(401, "log in with a token"));
    kj::throwFatalException(FailureOf(*refusal));
  }
  return request;
}

}  // namespace veduta
