// SPDX-License-Identifier: Apache-2.0
#include "storage/records/border_record.h"

#include <cmath>
#include <utility>

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

Status CheckViews(const std::vector<BorderView>& views) {
  for (size_t i = 0; i < views.size(); ++i) {
    const BorderView& view = views[i];
    VEDUTA_RETURN_IF_ERROR(CheckId("image of a view", view.image));
    VEDUTA_RETURN_IF_ERROR(CheckFinite({{"x_px", view.x_px}, {"y_px", view.y_px}}));
    const uint32_t last = i == 0 ? 0 : views[i - 1].tie;
    const bool is_next = i > 0 && view.tie == last + 1;
    const bool is_same = view.tie == last && (i == 0 || views[i - 1].image < view.image);
    if (!is_next && !is_same)
      return Broken("list of views", "out of order", "ascending ties from 0, then images");
  }
  return Status::Ok();
}

Status CheckEvidence(const std::vector<BorderEvidence>& evidence) {
  for (const BorderEvidence& row : evidence) {
    VEDUTA_RETURN_IF_ERROR(CheckId("first image of evidence", row.a));
    VEDUTA_RETURN_IF_ERROR(CheckId("second image of evidence", row.b));
    if (row.a == row.b)
      return Broken("second image of evidence", row.b.value, "another than the first");
  }
  const auto is_before = [](const BorderEvidence& x, const BorderEvidence& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  };
  if (StrictlyAscending(std::span<const BorderEvidence>(evidence), is_before)) return Status::Ok();
  return Broken("list of evidence", "out of order", "ascending, each pair once");
}

Status CheckFragments(const std::vector<BorderFragment>& fragments) {
  for (const BorderFragment& row : fragments) {
    VEDUTA_RETURN_IF_ERROR(CheckId("head of a fragment", row.head));
    if (row.image < row.head)
      return Broken("head of a fragment", row.head.value, "at most the image it stands for");
  }
  const auto is_before = [](const BorderFragment& x, const BorderFragment& y) {
    return x.image < y.image;
  };
  if (StrictlyAscending(std::span<const BorderFragment>(fragments), is_before)) return Status::Ok();
  return Broken("list of fragments", "out of order", "ascending images, each once");
}

}  // namespace

std::string BorderKey(SubmapId id) {
  return std::string(kBorderPrefix) + Key32(id.value);
}

Status ParseBorderKey(std::string_view key, SubmapBorder* border) {
  if (!key.starts_with(kBorderPrefix)) return Status::Corruption("no such key is known");
  key.remove_prefix(kBorderPrefix.size());
  if (!TakeBigEndian32(&key, &border->id.value) || !key.empty())
    return Status::Corruption("a key of wrong length");
  return Damaged(CheckId("submap", border->id));
}

Status Check(const SubmapBorder& border) {
  VEDUTA_RETURN_IF_ERROR(CheckId("submap", border.id));
  VEDUTA_RETURN_IF_ERROR(CheckViews(border.views));
  VEDUTA_RETURN_IF_ERROR(CheckEvidence(border.evidence));
  return CheckFragments(border.fragments);
}

Result<std::string> Encode(const SubmapBorder& border) {
  VEDUTA_RETURN_IF_ERROR(Check(border));
  const size_t payload = border.views.size() * sizeof(BorderView) +
                         border.evidence.size() * sizeof(BorderEvidence) +
                         border.fragments.size() * sizeof(BorderFragment);
  return WriteMessage<schema::SubmapBorder>(payload, [&](auto to) {
    to.setViews(AsData(border.views));
    to.setEvidence(AsData(border.evidence));
    to.setFragments(AsData(border.fragments));
  });
}

Status Decode(std::string_view value, SubmapBorder* border) {
  return ReadMessage<schema::SubmapBorder>(value, [&](schema::SubmapBorder::Reader from) {
    if (!CopyRows(from.getViews(), &border->views)) return BadRows("views");
    if (!CopyRows(from.getEvidence(), &border->evidence)) return BadRows("evidence");
    if (!CopyRows(from.getFragments(), &border->fragments)) return BadRows("fragments");
    return Damaged(Check(*border));
  });
}

}  // namespace veduta
