// SPDX-License-Identifier: Apache-2.0
// The matcher's kernels for AVX2.
//
// Bytes are widened to 16 bits and multiplied by vpmaddwd, which is exact (vpmaddubsw saturates: it
// is not). A 32-bit lane is a column; its four bytes become two steps, bytes 0 and 2, then bytes 1
// and 3, by a mask and a shift. Distances leave the registers as sort keys only (matcher_keys.h):
// nothing of the size rows x columns is stored.
#include "engine/matching/matcher_keys.h"

#if defined(__AVX2__)
#include <immintrin.h>

namespace veduta {
namespace {

constexpr int kTileRows = 4;  // x 2 vectors of 8 columns = 8 accumulators of 16 registers
constexpr int kLanes = 8;
constexpr int kSteps = kPanelGroups * 2;

// A panel with its bytes widened: two of each descriptor's 16-bit numbers a step.
struct alignas(64) WidePanel {
  int32_t steps[kSteps][kPanelColumns];
};

struct alignas(64) RowPanel {
  WidePanel wide;
  int32_t column_keys[kPanelColumns];  // what the rows add to columns' keys: norm << 8 | row within
                                       // the block
};

// The two smallest keys of each row of a panel, by lane.
struct alignas(32) RowState {
  __m256i best[kPanelColumns];
  __m256i second[kPanelColumns];
};

inline __m256i LoadLanes(const int32_t* lanes) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(lanes));
}
inline void StoreLanes(int32_t* lanes, __m256i value) {
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(lanes), value);
}

void Widen(const DescriptorPanel& panel, WidePanel* out) {
  const __m256i even = _mm256_set1_epi16(0xFF);
  for (int group = 0; group < kPanelGroups; ++group) {
    for (int first = 0; first < kPanelColumns; first += kLanes) {
      const __m256i bytes =
          _mm256_load_si256(reinterpret_cast<const __m256i*>(panel.bytes[group][first]));
      StoreLanes(out->steps[group * 2] + first, _mm256_and_si256(bytes, even));
      StoreLanes(out->steps[group * 2 + 1] + first, _mm256_srli_epi16(bytes, 8));
    }
  }
}

// Empty rows change nothing: a column's key is |a|^2 - 2 a.b, theirs kPaddingNorm, above any real
// one.
void PrepareRows(const DescriptorPanel& panel, uint32_t first_in_block, RowPanel* out) {
  Widen(panel, &out->wide);
  for (uint32_t r = 0; r < kPanelColumns; ++r) {
    out->column_keys[r] =
        panel.norms_squared[r] * (1 << kKeyBits) + static_cast<int32_t>(first_in_block + r);
  }
}

// The rows of a tile, as a pack: g++ 12 keeps an array in registers only when its indices are
// constants before it unrolls loops.
template <int... kRows>
struct TileRows {};
using AllTileRows = TileRows<0, 1, 2, 3>;
static_assert(kTileRows == 4);

// Takes eight finished columns into the rows' and the columns' keys.
template <int... kRows>
inline void TakeKeys(TileRows<kRows...>, const __m256i* products, const int32_t* norms,
                     uint32_t name, const int32_t* row_keys, __m256i* best, __m256i* second,
                     int32_t* column_keys, int32_t* column_seconds) {
  const __m256i row_key = _mm256_or_si256(_mm256_slli_epi32(LoadLanes(norms), kKeyBits),
                                          _mm256_set1_epi32(static_cast<int>(name)));
  __m256i column_best = LoadLanes(column_keys);
  __m256i column_second = LoadLanes(column_seconds);
  const auto take = [&](int r) __attribute__((always_inline)) {
    const __m256i doubled = _mm256_slli_epi32(products[r], kKeyBits + 1);
    const __m256i column_key = _mm256_sub_epi32(_mm256_set1_epi32(row_keys[r]), doubled);
    column_second = _mm256_min_epi32(column_second, _mm256_max_epi32(column_best, column_key));
    column_best = _mm256_min_epi32(column_best, column_key);
    const __m256i key = _mm256_sub_epi32(row_key, doubled);
    second[r] = _mm256_min_epi32(second[r], _mm256_max_epi32(best[r], key));
    best[r] = _mm256_min_epi32(best[r], key);
  };
  (take(kRows), ...);
  StoreLanes(column_keys, column_best);
  StoreLanes(column_seconds, column_second);
}

// Four rows by a panel of columns.
template <int... kRows>
inline void MultiplyTile(TileRows<kRows...> tile_rows, const int32_t* rows, const int32_t* row_keys,
                         const WidePanel& columns, const int32_t* norms, uint32_t name,
                         __m256i* best, __m256i* second, int32_t* column_keys,
                         int32_t* column_seconds) {
  __m256i left[kTileRows] = {((void)kRows, _mm256_setzero_si256())...};
  __m256i right[kTileRows] = {((void)kRows, _mm256_setzero_si256())...};
#pragma GCC unroll 4
  for (int step = 0; step < kSteps; ++step) {
    const __m256i left_pairs = LoadLanes(columns.steps[step]);
    const __m256i right_pairs = LoadLanes(columns.steps[step] + kLanes);
    const int32_t* row_pairs = rows + step * kPanelColumns;
    const auto multiply = [&](__m256i & left_sum, __m256i & right_sum, int r)
        __attribute__((always_inline)) {
      const __m256i factor = _mm256_set1_epi32(row_pairs[r]);
      left_sum = _mm256_add_epi32(left_sum, _mm256_madd_epi16(left_pairs, factor));
      right_sum = _mm256_add_epi32(right_sum, _mm256_madd_epi16(right_pairs, factor));
    };
    (multiply(left[kRows], right[kRows], kRows), ...);
  }
  TakeKeys(tile_rows, left, norms, name, row_keys, best, second, column_keys, column_seconds);
  TakeKeys(tile_rows, right, norms + kLanes, name + 1, row_keys, best, second, column_keys + kLanes,
           column_seconds + kLanes);
}

// Joins a row's lanes over one block of columns with what the row had before.
void MergeRow(__m256i best, __m256i second, int32_t norm, uint32_t first_column, NearestPair* row) {
  alignas(32) int32_t keys[kLanes];
  alignas(32) int32_t seconds[kLanes];
  _mm256_store_si256(reinterpret_cast<__m256i*>(keys), best);
  _mm256_store_si256(reinterpret_cast<__m256i*>(seconds), second);
  int lane = 0;
  for (int i = 1; i < kLanes; ++i) lane = keys[i] < keys[lane] ? i : lane;
  const int32_t key = keys[lane];
  if (key >= kPaddingKey) return;
  int32_t second_key = seconds[lane];
  for (int i = 0; i < kLanes; ++i) {
    if (i != lane && keys[i] < second_key) second_key = keys[i];
  }
  const uint32_t name = static_cast<uint32_t>(key & (kGroupsPerBlock - 1));
  MergeNearest(
      first_column + name * kLanes + static_cast<uint32_t>(lane),
      static_cast<uint32_t>((key >> kKeyBits) + norm),
      second_key >= kPaddingKey ? kNoMatch : static_cast<uint32_t>((second_key >> kKeyBits) + norm),
      row);
}

// Up to sixteen rows against all columns.
void SweepColumns(const RowPanel& rows, const int32_t* norms, uint32_t row_count, PanelSpan columns,
                  int32_t* column_keys, NearestPair* rows_out) {
  constexpr uint32_t kColumnsPerBlock = kGroupsPerBlock * kLanes;
  RowState state;
  WidePanel wide;
  for (uint32_t first = 0; first < columns.count; first += kColumnsPerBlock) {
    const uint32_t count =
        columns.count - first < kColumnsPerBlock ? columns.count - first : kColumnsPerBlock;
    for (int r = 0; r < kPanelColumns; ++r)
      state.best[r] = state.second[r] = _mm256_set1_epi32(INT32_MAX);
    for (uint32_t c = 0; c < count; c += kPanelColumns) {
      const DescriptorPanel& panel = columns.panels[(first + c) / kPanelColumns];
      Widen(panel, &wide);
      for (uint32_t r = 0; r < row_count; r += kTileRows) {
        MultiplyTile(AllTileRows(), rows.wide.steps[0] + r, rows.column_keys + r, wide,
                     panel.norms_squared, c / kLanes, state.best + r, state.second + r,
                     column_keys + first + c, column_keys + PaddedCount(columns) + first + c);
      }
    }
    for (uint32_t r = 0; r < row_count; ++r)
      MergeRow(state.best[r], state.second[r], norms[r], first, &rows_out[r]);
  }
}

void NearestBothWays(PanelSpan rows, PanelSpan columns, NearestPair* rows_out,
                     NearestPair* columns_out, int32_t* column_keys) {
  ClearNearest(rows, columns, rows_out, columns_out);
  RowPanel prepared;
  for (uint32_t block = 0; block < rows.count; block += kRowsPerBlock) {
    ClearKeys(columns, column_keys);
    const uint32_t block_end =
        rows.count - block < kRowsPerBlock ? rows.count : block + kRowsPerBlock;
    for (uint32_t row = block; row < block_end; row += kPanelColumns) {
      const DescriptorPanel& panel = rows.panels[row / kPanelColumns];
      PrepareRows(panel, row - block, &prepared);
      const uint32_t row_count = block_end - row < kPanelColumns ? block_end - row : kPanelColumns;
      SweepColumns(prepared, panel.norms_squared, row_count, columns, column_keys, rows_out + row);
    }
    MergeColumns(columns, block, column_keys, -1, columns_out);
  }
}

void Distances(const uint8_t* query, const uint8_t* descriptors, const uint32_t* indices,
               size_t count, uint32_t* distances) {
  const __m256i zero = _mm256_setzero_si256();
  __m256i query_bytes[4];
  for (int k = 0; k < 4; ++k)
    query_bytes[k] = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(query) + k);
  for (size_t i = 0; i < count; ++i) {
    const __m256i* candidate =
        reinterpret_cast<const __m256i*>(descriptors + static_cast<size_t>(indices[i]) * 128);
    __m256i sum = zero;
    for (int k = 0; k < 4; ++k) {
      const __m256i bytes = _mm256_loadu_si256(candidate + k);
      const __m256i difference = _mm256_sub_epi8(_mm256_max_epu8(query_bytes[k], bytes),
                                                 _mm256_min_epu8(query_bytes[k], bytes));
      const __m256i low = _mm256_unpacklo_epi8(difference, zero);
      const __m256i high = _mm256_unpackhi_epi8(difference, zero);
      sum = _mm256_add_epi32(
          sum, _mm256_add_epi32(_mm256_madd_epi16(low, low), _mm256_madd_epi16(high, high)));
    }
    __m128i half = _mm_add_epi32(_mm256_castsi256_si128(sum), _mm256_extracti128_si256(sum, 1));
    half = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0x4E));
    half = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0xB1));
    distances[i] = static_cast<uint32_t>(_mm_cvtsi128_si32(half));
  }
}

constexpr MatcherKernels kKernels = {&NearestBothWays, &Distances};

}  // namespace

const MatcherKernels* const kMatcherKernelsAvx2 = &kKernels;

}  // namespace veduta
#else
namespace veduta {
const MatcherKernels* const kMatcherKernelsAvx2 = nullptr;
}
#endif
