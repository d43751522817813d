// SPDX-License-Identifier: Apache-2.0
#pragma once
// Verdicts and reasons in words.

#include "storage/model/verdict.h"

namespace veduta {

const char* VerdictText(Verdict verdict);  // one word, as the command line prints it
const char* ReasonText(Reason reason);  // a clause, without numbers: the record's detail has those

}  // namespace veduta
