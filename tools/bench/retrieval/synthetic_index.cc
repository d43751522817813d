// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/retrieval/synthetic_index.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "index/scoring.h"
#include "storage/base/content_hash.h"
#include "storage/base/median.h"
#include "storage/database.h"
#include "tools/bench/retrieval/memory_peak.h"

namespace veduta::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr uint32_t kGeneration = 1;
constexpr uint32_t kBestCount = 51;  // 50 candidates, and the query itself
constexpr double kShareMax = 0.9;    // of the images that have one word

double MillisecondsSince(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// Of this thread: what a query costs where nobody else wants the core.
double ProcessorMilliseconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

// The share of images that have each word. They are log-normal: the mean over words gives the words
// of an image, words * E[p], and the variance gives the words that two images share by chance,
// words * E[p^2].
std::vector<double> WordShares(const SyntheticCity& city) {
  const double mean = city.words_of_image / city.word_count;
  const double square = city.shared_with_other / city.word_count;
  const double variance = std::log(std::max(1.0, square / (mean * mean)));
  const double middle = std::log(mean) - variance / 2;
  SeededRandom random(city.seed);
  std::vector<double> shares(city.word_count);
  for (double& share : shares) {
    const double radius = std::sqrt(-2 * std::log(1 - random.Unit()));  // Box and Muller
    const double normal = radius * std::cos(2 * std::numbers::pi * random.Unit());
    share = std::min(kShareMax, std::exp(middle + std::sqrt(variance) * normal));
  }
  return shares;
}

struct Query {
  uint32_t image = 0;
  std::vector<WordId> words;
  std::set<uint32_t> neighbors;
};

class City {
 public:
  explicit City(const SyntheticCity& city)
      : city_(city), shares_(WordShares(city)), random_(MixSeed(city.seed, 1)) {
    std::set<uint32_t> taken;
    const auto draw = [&] {
      for (;;) {
        const uint32_t id = 1 + random_.Below(city_.image_count);
        if (taken.insert(id).second) return id;
      }
    };
    for (uint32_t q = 0; q < city_.query_count; ++q) {
      Query query;
      query.image = draw();
      while (query.neighbors.size() < city_.neighbor_count) query.neighbors.insert(draw());
      for (WordId word = 0; word < city_.word_count; ++word) {
        if (random_.Unit() < shares_[word]) query.words.push_back(word);
      }
      for (const WordId word : query.words) {
        seen_[word].insert(query.image);
        for (const uint32_t neighbor : query.neighbors) {
          if (random_.Unit() < city_.shared_with_neighbor / city_.words_of_image)
            seen_[word].insert(neighbor);
        }
      }
      query_images_.insert(query.image);
      queries_.push_back(std::move(query));
    }
  }

  const std::vector<Query>& queries() const { return queries_; }

  // Writes the lists of all words, or of those that queries have.
  Status Write(bool all, Database* database) {
    std::vector<ImageId> images;
    for (WordId word = 0; word < city_.word_count; ++word) {
      const auto seen = seen_.find(word);
      if (!all && seen == seen_.end()) continue;
      DrawImages(word, &images);
      if (seen != seen_.end()) {
        for (const uint32_t id : seen->second) images.emplace_back(id);
        std::sort(images.begin(), images.end());
        images.erase(std::unique(images.begin(), images.end()), images.end());
      }
      if (images.empty()) continue;
      VEDUTA_RETURN_IF_ERROR(database->WritePostingsAhead(kGeneration, word, images));
    }
    return database->Compact();
  }

 private:
  // Each image has the word with the word's probability: the gaps between those that have it are
  // geometric. The queries' own words are given.
  void DrawImages(WordId word, std::vector<ImageId>* images) {
    images->clear();
    const double per_gap = 1 / std::log1p(-shares_[word]);
    for (double id = 0;;) {
      id += 1 + std::floor(std::log(1 - random_.Unit()) * per_gap);
      if (!(id <= city_.image_count)) return;
      const auto value = static_cast<uint32_t>(id);
      if (!query_images_.contains(value)) images->emplace_back(value);
    }
  }

  const SyntheticCity& city_;
  const std::vector<double> shares_;
  SeededRandom random_;
  std::vector<Query> queries_;
  std::set<uint32_t> query_images_;
  std::map<WordId, std::set<uint32_t>> seen_;  // the images that the queries are about
};

double FolderMb(const std::string& folder) {
  double bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".sst") bytes += static_cast<double>(entry.file_size());
  }
  return bytes / 1e6;
}

Result<bool> Ask(const Snapshot& snapshot, const Query& query, uint32_t image_count,
                 std::vector<double>* lookup_ms, std::vector<double>* rank_ms, double* postings) {
  auto start = Clock::now();
  VEDUTA_ASSIGN_OR_RETURN(const auto lists, snapshot.GetPostings(kGeneration, query.words));
  lookup_ms->push_back(MillisecondsSince(start));
  for (const auto& list : lists) *postings += static_cast<double>(list.size());
  start = Clock::now();
  VEDUTA_ASSIGN_OR_RETURN(const auto ranked, Rank(lists, image_count, {.count_max = kBestCount}));
  rank_ms->push_back(MillisecondsSince(start));
  for (const RankedImage& image : ranked) {
    if (image.image.value != query.image) return query.neighbors.contains(image.image.value);
  }
  return false;
}

}  // namespace

Result<QueryCost> MeasureQueries(const SyntheticCity& synthetic, const std::string& folder,
                                 double lists_max) {
  QueryCost cost;
  cost.all_lists = synthetic.words_of_image * synthetic.image_count <= lists_max;
  const auto start = Clock::now();
  City city(synthetic);
  {
    VEDUTA_ASSIGN_OR_RETURN(const auto database, Database::Open(folder, {.create = true}));
    VEDUTA_RETURN_IF_ERROR(city.Write(cost.all_lists, database.get()));
  }
  cost.build_s = MillisecondsSince(start) / 1e3;
  cost.index_mb = FolderMb(folder);
  ResetMemoryPeak();
  DatabaseOptions options;
  options.read_only = true;  // opened for writing, it would delete what no commit has named
  options.block_cache_bytes = synthetic.cache_bytes;
  VEDUTA_ASSIGN_OR_RETURN(const auto database, Database::Open(folder, options));
  const std::shared_ptr<const Snapshot> snapshot = database->GetSnapshot();
  std::vector<double> lookup_ms, rank_ms, query_ms, processor_ms;
  double right = 0;
  for (const Query& query : city.queries()) {
    const double processor_before = ProcessorMilliseconds();
    VEDUTA_ASSIGN_OR_RETURN(const bool is_right, Ask(*snapshot, query, synthetic.image_count,
                                                     &lookup_ms, &rank_ms, &cost.postings_read));
    right += is_right ? 1 : 0;
    query_ms.push_back(lookup_ms.back() + rank_ms.back());
    processor_ms.push_back(ProcessorMilliseconds() - processor_before);
  }
  cost.peak_mb = MemoryPeakMb();
  cost.query_ms_first = query_ms.front();
  query_ms.erase(query_ms.begin());
  cost.lookup_ms_median = MedianOf(lookup_ms);
  cost.rank_ms_median = MedianOf(rank_ms);
  cost.processor_ms_median = MedianOf(processor_ms);
  cost.query_ms_median = MedianOf(query_ms);
  cost.query_ms_worst = query_ms.empty() ? 0 : *std::max_element(query_ms.begin(), query_ms.end());
  cost.first_right = right / static_cast<double>(city.queries().size());
  cost.postings_read /= static_cast<double>(city.queries().size());
  return cost;
}

}  // namespace veduta::bench
