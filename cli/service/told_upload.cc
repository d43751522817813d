// SPDX-License-Identifier: Apache-2.0
#include "cli/service/told_upload.h"

#include <utility>

namespace veduta {

Result<UploadNews> ToldOf(const Questions& ask, UploadNews news) {
  bool sees = true;
  if (!news.ended) {
    VEDUTA_ASSIGN_OR_RETURN(sees, ask.SeesUpload(news.number));
  } else if (news.ended->ok() && (*news.ended)->id.valid() && !(*news.ended)->duplicate) {
    VEDUTA_ASSIGN_OR_RETURN(sees, ask.Sees((*news.ended)->id));
  }
  if (!sees) return Status::NotFound("nothing is known of upload " + std::to_string(news.number));
  if (news.ended && news.ended->ok()) {
    VEDUTA_ASSIGN_OR_RETURN(AddOutcome told, ask.Told(**std::move(news.ended)));
    news.ended = std::move(told);
  }
  return news;
}

}  // namespace veduta
