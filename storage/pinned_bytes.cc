// SPDX-License-Identifier: Apache-2.0
#include "storage/pinned_bytes.h"

namespace veduta {

PinnedBytes::PinnedBytes() = default;
PinnedBytes::~PinnedBytes() = default;
PinnedBytes::PinnedBytes(PinnedBytes&&) noexcept = default;
PinnedBytes& PinnedBytes::operator=(PinnedBytes&&) noexcept = default;
PinnedBytes::PinnedBytes(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

std::span<const uint8_t> PinnedBytes::bytes() const {
  if (!impl_) return {};
  return {reinterpret_cast<const uint8_t*>(impl_->value.data()), impl_->value.size()};
}

}  // namespace veduta
