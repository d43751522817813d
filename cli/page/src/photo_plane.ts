// SPDX-License-Identifier: Apache-2.0
// A photo in the world, on a plane before its camera.
import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  Mesh,
  MeshBasicMaterial,
  Texture,
  Vector3,
} from "three";
import type { CameraModel, PhotoDetails, PlacedPhoto } from "./answers";
import { quarterTurns, worldFromCam } from "./upright";

// The pinhole part of a calibration, in px, of the photo as it stands upright. The lens's
// distortion is left out: it moves what the photo shows by some px.
export interface Pinhole {
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  width: number;
  height: number;
}

// `model` may be missing or be that of another size: then an opening angle of 60 degrees is taken.
export function pinholeOf(details: PhotoDetails, model: CameraModel | undefined): Pinhole {
  let pinhole = unturnedPinholeOf(details, model);
  for (let turn = quarterTurns(details.orientation); turn > 0; --turn) {
    // What was to the right is below, and what was below is to the left.
    const { fx, fy, cx, cy, width, height } = pinhole;
    pinhole = { fx: fy, fy: fx, cx: height - cy, cy: cx, width: height, height: width };
  }
  return pinhole;
}

function unturnedPinholeOf(details: PhotoDetails, model: CameraModel | undefined): Pinhole {
  const width = details.width || 4;
  const height = details.height || 3;
  const numbers = (model?.params ?? "").split(",").map(Number);
  const [fx, fy, cx, cy] = numbers;
  if (model?.size === `${width}x${height}` && fx && fy && cx !== undefined && cy !== undefined) {
    return { fx, fy, cx, cy, width, height };
  }
  const focal = Math.max(width, height) / (2 * Math.tan(Math.PI / 6));
  return { fx: focal, fy: focal, cx: width / 2, cy: height / 2, width, height };
}

export class PhotoPlane {
  readonly object: Mesh;
  private readonly material: MeshBasicMaterial;
  private readonly bitmap: ImageBitmap;

  // `depth`: from the camera, in units of the world. dispose() closes `bitmap`.
  constructor(bitmap: ImageBitmap, photo: PlacedPhoto, pinhole: Pinhole, depth: number) {
    this.bitmap = bitmap;
    const { fx, fy, cx, cy, width, height } = pinhole;
    const world_from_cam = worldFromCam(photo);
    const center = new Vector3(...photo.center);
    const corners = new Float32Array(12);
    const corners_px: [number, number][] = [
      [0, 0],
      [width, 0],
      [width, height],
      [0, height],
    ];
    corners_px.forEach(([x, y], k) => {
      const ray = new Vector3((x - cx) / fx, (y - cy) / fy, 1).multiplyScalar(depth);
      ray
        .applyQuaternion(world_from_cam)
        .add(center)
        .toArray(corners, 3 * k);
    });
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(corners, 3));
    const uv = new Float32Array([0, 0, 1, 0, 1, 1, 0, 1]); // the first row of a bitmap is v = 0
    geometry.setAttribute("uv", new BufferAttribute(uv, 2));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const map = new Texture(bitmap);
    map.flipY = false;
    map.needsUpdate = true;
    this.material = new MeshBasicMaterial({
      map,
      transparent: true,
      depthTest: false,
      depthWrite: false,
      side: DoubleSide,
    });
    this.object = new Mesh(geometry, this.material);
    this.object.renderOrder = 1;
    this.object.frustumCulled = false;
  }

  set opacity(value: number) {
    this.material.opacity = value;
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.material.map?.dispose();
    this.material.dispose();
    this.bitmap.close();
  }
}

// The median depth of the points before a camera, in units of the world; 1 where there are none.
export function depthBefore(photo: PlacedPhoto, pinhole: Pinhole, positions: Float32Array): number {
  const cam_from_world = worldFromCam(photo).conjugate();
  const center = new Vector3(...photo.center);
  const depths: number[] = [];
  const step = 3 * Math.max(1, Math.floor(positions.length / 3 / 20_000));
  for (let i = 0; i + 2 < positions.length; i += step) {
    const p = new Vector3().fromArray(positions, i).sub(center).applyQuaternion(cam_from_world);
    const x = (pinhole.fx * p.x) / p.z + pinhole.cx;
    const y = (pinhole.fy * p.y) / p.z + pinhole.cy;
    const isSeen = p.z > 0 && x >= 0 && y >= 0 && x <= pinhole.width && y <= pinhole.height;
    if (isSeen) depths.push(p.z);
  }
  depths.sort((a, b) => a - b);
  return depths[Math.floor(depths.length / 2)] ?? 1;
}
