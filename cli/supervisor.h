// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a daemon tells the program that has started it, as systemd's sd_notify(3) does.

#include <string>

namespace veduta {

// Sends a state such as "READY=1" to the socket that the variable NOTIFY_SOCKET names. Does nothing
// where there is none: nobody wants to know. Thread-safe.
void NotifySupervisor(const std::string& state);

}  // namespace veduta
