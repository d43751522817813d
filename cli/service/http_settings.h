// SPDX-License-Identifier: Apache-2.0
#pragma once
// How kj serves HTTP: how long clients may take, and what is said of those that break the protocol.

#include <kj/compat/http.h>

#include <cstdint>

namespace veduta {

// `body_bytes_max`: so much of a body that was refused is read. `callbacks` must outlive the
// server.
kj::HttpServerSettings HttpSettings(uint64_t body_bytes_max, kj::HttpServerCallbacks* callbacks);

}  // namespace veduta
