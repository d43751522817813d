// SPDX-License-Identifier: Apache-2.0
// Colours of the style sheet, which are other ones in the dark, for what is drawn.
import { Color } from "three";
import type { MarkColors } from "./camera_marks";

export function cssColor(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim() || "#888888";
}

export function readMarkColors(): MarkColors {
  return {
    camera: new Color(cssColor("--camera")),
    selected: new Color(cssColor("--selected")),
    neighbor: new Color(cssColor("--neighbor")),
  };
}
