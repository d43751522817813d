// SPDX-License-Identifier: Apache-2.0
// The matcher's kernels for AVX-512 VNNI.
//
// vpdpbusd adds four products of an unsigned with a signed byte to a 32-bit lane. The columns'
// bytes b stay unsigned; the rows' bytes a become 127 - a, which fits a signed byte, so that a lane
// that starts with |b|^2 / 2 - 127 sum(b) ends with |b|^2 / 2 - a.b: half the distance but for the
// row's own norm (and the parity of |b|^2, which is added when the lane is doubled). Exact: all of
// it stays within 24 bits.
//
// Distances leave the registers as sort keys only (matcher_keys.h): nothing of the size rows x
// columns is stored.
#include "engine/matching/matcher_keys.h"

#if defined(__AVX512VNNI__) && defined(__AVX512BW__)
#include <immintrin.h>

namespace veduta {
namespace {

constexpr int kTileRows = 8;  // x 2 panels = 16 accumulators

// Sixteen rows ready for multiplication with columns: 127 - a, and the parts of their columns'
// keys.
struct alignas(64) RowPanel {
  int32_t groups[kPanelGroups][kPanelColumns];  // four signed bytes each
  int32_t column_keys[kPanelColumns];           // norm << 8 | row within the block
};

// The two smallest keys of each of a tile's rows, by lane.
struct alignas(64) TileState {
  __m512i best[kTileRows];
  __m512i second[kTileRows];
};

// Rows past `count` repeat the last one under its own name: equal keys are passed over. (Rows of
// zeros would change something: the key of |a|^2 + |b|^2 may take 25 bits.)
void PrepareRows(const DescriptorPanel& panel, uint32_t first_in_block, uint32_t count,
                 RowPanel* out) {
  const __m512i last =
      _mm512_set1_epi32(static_cast<int>(count < kPanelColumns ? count - 1 : kPanelColumns - 1));
  const __m512i lane = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m512i source = _mm512_min_epi32(lane, last);
  const __m512i all_127 = _mm512_set1_epi8(127);
  for (int group = 0; group < kPanelGroups; ++group) {
    const __m512i bytes = _mm512_permutexvar_epi32(source, _mm512_load_si512(panel.bytes[group]));
    _mm512_store_si512(out->groups[group], _mm512_sub_epi8(all_127, bytes));
  }
  const __m512i norms = _mm512_permutexvar_epi32(source, _mm512_load_si512(panel.norms_squared));
  const __m512i names =
      _mm512_add_epi32(source, _mm512_set1_epi32(static_cast<int>(first_in_block)));
  _mm512_store_si512(out->column_keys, _mm512_or_si512(_mm512_slli_epi32(norms, kKeyBits), names));
}

inline __m512i StartOf(const DescriptorPanel& panel) {
  const __m512i half = _mm512_srli_epi32(_mm512_load_si512(panel.norms_squared), 1);
  const __m512i sums = _mm512_load_si512(panel.sums);
  return _mm512_sub_epi32(half, _mm512_sub_epi32(_mm512_slli_epi32(sums, 7), sums));
}

// What a doubled lane lacks to be a row's key: the parity of |b|^2 and the panel's name.
inline __m512i RowKeyOf(const DescriptorPanel& panel, uint32_t panel_in_block) {
  const __m512i parity =
      _mm512_and_si512(_mm512_load_si512(panel.norms_squared), _mm512_set1_epi32(1));
  return _mm512_or_si512(_mm512_slli_epi32(parity, kKeyBits),
                         _mm512_set1_epi32(static_cast<int>(panel_in_block)));
}

// The rows of a tile, as a pack: g++ 12 keeps an array in registers only when its indices are
// constants before it unrolls loops.
template <int... kRows>
struct TileRows {};
using AllTileRows = TileRows<0, 1, 2, 3, 4, 5, 6, 7>;
static_assert(kTileRows == 8);

// Takes a row's keys into the two smallest keys of each column. A key that is the smallest already
// is that of the same row.
inline void TakeColumnKeys(__m512i key, __m512i* best, __m512i* second) {
  const __mmask16 is_other = _mm512_cmpneq_epi32_mask(key, *best);
  *second = _mm512_mask_min_epi32(*second, is_other, *second, _mm512_max_epi32(key, *best));
  *best = _mm512_min_epi32(*best, key);
}

// Takes the finished lanes of one or two panels into the rows' and the columns' keys.
template <int kPanels, int... kRows>
inline void TakeKeys(TileRows<kRows...>, const __m512i* left, const __m512i* right,
                     const DescriptorPanel* panels, uint32_t panel_in_block,
                     const int32_t* row_keys, TileState* state, int32_t* column_keys,
                     int32_t* column_seconds) {
  const __m512i left_key = RowKeyOf(panels[0], panel_in_block);
  const __m512i right_key = RowKeyOf(panels[kPanels - 1], panel_in_block + 1);
  __m512i left_best = _mm512_loadu_si512(column_keys);
  __m512i right_best = _mm512_loadu_si512(column_keys + (kPanels - 1) * kPanelColumns);
  __m512i left_second = _mm512_loadu_si512(column_seconds);
  __m512i right_second = _mm512_loadu_si512(column_seconds + (kPanels - 1) * kPanelColumns);
  const auto take = [&](int r) __attribute__((always_inline)) {
    const __m512i name = _mm512_set1_epi32(row_keys[r]);
    __m512i doubled = _mm512_slli_epi32(left[r], kKeyBits + 1);
    TakeColumnKeys(_mm512_add_epi32(doubled, name), &left_best, &left_second);
    __m512i nearer = _mm512_add_epi32(doubled, left_key);
    __m512i second = state->second[r];
    if constexpr (kPanels == 2) {
      doubled = _mm512_slli_epi32(right[r], kKeyBits + 1);
      TakeColumnKeys(_mm512_add_epi32(doubled, name), &right_best, &right_second);
      const __m512i other = _mm512_add_epi32(doubled, right_key);
      second = _mm512_min_epi32(second, _mm512_max_epi32(nearer, other));
      nearer = _mm512_min_epi32(nearer, other);
    }
    const __m512i best = state->best[r];
    state->second[r] = _mm512_min_epi32(second, _mm512_max_epi32(best, nearer));
    state->best[r] = _mm512_min_epi32(best, nearer);
  };
  (take(kRows), ...);
  _mm512_storeu_si512(column_keys, left_best);
  _mm512_storeu_si512(column_seconds, left_second);
  if constexpr (kPanels == 2) {
    _mm512_storeu_si512(column_keys + kPanelColumns, right_best);
    _mm512_storeu_si512(column_seconds + kPanelColumns, right_second);
  }
}

// Without instructions: tells g++ 12 that an accumulator lives in one register. It copies each of
// them twice in every step otherwise, and spills some (8 % of the time of a match).
inline void KeepInRegister(__m512i& value) {
  asm("" : "+v"(value));
}

// Eight rows by one or two panels of columns.
template <int kPanels, int... kRows>
inline void MultiplyTile(TileRows<kRows...> tile_rows, const int32_t* rows, const int32_t* row_keys,
                         const DescriptorPanel* panels, uint32_t panel_in_block, TileState* state,
                         int32_t* column_keys, int32_t* column_seconds) {
  constexpr int kLast = kPanels - 1;
  __m512i left[kTileRows] = {((void)kRows, StartOf(panels[0]))...};
  __m512i right[kTileRows] = {((void)kRows, StartOf(panels[kLast]))...};
#pragma GCC unroll 1
  for (int group = 0; group < kPanelGroups; ++group) {
    const __m512i left_bytes = _mm512_load_si512(panels[0].bytes[group]);
    const __m512i right_bytes = _mm512_load_si512(panels[kLast].bytes[group]);
    const int32_t* row_bytes = rows + group * kPanelColumns;
    const auto multiply = [&](__m512i & left_sum, __m512i & right_sum, int r)
        __attribute__((always_inline)) {
      const __m512i factor = _mm512_set1_epi32(row_bytes[r]);
      left_sum = _mm512_dpbusd_epi32(left_sum, left_bytes, factor);
      KeepInRegister(left_sum);
      if constexpr (kPanels == 2) {
        right_sum = _mm512_dpbusd_epi32(right_sum, right_bytes, factor);
        KeepInRegister(right_sum);
      }
    };
    (multiply(left[kRows], right[kRows], kRows), ...);
  }
  TakeKeys<kPanels>(tile_rows, left, right, panels, panel_in_block, row_keys, state, column_keys,
                    column_seconds);
}

// Joins a row's lanes over one block of panels with what the row had before.
inline void MergeRow(__m512i best, __m512i second, int32_t norm, uint32_t first_panel,
                     NearestPair* row) {
  const int32_t key = _mm512_reduce_min_epi32(best);
  if (key >= kPaddingKey) return;
  const __mmask16 winners = _mm512_cmpeq_epi32_mask(best, _mm512_set1_epi32(key));
  const uint32_t lane = static_cast<uint32_t>(__builtin_ctz(winners));
  const __m512i others = _mm512_mask_mov_epi32(best, static_cast<__mmask16>(1u << lane), second);
  const int32_t second_key = _mm512_reduce_min_epi32(others);
  const uint32_t panel = first_panel + static_cast<uint32_t>(key & (kGroupsPerBlock - 1));
  MergeNearest(
      panel * kPanelColumns + lane, static_cast<uint32_t>((key >> kKeyBits) + norm),
      second_key >= kPaddingKey ? kNoMatch : static_cast<uint32_t>((second_key >> kKeyBits) + norm),
      row);
}

// One tile's rows against all columns.
void SweepColumns(const int32_t* rows, const int32_t* row_keys, const int32_t* norms,
                  uint32_t row_count, PanelSpan columns, int32_t* column_keys,
                  NearestPair* rows_out) {
  const uint32_t panel_count = (columns.count + kPanelColumns - 1) / kPanelColumns;
  int32_t* const column_seconds = column_keys + PaddedCount(columns);
  for (uint32_t first = 0; first < panel_count; first += kGroupsPerBlock) {
    const uint32_t count =
        panel_count - first < kGroupsPerBlock ? panel_count - first : kGroupsPerBlock;
    TileState state;
    for (int r = 0; r < kTileRows; ++r)
      state.best[r] = state.second[r] = _mm512_set1_epi32(INT32_MAX);
    uint32_t p = 0;
    for (; p + 2 <= count; p += 2) {
      MultiplyTile<2>(AllTileRows(), rows, row_keys, columns.panels + first + p, p, &state,
                      column_keys + (first + p) * kPanelColumns,
                      column_seconds + (first + p) * kPanelColumns);
    }
    if (p < count) {
      MultiplyTile<1>(AllTileRows(), rows, row_keys, columns.panels + first + p, p, &state,
                      column_keys + (first + p) * kPanelColumns,
                      column_seconds + (first + p) * kPanelColumns);
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
      PrepareRows(panel, row - block, block_end - row, &prepared);
      for (uint32_t r = 0; r < kPanelColumns && row + r < block_end; r += kTileRows) {
        const uint32_t row_count =
            block_end - row - r < kTileRows ? block_end - row - r : kTileRows;
        SweepColumns(prepared.groups[0] + r, prepared.column_keys + r, panel.norms_squared + r,
                     row_count, columns, column_keys, rows_out + row + r);
      }
    }
    MergeColumns(columns, block, column_keys, 1,
                 columns_out);  // a lane lost the parity of its column's norm
  }
}

void Distances(const uint8_t* query, const uint8_t* descriptors, const uint32_t* indices,
               size_t count, uint32_t* distances) {
  const __m512i query_low = _mm512_loadu_si512(query);
  const __m512i query_high = _mm512_loadu_si512(query + 64);
  const __m512i zero = _mm512_setzero_si512();
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* candidate = descriptors + static_cast<size_t>(indices[i]) * 128;
    const __m512i low = _mm512_loadu_si512(candidate);
    const __m512i high = _mm512_loadu_si512(candidate + 64);
    // |x - y| of bytes, then squares of 16 bits added in pairs.
    const __m512i difference_low =
        _mm512_sub_epi8(_mm512_max_epu8(query_low, low), _mm512_min_epu8(query_low, low));
    const __m512i difference_high =
        _mm512_sub_epi8(_mm512_max_epu8(query_high, high), _mm512_min_epu8(query_high, high));
    const __m512i d0 = _mm512_unpacklo_epi8(difference_low, zero);
    const __m512i d1 = _mm512_unpackhi_epi8(difference_low, zero);
    const __m512i d2 = _mm512_unpacklo_epi8(difference_high, zero);
    const __m512i d3 = _mm512_unpackhi_epi8(difference_high, zero);
    const __m512i even = _mm512_dpwssd_epi32(_mm512_dpwssd_epi32(zero, d0, d0), d2, d2);
    const __m512i odd = _mm512_dpwssd_epi32(_mm512_dpwssd_epi32(zero, d1, d1), d3, d3);
    distances[i] = static_cast<uint32_t>(_mm512_reduce_add_epi32(_mm512_add_epi32(even, odd)));
  }
}

constexpr MatcherKernels kKernels = {&NearestBothWays, &Distances};

}  // namespace

const MatcherKernels* const kMatcherKernelsAvx512Vnni = &kKernels;

}  // namespace veduta
#else
namespace veduta {
const MatcherKernels* const kMatcherKernelsAvx512Vnni = nullptr;
}
#endif
