// SPDX-License-Identifier: Apache-2.0
// The sparse points of a reconstruction, as one geometry that grows while they come.
import { BufferAttribute, BufferGeometry, Points, PointsMaterial } from "three";

// Of /v1/reconstructions/N/points: x, y, z as 32-bit floats, red, green, blue, 0. Each beginning of
// them is an even sample of all.
const POINT_BYTES = 16;

export class PointCloud {
  readonly object: Points;
  private all: Float32Array;
  private colors: Uint8Array;
  private filled = 0; // points
  private rest = new Uint8Array(0); // of a point that came in part

  // `expected`: about how many will come.
  constructor(expected: number) {
    this.all = new Float32Array(3 * expected);
    this.colors = new Uint8Array(3 * expected);
    // The size is in CSS px: three.js multiplies it by the pixel ratio.
    const material = new PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true });
    this.object = new Points(this.geometry(), material);
    this.object.frustumCulled = false;
  }

  get count(): number {
    return this.filled;
  }

  // x, y, z of each point, in the world.
  get positions(): Float32Array {
    return this.all.subarray(0, 3 * this.filled);
  }

  // The next bytes of the answer.
  append(bytes: Uint8Array): void {
    const joined = new Uint8Array(this.rest.length + bytes.length);
    joined.set(this.rest);
    joined.set(bytes, this.rest.length);
    const added = Math.floor(joined.length / POINT_BYTES);
    this.rest = joined.slice(POINT_BYTES * added);
    if (added === 0) return;
    this.reserve(this.filled + added);
    const from = new DataView(joined.buffer);
    for (let i = 0; i < added; ++i) {
      const to = 3 * (this.filled + i);
      for (let k = 0; k < 3; ++k) {
        this.all[to + k] = from.getFloat32(POINT_BYTES * i + 4 * k, true);
        this.colors[to + k] = joined[POINT_BYTES * i + 12 + k]!;
      }
    }
    for (const name of ["position", "color"]) {
      const attribute = this.object.geometry.getAttribute(name) as BufferAttribute;
      attribute.addUpdateRange(3 * this.filled, 3 * added);
      attribute.needsUpdate = true;
    }
    this.filled += added;
  }

  // Draws at most so many in the next frame; gives how many.
  choose(most: number): number {
    const count = Math.min(this.filled, Math.floor(most));
    this.object.geometry.setDrawRange(0, count);
    return count;
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as PointsMaterial).dispose();
  }

  private geometry(): BufferGeometry {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.all, 3));
    geometry.setAttribute("color", new BufferAttribute(this.colors, 3, true));
    return geometry;
  }

  // The reconstruction may have grown since somebody told how many points it has.
  private reserve(count: number): void {
    if (3 * count <= this.all.length) return;
    const before = { all: this.all, colors: this.colors };
    const length = 3 * Math.max(count, Math.ceil((1.5 * this.all.length) / 3));
    this.all = new Float32Array(length);
    this.colors = new Uint8Array(length);
    this.all.set(before.all);
    this.colors.set(before.colors);
    this.object.geometry.dispose();
    this.object.geometry = this.geometry();
  }
}
