// SPDX-License-Identifier: Apache-2.0
// The sparse points of a reconstruction, as one geometry.
import { BufferAttribute, BufferGeometry, Points, PointsMaterial } from "three";

// While the view moves, so many points are drawn at most. Chosen by hand: an integrated graphics
// processor draws them in about 16 ms.
const MOVING_COUNT_MAX = 2_000_000;

// Of /v1/reconstructions/N/points: x, y, z as 32-bit floats, red, green, blue, 0.
const POINT_BYTES = 16;

export class PointCloud {
  readonly object: Points;
  readonly positions: Float32Array;
  readonly count: number;

  constructor(bytes: ArrayBuffer) {
    this.count = Math.floor(bytes.byteLength / POINT_BYTES);
    const order = this.count > MOVING_COUNT_MAX ? shuffled(this.count) : null;
    const from = new DataView(bytes);
    this.positions = new Float32Array(3 * this.count);
    const colors = new Uint8Array(3 * this.count);
    for (let i = 0; i < this.count; ++i) {
      const at = POINT_BYTES * (order ? order[i]! : i);
      for (let k = 0; k < 3; ++k) {
        this.positions[3 * i + k] = from.getFloat32(at + 4 * k, true);
        colors[3 * i + k] = from.getUint8(at + 12 + k);
      }
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.positions, 3));
    geometry.setAttribute("color", new BufferAttribute(colors, 3, true));
    // The size is in CSS px: three.js multiplies it by the pixel ratio.
    const material = new PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true });
    this.object = new Points(geometry, material);
    this.object.frustumCulled = false;
  }

  // How many points the next frame draws: a random share of many while the view moves.
  choose(isMoving: boolean): number {
    const count = isMoving ? Math.min(this.count, MOVING_COUNT_MAX) : this.count;
    this.object.geometry.setDrawRange(0, count);
    return count;
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as PointsMaterial).dispose();
  }
}

// A permutation of 0 to count - 1, the same for each count (Fisher and Yates, with mulberry32).
function shuffled(count: number): Uint32Array {
  const order = Uint32Array.from({ length: count }, (_, i) => i);
  let state = count;
  for (let i = count - 1; i > 0; --i) {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    const j = Math.floor((((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32) * (i + 1));
    const kept = order[i]!;
    order[i] = order[j]!;
    order[j] = kept;
  }
  return order;
}
