// SPDX-License-Identifier: Apache-2.0
#pragma once
// How an answer comes back to the thread that a connection is on.

#include <kj/async.h>

#include <memory>
#include <utility>

namespace veduta {

// Completes a promise of the thread that it was made on from any other. Copies complete the same
// promise, once.
template <typename T>
class Sender final {
 public:
  explicit Sender(kj::Own<kj::CrossThreadPromiseFulfiller<T>> fulfiller)
      : fulfiller_(
            std::make_shared<kj::Own<kj::CrossThreadPromiseFulfiller<T>>>(kj::mv(fulfiller))) {}
  void operator()(T value) const { (*fulfiller_)->fulfill(std::move(value)); }

 private:
  std::shared_ptr<kj::Own<kj::CrossThreadPromiseFulfiller<T>>> fulfiller_;
};

}  // namespace veduta
