// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/view_graph_parts.h"

#include <algorithm>
#include <array>
#include <optional>
#include <queue>
#include <utility>

namespace veduta {
namespace {

// The graph by indices into the ascending images.
class ViewGraph {
 public:
  ViewGraph(std::span<const ImageId> images, std::span<const ViewGraphEdge> edges)
      : ties_(images.size()) {
    const auto find = [&](ImageId id) {
      const auto found = std::ranges::lower_bound(images, id);
      return found != images.end() && *found == id ? std::optional(found - images.begin())
                                                   : std::nullopt;
    };
    for (const ViewGraphEdge& edge : edges) {
      const auto a = find(edge.a), b = find(edge.b);
      if (!a || !b || a == b) continue;
      ties_[static_cast<size_t>(*a)].push_back({static_cast<size_t>(*b), edge.weight});
      ties_[static_cast<size_t>(*b)].push_back({static_cast<size_t>(*a), edge.weight});
    }
  }

  // Two halves of the nodes (ascending), neither of them empty; two nodes or more are given.
  std::array<std::vector<size_t>, 2> Halve(const std::vector<size_t>& nodes) {
    side_.assign(ties_.size(), kOutside);
    for (const size_t node : nodes) side_[node] = kOpen;
    const size_t first = FindFarthest(nodes, nodes.front());
    Grow(nodes, {first, FindFarthest(nodes, first)});
    std::array<std::vector<size_t>, 2> halves;
    for (const size_t node : nodes) halves[static_cast<size_t>(side_[node])].push_back(node);
    return halves;
  }

 private:
  static constexpr int kOutside = -2, kOpen = -1;  // otherwise 0 or 1
  struct Tie {
    size_t node;
    uint32_t weight;
  };

  // The node that most edges lie between it and `from`; of several the first. A node that none lead
  // to is farther than all others.
  size_t FindFarthest(const std::vector<size_t>& nodes, size_t from) const {
    std::vector<size_t> steps(ties_.size(), ties_.size());
    std::queue<size_t> open;
    steps[from] = 0;
    for (open.push(from); !open.empty(); open.pop()) {
      for (const Tie& tie : ties_[open.front()]) {
        if (side_[tie.node] == kOutside || steps[tie.node] < ties_.size()) continue;
        steps[tie.node] = steps[open.front()] + 1;
        open.push(tie.node);
      }
    }
    size_t farthest = from == nodes.front() ? nodes.back() : nodes.front();
    for (const size_t node : nodes) {
      if (node != from && steps[node] > steps[farthest]) farthest = node;
    }
    return farthest;
  }

  // The smaller side takes the node that most weight ties to it; where none is tied to it, the
  // other side does; where none is tied to either, the smaller one takes the first that is left.
  void Grow(const std::vector<size_t>& nodes, std::array<size_t, 2> seeds) {
    std::array<std::vector<uint64_t>, 2> tied;
    for (auto& weights : tied) weights.assign(ties_.size(), 0);
    // The heaviest first; of two as heavy the first node.
    using Candidate = std::pair<uint64_t, size_t>;
    const auto is_later = [](const Candidate& a, const Candidate& b) {
      return a.first != b.first ? a.first < b.first : a.second > b.second;
    };
    std::array<std::priority_queue<Candidate, std::vector<Candidate>, decltype(is_later)>, 2>
        candidates{
            std::priority_queue<Candidate, std::vector<Candidate>, decltype(is_later)>(is_later),
            std::priority_queue<Candidate, std::vector<Candidate>, decltype(is_later)>(is_later)};
    std::array<size_t, 2> sizes{};
    const auto take = [&](size_t side, size_t node) {
      side_[node] = static_cast<int>(side);
      ++sizes[side];
      for (const Tie& tie : ties_[node]) {
        if (side_[tie.node] != kOpen) continue;
        tied[side][tie.node] += tie.weight;
        candidates[side].push({tied[side][tie.node], tie.node});
      }
    };
    for (const size_t side : {size_t{0}, size_t{1}}) take(side, seeds[side]);
    size_t next = 0;
    while (sizes[0] + sizes[1] < nodes.size()) {
      for (auto& some : candidates) {
        while (!some.empty() && side_[some.top().second] != kOpen) some.pop();
      }
      size_t side = sizes[1] < sizes[0] ? 1 : 0;
      if (candidates[side].empty() && !candidates[1 - side].empty()) side = 1 - side;
      if (!candidates[side].empty()) {
        take(side, candidates[side].top().second);
        continue;
      }
      while (side_[nodes[next]] != kOpen) ++next;
      take(side, nodes[next]);
    }
  }

  std::vector<std::vector<Tie>> ties_;
  std::vector<int> side_;
};

}  // namespace

std::vector<std::vector<ImageId>> PartViewGraph(std::span<const ImageId> images,
                                                std::span<const ViewGraphEdge> edges,
                                                size_t images_max) {
  ViewGraph graph(images, edges);
  std::vector<std::vector<size_t>> open(1);
  for (size_t i = 0; i < images.size(); ++i) open.front().push_back(i);
  std::vector<std::vector<ImageId>> parts;
  while (!open.empty()) {
    const std::vector<size_t> nodes = std::move(open.back());
    open.pop_back();
    if (nodes.size() > images_max) {
      for (std::vector<size_t>& half : graph.Halve(nodes)) open.push_back(std::move(half));
      continue;
    }
    std::vector<ImageId>& part = parts.emplace_back();
    for (const size_t node : nodes) part.push_back(images[node]);
  }
  std::erase_if(parts, [](const std::vector<ImageId>& part) { return part.empty(); });
  std::ranges::sort(parts, {}, [](const std::vector<ImageId>& part) { return part.front(); });
  return parts;
}

}  // namespace veduta
