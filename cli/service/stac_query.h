// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a search of the STAC API asks for, by the query of an address or by a JSON object.

#include "cli/service/http_message.h"
#include "cli/wire/json.h"
#include "engine/door/photo_search.h"

namespace veduta {

// Items in one answer. Chosen by hand; more may be asked for, and so many are told.
inline constexpr uint32_t kStacItemsDefault = 10, kStacItemsMax = 1000;

// The members of a search as JSON has them: from the parameters of the query, or the body itself.
// kInvalidArgument.
Result<Json> StacMembers(const HttpRequest& request);

// `limit`, `bbox`, `intersects`, `datetime`, `ids`, `collections` and `token`, each of which may be
// left out. kInvalidArgument names the member that is wrong, or is not known.
Result<PhotoSearch> ParseStacQuery(const Json& members);

// What leads to the next page, as a link of an answer: `href` is the address of this one, without
// its query.
Json NextStacLink(const HttpRequest& request, const Json& members, const std::string& href,
                  ImageId after);

}  // namespace veduta
