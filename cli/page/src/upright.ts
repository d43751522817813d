// SPDX-License-Identifier: Apache-2.0
// How the world of a reconstruction stands in the view: turned upright (+y is up there), with its
// middle at the origin, and scaled so that most of it lies within VIEW_RADIUS.
import { Quaternion, Vector3 } from "three";
import type { Georeference, PlacedPhoto, QuaternionWxyz } from "./answers";

export const VIEW_RADIUS = 10;

export interface Placing {
  view_from_world: Quaternion;
  scale: number;
  middle: Vector3; // in the world
  forward: Vector3; // in the view: where the cameras look on the whole, horizontal, of length 1
  plan: PlanFrame;
}

// How a plan lies in the world.
export interface PlanFrame {
  up: Vector3; // it is looked at from there
  top: Vector3; // up on the screen: north where it is known, otherwise where the cameras look
  metresOfUnit: number | null; // of the world; null: the place on the earth is not known
}

export function quaternionOf(wxyz: QuaternionWxyz): Quaternion {
  return new Quaternion(wxyz[1], wxyz[2], wxyz[3], wxyz[0]).normalize();
}

// Quarter turns, clockwise, of a photo of EXIF's `orientation` until it stands upright.
export function quarterTurns(orientation: number): number {
  if (orientation < 3) return 0;
  return orientation < 5 ? 2 : orientation < 7 ? 1 : 3;
}

// Of a camera that has the photo upright: x to the right, y down, z forward. The axes of a camera
// in the world are the rows of R.
export function worldFromCam(photo: PlacedPhoto): Quaternion {
  const angle = (-Math.PI / 2) * quarterTurns(photo.orientation);
  const cam_from_upright = new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), angle);
  return quaternionOf(photo.rotation_wxyz).conjugate().multiply(cam_from_upright);
}

// `positions`: x, y, z of each point, in the world.
export function placingOf(
  reconstruction: number,
  photos: PlacedPhoto[],
  positions: Float32Array,
  georeference: Georeference,
): Placing {
  const earth = earthOf(reconstruction, georeference);
  const up = earth?.up ?? upOf(photos);
  const view_from_world = new Quaternion().setFromUnitVectors(up, new Vector3(0, 1, 0));
  const forward = new Vector3();
  for (const photo of photos)
    forward.add(new Vector3(0, 0, 1).applyQuaternion(worldFromCam(photo)));
  forward.applyQuaternion(view_from_world).setY(0);
  if (forward.length() <= 0.05 * photos.length) forward.set(0, 0, -1);
  forward.normalize();
  const { middle, radius } = extentOf(photos, positions);
  const ahead = forward.clone().applyQuaternion(view_from_world.clone().conjugate());
  const plan = earth ?? { up, top: ahead, metresOfUnit: null };
  return { view_from_world, scale: VIEW_RADIUS / radius, middle, forward, plan };
}

// Null where the place on the earth is not known.
function earthOf(reconstruction: number, georeference: Georeference): PlanFrame | null {
  const place = georeference.reconstructions.find((one) => one.reconstruction === reconstruction);
  if (!place?.known || !place.rotation_wxyz || !place.scale) return null;
  // R maps the world into east, north and up.
  const world_from_earth = quaternionOf(place.rotation_wxyz).conjugate();
  return {
    up: new Vector3(0, 0, 1).applyQuaternion(world_from_earth),
    top: new Vector3(0, 1, 0).applyQuaternion(world_from_earth),
    metresOfUnit: place.scale,
  };
}

function upOf(photos: PlacedPhoto[]): Vector3 {
  const up = new Vector3();
  for (const photo of photos) up.add(new Vector3(0, -1, 0).applyQuaternion(worldFromCam(photo)));
  return up.length() > 0.05 * photos.length ? up.normalize() : new Vector3(0, -1, 0);
}

// Medians and quantiles, since a few points may lie very far away.
function extentOf(
  photos: PlacedPhoto[],
  positions: Float32Array,
): { middle: Vector3; radius: number } {
  const sample: Vector3[] = photos.map((photo) => new Vector3(...photo.center));
  const count = positions.length / 3;
  const step = Math.max(1, Math.floor(count / 20_000));
  for (let i = 0; i < count; i += step) sample.push(new Vector3().fromArray(positions, 3 * i));
  if (sample.length === 0) return { middle: new Vector3(), radius: 1 };
  const middle = new Vector3(
    quantile(
      sample.map((p) => p.x),
      0.5,
    ),
    quantile(
      sample.map((p) => p.y),
      0.5,
    ),
    quantile(
      sample.map((p) => p.z),
      0.5,
    ),
  );
  const cameras = sample.slice(0, photos.length).map((p) => p.distanceTo(middle));
  const radius = Math.max(
    quantile(
      sample.map((p) => p.distanceTo(middle)),
      0.8,
    ),
    cameras.length > 0 ? quantile(cameras, 0.9) : 0,
  );
  return { middle, radius: radius > 0 ? radius : 1 };
}

export function quantile(values: number[], share: number): number {
  const sorted = Float64Array.from(values).sort();
  return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] ?? 0;
}
