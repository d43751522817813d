// SPDX-License-Identifier: Apache-2.0
// Moves the view from one pose to another; at once for those who prefer less motion.
import type { Quaternion, Vector3 } from "three";

const FLIGHT_MS = 900;

export interface Pose {
  position: Vector3;
  quaternion: Quaternion;
  fieldDeg: number;
}

// Gives a function that ends the flight where it is.
export function fly(
  from: Pose,
  goal: Pose,
  set: (pose: Pose) => void,
  arrive: () => void,
): () => void {
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) {
    set(goal);
    arrive();
    return () => {};
  }
  const began = performance.now();
  let frame = requestAnimationFrame(step);
  function step(): void {
    const share = Math.min(1, (performance.now() - began) / FLIGHT_MS);
    const eased = share * share * (3 - 2 * share);
    set({
      position: from.position.clone().lerp(goal.position, eased),
      quaternion: from.quaternion.clone().slerp(goal.quaternion, eased),
      fieldDeg: from.fieldDeg + (goal.fieldDeg - from.fieldDeg) * eased,
    });
    if (share < 1) frame = requestAnimationFrame(step);
    else arrive();
  }
  return () => cancelAnimationFrame(frame);
}
