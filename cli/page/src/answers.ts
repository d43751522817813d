// SPDX-License-Identifier: Apache-2.0
// The types of the daemon's answers, as docs/json.md describes them; only the keys in use.

export type Vec3 = [number, number, number];
export type QuaternionWxyz = [number, number, number, number];

export type Verdict =
  | "placed"
  | "merged"
  | "founded"
  | "postponed"
  | "rejected"
  | "duplicate"
  | "failed";

// One image of GET /v1/photos. x_cam = R (x_world - center); x to the right, y down, z forward, of
// the photo before `orientation` (EXIF's number) turns it upright.
export interface Photo {
  id: number;
  image: string;
  contributor: string;
  verdict: Verdict;
  reconstruction: number | null;
  unsure: boolean;
  hidden: boolean;
  orientation: number;
  rotation_wxyz?: QuaternionWxyz | null;
  center?: Vec3 | null;
}

export interface PlacedPhoto extends Photo {
  reconstruction: number;
  rotation_wxyz: QuaternionWxyz;
  center: Vec3;
}

export function isPlaced(photo: Photo): photo is PlacedPhoto {
  return photo.reconstruction !== null && !!photo.rotation_wxyz && !!photo.center;
}

export interface Neighbor {
  id: number;
  image: string;
  matches: number;
  verdict: Verdict;
}

export interface Hypothesis {
  a: number;
  b: number;
  reason: string;
  common_points: number;
  pairs_for: number;
  pairs_against: number;
  image: number | null;
  unsure: number[];
}

export interface PhotoDetails {
  id: number;
  image: string;
  verdict: Verdict;
  reason: string;
  reconstruction: number | null;
  may_stand_in: number[];
  camera: number;
  width: number;
  height: number;
  orientation: number;
  contributor: string;
  time: number;
  contribution: number | null;
  hidden: boolean;
  features: number;
  observations: number;
  neighbors: Neighbor[];
  hypotheses: Hypothesis[];
}

export interface Contribution {
  contribution: number;
  comment: string;
  licence: string;
}

export interface Reconstruction {
  id: number;
  images: number;
  points: number;
  reprojection_error_px_mean: number;
  geometry_version: number;
  triangles: number; // of its dense surface; 0: there is none yet
}

export interface Georeference {
  reconstructions: {
    reconstruction: number;
    known: boolean;
    scale: number | null; // metres for one unit of the reconstruction
    rotation_wxyz: QuaternionWxyz | null; // into east, north and up
  }[];
}

export interface CameraModel {
  id: number;
  name: string;
  size: string;
  params: string;
}

export interface JournalEntry {
  sequence: number;
  time: number;
  actor: string;
  action: string;
  image: number | null;
  reconstruction: number | null;
  detail: string;
}

export interface Outcome {
  image: string;
  id: number | null;
  verdict: Verdict;
  reason: string;
  reconstruction: number | null;
}

export interface Upload {
  upload: number;
  image: string;
  contributor: string;
  state: "waiting" | "done" | "failed";
  outcome: Outcome | null;
  why_not: string | null;
  awaits_camera: boolean; // it waits since its camera is not named and cannot be told yet
}

// Who looks at the page; no role where the city has no tokens.
export interface Me {
  name: string | null;
  role: "viewer" | "contributor" | "curator" | "admin" | null;
}

export interface Removal {
  purged: boolean; // false: some file of the database may still have bytes of it
  why_not: string | null;
  copies: string[]; // backups and the like that may still hold it
}

export const REPORT_REASONS = ["privacy", "copyright", "offensive", "wrong", "other"] as const;
export type ReportReason = (typeof REPORT_REASONS)[number];

export interface Report {
  report: number;
  id: number;
  image: string | null; // null: it was removed
  reason: ReportReason;
  text: string;
  reporter: string;
  time: number;
}
