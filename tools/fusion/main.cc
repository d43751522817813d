// SPDX-License-Identifier: Apache-2.0
// veduta-fusion-benchmark: fuses depth maps of a rendered street and prints how far the surface is
// from the true one. Exit codes: 0 done; 1 it could not be done; 2 bad usage.

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "kernels/device.h"
#include "tools/fusion/fused_street.h"
#include "tools/fusion/rendered_maps.h"
#include "tools/fusion/true_surface.h"

namespace veduta::fusion_benchmark {
namespace {

struct Arguments {
  MapOptions maps;
  VolumeGrid grid;
  SolverOptions solver;
  ExtractionOptions extraction;
  uint32_t pixels_min = 8, threads = 2;
  double distance_max_m = 20;
  std::string device = "cpp", ply;
  bool truth = false, stereo = false, memory = false, energies = false, borders = false,
       starts = false, update = false;
};

double Seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double PeakMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = static_cast<size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

void WritePly(const SurfacePiece& piece, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << piece.positions.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty "
          "float ny\n"
       << "property float nz\nelement face " << piece.triangles.size()
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (size_t i = 0; i < piece.positions.size(); ++i) {
    file.write(reinterpret_cast<const char*>(piece.positions[i].data()), 12);
    file.write(reinterpret_cast<const char*>(piece.normals[i].data()), 12);
  }
  for (const auto& triangle : piece.triangles) {
    file.put(3);
    file.write(reinterpret_cast<const char*>(triangle.data()), 12);
  }
}

// The part of the truth that two maps saw.
std::vector<TrueSurface::Sample> VisibleSamples(const std::vector<RenderedMap>& maps,
                                                const TrueSurface& truth, double spacing,
                                                double distance_max) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
  for (const RenderedMap& map : maps) {
    const Eigen::Vector3d center = map.geometry.cam_from_world.Center();
    low = low.cwiseMin(center - Eigen::Vector3d::Constant(distance_max));
    high = high.cwiseMax(center + Eigen::Vector3d::Constant(distance_max));
  }
  std::vector<TrueSurface::Sample> visible;
  for (const TrueSurface::Sample& sample : truth.SamplesWithin(spacing, low, high)) {
    int views = 0;
    for (const RenderedMap& map : maps) views += Sees(map, sample, distance_max) ? 1 : 0;
    if (views >= 2) visible.push_back(sample);
  }
  return visible;
}

void PrintQuality(const char* name, const SurfacePiece& surface, const TrueSurface& truth,
                  const std::vector<TrueSurface::Sample>& visible, double voxel) {
  std::vector<double> distances;
  double sum = 0;
  size_t far = 0;
  for (const Eigen::Vector3f& position : surface.positions) {
    distances.push_back(truth.DistanceTo(position.cast<double>()));
    sum += std::min(distances.back(), 2 * voxel);
    far += distances.back() > 2 * voxel ? 1 : 0;
  }
  const PointGrid grid(surface.positions, 2 * voxel);
  size_t covered = 0;
  for (const TrueSurface::Sample& sample : visible)
    covered += grid.HasNear(sample.point, 2 * voxel) ? 1 : 0;
  const double accuracy = Quantile(distances, 0.9),
               count = static_cast<double>(std::max<size_t>(1, distances.size()));
  std::printf(
      "%-10s %8zu triangles; accuracy at 90 %%: %.3f voxels (%.4f m); median %.3f voxels; mean cut "
      "at 2: %.3f; over 2 "
      "voxels: %.2f %%; completeness %.2f %% of %zu samples\n",
      name, surface.triangles.size(), accuracy / voxel, accuracy, Quantile(distances, 0.5) / voxel,
      sum / count / voxel, 100.0 * static_cast<double>(far) / count,
      100.0 * static_cast<double>(covered) /
          static_cast<double>(std::max<size_t>(1, visible.size())),
      visible.size());
}

void PrintSolve(const char* name, const SolveReport& report) {
  std::printf(
      "%-10s %zu tiles, %.1f blocks each with halo; %.0f iterations each; %.3f s each; %.1f M "
      "voxels/s; energy %.0f -> "
      "%.0f, at least %.0f (gap %.2f %%)\n",
      name, report.tiles,
      static_cast<double>(report.blocks_solved) / static_cast<double>(report.tiles),
      static_cast<double>(report.iterations) / static_cast<double>(report.tiles),
      report.seconds / static_cast<double>(report.tiles),
      static_cast<double>(report.voxel_iterations) / report.seconds * 1e-6, report.energy_start,
      report.energy_end, report.lower_bound,
      100 * (report.energy_end - report.lower_bound) / report.energy_end);
}

bool IsAtBorder(const VertexKey& key) {
  for (const int32_t at : {key.x, key.y, key.z}) {
    const int32_t in_tile = at - FloorDivide(at, kTileSide) * kTileSide;
    if (in_tile == 0 || in_tile == kTileSide - 1) return true;
  }
  return false;
}

// Where two solutions put the surface, edge by edge that both cross; in voxels.
std::vector<double> Differences(const SurfacePiece& a, const SurfacePiece& b, double voxel,
                                bool borders, size_t* unmatched) {
  std::vector<double> differences;
  size_t i = 0, j = 0;
  *unmatched = 0;
  while (i < a.keys.size() && j < b.keys.size()) {
    if (borders && !IsAtBorder(a.keys[i])) {
      ++i;
    } else if (borders && !IsAtBorder(b.keys[j])) {
      ++j;
    } else if (a.keys[i] == b.keys[j]) {
      differences.push_back((a.positions[i++] - b.positions[j++]).norm() / voxel);
    } else {
      ++*unmatched;
      ++(a.keys[i] < b.keys[j] ? i : j);
    }
  }
  *unmatched += a.keys.size() - i + b.keys.size() - j;
  return differences;
}

void PrintDifferences(const char* name, const SurfacePiece& a, const SurfacePiece& b, double voxel,
                      bool borders) {
  size_t unmatched = 0;
  const std::vector<double> d = Differences(a, b, voxel, borders, &unmatched);
  size_t over = 0;
  for (const double x : d) over += x > 0.02 ? 1 : 0;
  std::printf(
      "%-24s %zu vertices on the same edge, %zu on one side only; apart by (voxels): median %.5f, "
      "99 %% %.4f, 99.9 %% "
      "%.4f, most %.3f; over 0.02: %.3f %%\n",
      name, d.size(), unmatched, Quantile(d, .5), Quantile(d, .99), Quantile(d, .999),
      Quantile(d, 1),
      100.0 * static_cast<double>(over) / static_cast<double>(std::max<size_t>(1, d.size())));
}

// The tiles' surface beside that of all tiles as one problem, both solved to the end.
void CompareBorders(const Arguments& a, FusedStreet* fused) {
  SolverOptions longer = a.solver;
  longer.gap_max = 0;
  longer.iterations_max = 4 * a.solver.iterations_max;
  PrintSolve("whole", fused->SolveWhole("whole", longer.iterations_max, longer.lambda));
  PrintSolve("tiles", fused->Solve("tiles", "", longer, nullptr));
  fused->Extract("whole", a.extraction);
  fused->Extract("tiles", a.extraction);
  const SurfacePiece whole = fused->Weld("whole"), tiles = fused->Weld("tiles");
  PrintDifferences("4 x, round 1", tiles, whole, a.grid.voxel_size, false);
  PrintDifferences("  at borders", tiles, whole, a.grid.voxel_size, true);
  for (const auto& [from, to] : {std::pair{"tiles", "round2"}, std::pair{"round2", "round3"}}) {
    PrintSolve(to, fused->Solve(to, from, longer, nullptr, from));
    fused->Extract(to, a.extraction);
    PrintDifferences(to, fused->Weld(to), whole, a.grid.voxel_size, false);
    PrintDifferences("  at borders", fused->Weld(to), whole, a.grid.voxel_size, true);
  }
  PrintDifferences("as stopped", fused->Weld("tv"), whole, a.grid.voxel_size, false);
  PrintDifferences("  at borders", fused->Weld("tv"), whole, a.grid.voxel_size, true);
  PrintSolve("2nd round", fused->Solve("tv2", "tv", a.solver, nullptr, "tv"));
  fused->Extract("tv2", a.extraction);
  PrintDifferences("2nd round as stopped", fused->Weld("tv2"), whole, a.grid.voxel_size, false);
  PrintDifferences("  at borders", fused->Weld("tv2"), whole, a.grid.voxel_size, true);
}

void CompareStarts(const Arguments& a, FusedStreet* fused) {
  SolverOptions longer = a.solver;
  longer.gap_max = 0;
  const SurfacePiece tv = fused->Weld("tv");
  for (const uint64_t seed : {0, 1}) {
    fused->Scatter("start", seed);
    PrintSolve(seed == 0 ? "from zero" : "random",
               fused->Solve("scattered", "start", longer, nullptr));
    fused->Extract("scattered", a.extraction);
    PrintDifferences(seed == 0 ? "zero beside means" : "random beside means",
                     fused->Weld("scattered"), tv, a.grid.voxel_size, false);
  }
}

// What one map more costs: the tiles that it touches, from their last solution and anew.
void CompareUpdate(const Arguments& a, const RangeImage& last, FusedStreet* fused) {
  fused->Add(last, -1);
  fused->Solve("before", "", a.solver, nullptr);
  const std::vector<GridPlace> changed = fused->Add(last);
  std::set<GridPlace> dirty;
  for (const GridPlace& block : changed) {
    for (const GridPlace& tile : TilesThatReach(block)) {
      if (fused->tiles().count(tile)) dirty.insert(tile);
    }
  }
  std::printf("the last map touches %zu of %zu blocks, %zu of %zu tiles\n", changed.size(),
              fused->blocks().size(), dirty.size(), fused->tiles().size());
  PrintSolve("warm", fused->SolveTiles(dirty, "before", "before", a.solver, nullptr));
  PrintSolve("cold", fused->SolveTiles(dirty, "anew", "", a.solver, nullptr));
  fused->Extract("before", a.extraction);
  PrintDifferences("warm beside cold", fused->Weld("before"), fused->Weld("tv"), a.grid.voxel_size,
                   false);
}

void PrintEnergies(const Arguments& a, FusedStreet* fused) {
  SolverOptions longer = a.solver;
  longer.gap_max = 0;
  longer.iterations_max = 10 * a.solver.iterations_max;
  GridPlace fullest;
  size_t most = 0;
  for (const GridPlace& tile : fused->tiles()) {
    const size_t blocks = fused->Load(tile, "").blocks.size();
    if (blocks > most) fullest = tile;
    most = std::max(most, blocks);
  }
  const std::vector<EnergyReport> energies = fused->EnergiesOf(fullest, longer, nullptr);
  const double end = energies.back().energy;
  for (size_t i = 0; i < energies.size(); ++i) {
    if (energies[i].iteration > a.solver.iterations_max && i % 10 != 0) continue;
    std::printf("iteration %5u: energy %.1f (%+.3f %% of the end), at least %.1f\n",
                energies[i].iteration, energies[i].energy, 100 * (energies[i].energy / end - 1),
                energies[i].lower_bound);
  }
}

Status Run(const Arguments& a) {
  VEDUTA_RETURN_IF_ERROR(a.grid.Check());
  VEDUTA_RETURN_IF_ERROR(a.solver.Check());
  ThreadPool pool(a.threads - 1);
  std::unique_ptr<Device> device;
  if (!WantsNoDevice(a.device)) {
    VEDUTA_ASSIGN_OR_RETURN(device, Device::Open({.wanted = a.device, .thread_count = a.threads}));
  }
  VEDUTA_ASSIGN_OR_RETURN(const RenderedStreet street, RenderedStreet::Make(a.maps));
  FusedStreet fused(a.grid, a.pixels_min, pool);
  std::vector<RenderedMap> maps;
  const auto image_of = [&](const RenderedMap& map) {
    return RangeImage::Make(a.truth ? map.truth : map.noisy, map.geometry).value();
  };
  double seconds = Seconds();
  if (a.stereo) {
    VEDUTA_ASSIGN_OR_RETURN(maps, street.Match(device.get(), pool));
    std::printf("matched: %.1f s\n", Seconds() - seconds);
    for (const RenderedMap& map : maps) fused.Name(image_of(map));
  }
  for (size_t i = 0; i < street.count() && !a.stereo; ++i) {
    VEDUTA_ASSIGN_OR_RETURN(RenderedMap map, street.Render(i));
    fused.Name(image_of(map));
    if (!a.memory) maps.push_back(std::move(map));
  }
  std::printf("%zu maps named %zu blocks in %zu tiles: %.2f s\n", street.count(),
              fused.blocks().size(), fused.tiles().size(), Seconds() - seconds);
  seconds = Seconds();
  for (size_t i = 0; i < street.count(); ++i) {
    if (maps.empty()) {
      fused.Add(image_of(street.Render(i).value()));
    } else {
      fused.Add(image_of(maps[i]));
    }
  }
  std::printf("integrated: %.2f s, %.1f MB of histograms written in all\n", Seconds() - seconds,
              static_cast<double>(fused.histogram_bytes()) * 1e-6);
  PrintSolve("TV-L1", fused.Solve("tv", "", a.solver, device.get()));
  seconds = Seconds();
  const size_t triangles = fused.Extract("tv", a.extraction);
  std::printf("extracted: %zu triangles, %.3f s\npeak memory %.1f MB\n", triangles,
              Seconds() - seconds, PeakMegabytes());
  if (a.memory) return Status::Ok();
  if (a.energies) PrintEnergies(a, &fused);
  if (a.borders) CompareBorders(a, &fused);
  if (a.starts) CompareStarts(a, &fused);
  if (a.update) CompareUpdate(a, image_of(maps.back()), &fused);
  fused.Average("average");
  fused.Extract("average", a.extraction);
  const SurfacePiece tv = fused.Weld("tv"), average = fused.Weld("average");
  if (!a.ply.empty()) {
    WritePly(tv, a.ply + "_tv.ply");
    WritePly(average, a.ply + "_average.ply");
  }
  const TrueSurface truth(street.scene().mesh(), 0.5);
  const auto visible = VisibleSamples(maps, truth, a.grid.voxel_size, a.distance_max_m);
  PrintQuality("TV-L1", tv, truth, visible, a.grid.voxel_size);
  PrintQuality("average", average, truth, visible, a.grid.voxel_size);
  return Status::Ok();
}

void AddCommandLine(CLI::App& app, Arguments& a) {
  app.add_option("--photos", a.maps.photos, "key views (16)")->check(CLI::Range(2, 10000));
  app.add_option("--length", a.maps.length_m, "metres of street (what suits the photos)");
  app.add_option("--noise", a.maps.disparity_noise_px,
                 "of disparity, px at a baseline of 1 m (0.25)");
  app.add_option("--outliers", a.maps.outlier_share, "share of wrong pixels (0.05)")
      ->check(CLI::Range(0.0, 0.9));
  app.add_option("--missing", a.maps.missing_share, "share of pixels without depth (0.1)")
      ->check(CLI::Range(0.0, 0.9));
  app.add_option("--depth-max", a.maps.depth_max_m, "metres; farther depths are not known (25)");
  app.add_option("--seed", a.maps.seed, "of the street and of the noise (1)");
  app.add_flag("--truth", a.truth, "fuse the true depth");
  app.add_flag("--stereo", a.stereo, "fuse what the plane sweep makes of the rendered photos");
  app.add_option("--voxel", a.grid.voxel_size, "metres (0.05)");
  app.add_option("--truncation", a.grid.truncation_voxels, "voxels (4)");
  app.add_option("--pixels", a.pixels_min, "pixels that make a block (8)");
  app.add_option("--lambda", a.solver.lambda, "weight of the data (1)");
  app.add_option("--iterations", a.solver.iterations_max, "at most (400)");
  app.add_option("--check-every", a.solver.check_every, "iterations (20)");
  app.add_option("--gap", a.solver.gap_max,
                 "stops when the energy is this near to the minimum (1e-3)");
  app.add_option("--near-maps", a.extraction.near_maps_min,
                 "maps on either side of the surface (2)");
  app.add_option("--piece", a.extraction.piece_extent_cells_min, "smaller pieces go, cells (15)");
  app.add_option("--distance", a.distance_max_m,
                 "of true surface that counts, metres from the camera (20)");
  app.add_option("--device", a.device, "cpp, or as veduta devices has them (cpp)");
  app.add_option("--threads", a.threads, "(2)")->check(CLI::Range(1, 256));
  app.add_option("--ply", a.ply, "writes NAME_tv.ply and NAME_average.ply");
  app.add_flag("--energies", a.energies, "prints how the energy of the fullest tile falls");
  app.add_flag("--borders", a.borders, "compares tiles with all of them as one problem");
  app.add_flag("--starts", a.starts,
               "compares the means of the histograms as a start with zeros and with noise");
  app.add_flag("--update", a.update,
               "withdraws the last map, solves, adds it again: what that costs");
  app.add_flag("--memory", a.memory,
               "one map at a time and no comparison with the truth: for the peak of memory");
}

}  // namespace
}  // namespace veduta::fusion_benchmark

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  CLI::App app("Volumetric fusion of a rendered street, beside the truth");
  veduta::fusion_benchmark::Arguments arguments;
  veduta::fusion_benchmark::AddCommandLine(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const veduta::Status status = veduta::fusion_benchmark::Run(arguments);
  if (status.ok()) return 0;
  std::fprintf(stderr, "veduta-fusion-benchmark: %s\n", status.message().c_str());
  return 1;
}
