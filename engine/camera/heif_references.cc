// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/heif_references.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

namespace veduta {
namespace {

using Bytes = std::span<const uint8_t>;

constexpr int kStepsMax = 8;        // phones' files take one or two
constexpr size_t kVersionSize = 4;  // and flags, in front of what `meta` and `iref` hold

uint64_t BigEndian(Bytes bytes) {
  uint64_t value = 0;
  for (const uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

struct Box {
  std::string_view type;
  Bytes content;
  Bytes behind;
};

// The first box. One that claims more than there is, is cut; none where its size makes no sense.
std::optional<Box> FirstBox(Bytes bytes) {
  if (bytes.size() < 8) return std::nullopt;
  const std::string_view type(reinterpret_cast<const char*>(bytes.data()) + 4, 4);
  uint64_t size = BigEndian(bytes.first(4));
  size_t header_size = 8;
  if (size == 1 && bytes.size() >= 16) {
    size = BigEndian(bytes.subspan(8, 8));
    header_size = 16;
  }
  if (size == 0) size = bytes.size();
  size = std::min<uint64_t>(size, bytes.size());
  if (size < header_size) return std::nullopt;
  return Box{type, bytes.subspan(header_size, size - header_size), bytes.subspan(size)};
}

// What is needed by what, as items.
class References final {
 public:
  // False where the size of a reference is not that of its items: some readers go on behind the
  // one, some behind the other.
  bool Add(Bytes iref) {
    if (iref.size() < kVersionSize) return true;
    const size_t id_size = iref[0] == 0 ? 2 : 4;
    for (Bytes left = iref.subspan(kVersionSize); !left.empty();) {
      const std::optional<Box> box = FirstBox(left);
      if (!box || box->content.size() < id_size + 2) return false;
      const auto from = static_cast<uint32_t>(BigEndian(box->content.first(id_size)));
      const uint64_t count = BigEndian(box->content.subspan(id_size, 2));
      const Bytes ids = box->content.subspan(id_size + 2);
      if (ids.size() != count * id_size) return false;
      for (uint64_t i = 0; i < count; ++i) {
        const auto to = static_cast<uint32_t>(BigEndian(ids.subspan(i * id_size, id_size)));
        if (box->type == "dimg") AddNeed(from, to);
        if (box->type == "auxl") AddNeed(to, from);
      }
      left = box->behind;
    }
    return true;
  }

  // Takes away what nothing needs any more, step by step (Kahn 1962); a circle stays.
  bool EndsSoon() {
    std::vector<uint32_t> now;
    for (const auto& [item, needed] : needed_by_) {
      if (needed == 0) now.push_back(item);
    }
    size_t left = needed_by_.size();
    for (int step = 0; !now.empty(); ++step) {
      if (step > kStepsMax) return false;
      std::vector<uint32_t> next;
      for (const uint32_t item : now) {
        --left;
        for (const uint32_t other : needs_[item]) {
          if (--needed_by_[other] == 0) next.push_back(other);
        }
      }
      now = std::move(next);
    }
    return left == 0;
  }

 private:
  void AddNeed(uint32_t item, uint32_t other) {
    needs_[item].push_back(other);
    needed_by_.try_emplace(item, 0);
    ++needed_by_[other];
  }

  std::map<uint32_t, std::vector<uint32_t>> needs_;
  std::map<uint32_t, size_t> needed_by_;
};

}  // namespace

bool HasEndlessReferences(Bytes bytes) {
  References references;
  for (std::optional<Box> top = FirstBox(bytes); top; top = FirstBox(top->behind)) {
    if (top->type != "meta" || top->content.size() < kVersionSize) continue;
    for (std::optional<Box> box = FirstBox(top->content.subspan(kVersionSize)); box;
         box = FirstBox(box->behind)) {
      if (box->type == "iref" && !references.Add(box->content)) return true;
    }
  }
  return !references.EndsSoon();
}

}  // namespace veduta
