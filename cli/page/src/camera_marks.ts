// SPDX-License-Identifier: Apache-2.0
// The cameras as small pyramids: lines from the centre to the four corners of the picture.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  LineBasicMaterial,
  LineSegments,
  Vector3,
  type Camera,
} from "three";
import type { PlacedPhoto } from "./answers";
import { quantile, worldFromCam } from "./upright";

// Corners of a picture of 4 x 3 at depth 1, of about the opening angle of a phone's camera.
const CORNERS = [
  [-0.6, -0.45],
  [0.6, -0.45],
  [0.6, 0.45],
  [-0.6, 0.45],
] as const;
// Pairs of vertices: 0 is the centre, 1 to 4 are the corners.
const EDGES = [0, 1, 0, 2, 0, 3, 0, 4, 1, 2, 2, 3, 3, 4, 4, 1] as const;

export interface MarkColors {
  camera: Color;
  selected: Color;
  neighbor: Color;
}

export class CameraMarks {
  readonly object: LineSegments;
  private readonly tips: Vector3[]; // in the world: the middle of each pyramid's axis
  private readonly indexOf: Map<number, number>;

  constructor(
    readonly photos: PlacedPhoto[],
    worldRadius: number,
  ) {
    const size = sizeOf(photos, worldRadius);
    const positions = new Float32Array(3 * EDGES.length * photos.length);
    this.tips = [];
    this.indexOf = new Map();
    photos.forEach((photo, index) => {
      const turn = worldFromCam(photo);
      const center = new Vector3(...photo.center);
      const vertices = [center];
      for (const [x, y] of CORNERS) {
        const corner = new Vector3(x, y, 1).multiplyScalar(size);
        vertices.push(corner.applyQuaternion(turn).add(center));
      }
      EDGES.forEach((vertex, k) => {
        vertices[vertex]!.toArray(positions, 3 * (EDGES.length * index + k));
      });
      const tip = new Vector3(0, 0, 0.5 * size).applyQuaternion(turn).add(center);
      this.tips.push(tip);
      this.indexOf.set(photo.id, index);
    });
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setAttribute("color", new BufferAttribute(new Float32Array(positions.length), 3));
    this.object = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true }));
    this.object.frustumCulled = false;
  }

  paint(colors: MarkColors, selected: number | null, neighbors: ReadonlySet<number>): void {
    const attribute = this.object.geometry.getAttribute("color") as BufferAttribute;
    this.photos.forEach((photo, index) => {
      const { r, g, b } =
        photo.id === selected
          ? colors.selected
          : neighbors.has(photo.id)
            ? colors.neighbor
            : colors.camera;
      for (let k = 0; k < EDGES.length; ++k) attribute.setXYZ(EDGES.length * index + k, r, g, b);
    });
    attribute.needsUpdate = true;
  }

  // Where a photo's pyramid is drawn, in CSS px of a view of this size; null: it is not in sight.
  screenOf(id: number, camera: Camera, width: number, height: number): [number, number] | null {
    const tip = this.tips[this.indexOf.get(id) ?? -1];
    return tip ? this.project(tip, camera, width, height) : null;
  }

  // The photo whose pyramid is drawn nearest to x, y, and at most `reach` px away.
  pick(
    x: number,
    y: number,
    reach: number,
    camera: Camera,
    width: number,
    height: number,
  ): number | null {
    let best: number | null = null;
    let bestPx = reach;
    this.photos.forEach((photo, index) => {
      const at = this.project(this.tips[index]!, camera, width, height);
      if (!at) return;
      const px = Math.hypot(at[0] - x, at[1] - y);
      if (px < bestPx) [best, bestPx] = [photo.id, px];
    });
    return best;
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as LineBasicMaterial).dispose();
  }

  private project(
    tip: Vector3,
    camera: Camera,
    width: number,
    height: number,
  ): [number, number] | null {
    const p = tip.clone().applyMatrix4(this.object.matrixWorld).project(camera);
    if (Math.abs(p.x) > 1 || Math.abs(p.y) > 1 || Math.abs(p.z) > 1) return null;
    return [(0.5 + 0.5 * p.x) * width, (0.5 - 0.5 * p.y) * height];
  }
}

// The pyramids' length, in units of the world: by how far the cameras stand apart.
function sizeOf(photos: PlacedPhoto[], worldRadius: number): number {
  const centers = photos.map((photo) => new Vector3(...photo.center));
  const step = Math.max(1, Math.floor(centers.length / 300));
  const gaps: number[] = [];
  for (let i = 0; i < centers.length; i += step) {
    const center = centers[i]!;
    let gap = Infinity;
    for (const other of centers) {
      if (other !== center) gap = Math.min(gap, center.distanceTo(other));
    }
    if (Number.isFinite(gap)) gaps.push(gap);
  }
  const gap = gaps.length > 0 ? quantile(gaps, 0.5) : worldRadius;
  return Math.min(Math.max(0.5 * gap, 0.01 * worldRadius), 0.06 * worldRadius);
}
