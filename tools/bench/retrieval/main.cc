// SPDX-License-Identifier: Apache-2.0
// veduta-bench-retrieval: what vocabularies find and cost.
//   veduta-bench-retrieval recall --photos FOLDER[@SIZE@PARAMS[@TRUTH]]... --shape 10,7,2000000...
//   veduta-bench-retrieval scale FOLDER --images 10000,100000,1000000

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "tools/bench/retrieval/photo_sets.h"
#include "tools/bench/retrieval/recall.h"
#include "tools/bench/retrieval/synthetic_index.h"

namespace veduta::bench {
namespace {

struct RecallArguments {
  std::vector<std::string> photos, training, shapes = {"10,7,2000000"};
  uint32_t near_count = 20, threads = 2;
};

struct ScaleArguments {
  std::string folder;
  std::vector<uint32_t> images = {10'000, 100'000, 1'000'000};
  SyntheticCity city;
  double lists_max = 4e8;
  bool keep = false;
};

void Print(const char* what, const std::vector<double>& shares) {
  std::printf("%s", what);
  for (size_t k = 0; k < std::size(kRanks); ++k) std::printf(" %u: %.4f", kRanks[k], shares[k]);
}

void Print(const Shape& shape, const std::vector<PhotoSet>& sets, const TrainedShape& measured) {
  const Recall& recall = measured.recall;
  std::printf(
      "branch %u, levels %u, sample %u: %u words of %llu descriptors in %.1f s, peak %.0f MB, "
      "distortion %.0f\n",
      shape.branch, shape.levels, shape.sample, measured.info.leaf_count,
      static_cast<unsigned long long>(measured.info.training_size), measured.train_s,
      measured.peak_mb, measured.distortion_mean);
  for (size_t i = 0; i < sets.size(); ++i) {
    if (recall.sets[i].query_count == 0) continue;
    std::printf("  %s, %u queries\n", sets[i].folder.c_str(), recall.sets[i].query_count);
    Print("    first k right:  ", recall.sets[i].first_k_right);
    Print("\n    neighbors found:", recall.sets[i].neighbors_found);
    std::printf("\n");
  }
  std::printf(
      "  medians: quantize %.2f ms, rank %.2f ms; %.0f words per photo, of which %.1f are shared "
      "with a neighbor, %.2f with another\n",
      recall.quantize_ms_median, recall.query_ms_median, recall.words_mean,
      recall.shared_with_neighbor, recall.shared_with_other);
  std::fflush(stdout);
}

void Print(const SyntheticCity& city, const QueryCost& cost) {
  std::printf(
      "%u images, %u words: query %.1f ms (first %.1f, worst %.1f; %.1f of a core), of which "
      "lookup %.1f and rank "
      "%.1f; first right %.3f; %.0f ids read; peak %.0f MB; %s on disk %.0f MB, built in %.0f s\n",
      city.image_count, city.word_count, cost.query_ms_median, cost.query_ms_first,
      cost.query_ms_worst, cost.processor_ms_median, cost.lookup_ms_median, cost.rank_ms_median,
      cost.first_right, cost.postings_read, cost.peak_mb,
      cost.all_lists ? "all lists" : "the lists asked for", cost.index_mb, cost.build_s);
  std::fflush(stdout);
}

Result<std::vector<PhotoSet>> ParsePhotoSets(const std::vector<std::string>& texts) {
  std::vector<PhotoSet> sets;
  for (const std::string& text : texts) {
    VEDUTA_ASSIGN_OR_RETURN(PhotoSet set, ParsePhotoSet(text));
    sets.push_back(std::move(set));
  }
  return sets;
}

void PrintCounts(const char* what, const Photos& photos) {
  double descriptors = 0, neighbors = 0;
  for (const Features& features : photos.features)
    descriptors += static_cast<double>(features.size());
  for (const auto& of_photo : photos.neighbors) neighbors += static_cast<double>(of_photo.size());
  std::printf("%s: %zu photos, %.0f descriptors, %.1f neighbors per photo\n", what,
              photos.features.size(), descriptors,
              neighbors / static_cast<double>(photos.features.size()));
}

Status RunRecall(const RecallArguments& arguments) {
  ThreadPool pool(arguments.threads - 1);
  std::vector<Shape> shapes;
  for (const std::string& text : arguments.shapes) {
    VEDUTA_ASSIGN_OR_RETURN(const Shape shape, ParseShape(text));
    shapes.push_back(shape);
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PhotoSet> sets, ParsePhotoSets(arguments.photos));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<PhotoSet> training_sets, ParsePhotoSets(arguments.training));
  for (PhotoSet& set : training_sets) set.camera.reset();  // nobody asks for their neighbours
  VEDUTA_ASSIGN_OR_RETURN(const Photos photos, LoadPhotos(sets, arguments.near_count, &pool));
  PrintCounts("asked", photos);
  Photos others;
  if (!training_sets.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(others, LoadPhotos(training_sets, 0, &pool));
    PrintCounts("trained from", others);
  }
  const Photos& training = training_sets.empty() ? photos : others;
  for (const Shape& shape : shapes) {
    VEDUTA_ASSIGN_OR_RETURN(const TrainedShape measured,
                            MeasureShape(training, photos, shape, &pool));
    Print(shape, sets, measured);
  }
  return Status::Ok();
}

Status RunScale(const ScaleArguments& arguments) {
  for (const uint32_t images : arguments.images) {
    SyntheticCity city = arguments.city;
    city.image_count = images;
    const std::string folder = arguments.folder + "." + std::to_string(images);
    VEDUTA_ASSIGN_OR_RETURN(const QueryCost cost,
                            MeasureQueries(city, folder, arguments.lists_max));
    Print(city, cost);
    if (!arguments.keep) std::filesystem::remove_all(folder);
  }
  return Status::Ok();
}

void AddRecall(CLI::App& app, RecallArguments* a) {
  CLI::App* recall = app.add_subcommand("recall", "Trains on photos, and asks by each of them");
  recall->add_option("--photos", a->photos, "FOLDER, or FOLDER@WIDTHxHEIGHT@PARAMS[@TRUTH]")
      ->required();
  recall->add_option("--shape", a->shapes,
                     "BRANCH,LEVELS,SAMPLE[,DESCRIPTORS_PER_LEAF[,ATTEMPTS]]");
  recall->add_option("--near", a->near_count, "Photos that each of a set with truth may show too")
      ->capture_default_str();
  recall->add_option("--train", a->training,
                     "Trains from these photos alone, and not from those that are asked for");
  recall->add_option("--threads", a->threads, "Threads")->check(CLI::Range(1, 1024));
}

void AddScale(CLI::App& app, ScaleArguments* a) {
  CLI::App* scale = app.add_subcommand("scale", "Asks an index of synthetic words");
  scale->add_option("FOLDER", a->folder, "Databases are made beside it, as FOLDER.10000")
      ->required();
  scale->add_option("--images", a->images, "Sizes of the city")->delimiter(',');
  scale->add_option("--words", a->city.word_count, "Words of the vocabulary")
      ->capture_default_str();
  scale->add_option("--words-of-photo", a->city.words_of_image, "Mean")->capture_default_str();
  scale
      ->add_option("--shared", a->city.shared_with_other, "Words that unrelated photos share, mean")
      ->capture_default_str();
  scale->add_option("--shared-with-neighbor", a->city.shared_with_neighbor, "Mean")
      ->capture_default_str();
  scale->add_option("--queries", a->city.query_count, "How many")->check(CLI::Range(2, 10'000));
  scale->add_option("--cache-bytes", a->city.cache_bytes, "Of blocks that were read")
      ->capture_default_str();
  scale->add_option("--lists-max", a->lists_max, "Ids up to which all lists are written")
      ->capture_default_str();
  scale->add_flag("--keep", a->keep, "Keep the databases");
}

}  // namespace
}  // namespace veduta::bench

int main(int argc, char** argv) {
  CLI::App app("What vocabularies find and cost");
  app.require_subcommand(1);
  veduta::bench::RecallArguments recall;
  veduta::bench::ScaleArguments scale;
  veduta::bench::AddRecall(app, &recall);
  veduta::bench::AddScale(app, &scale);
  CLI11_PARSE(app, argc, argv);
  const veduta::Status status = app.got_subcommand("recall") ? RunRecall(recall) : RunScale(scale);
  if (!status.ok()) std::fprintf(stderr, "veduta-bench-retrieval: %s\n", status.message().c_str());
  return status.ok() ? 0 : 1;
}
