// SPDX-License-Identifier: Apache-2.0
// The plan: the view from straight above. It has no perspective, so that one scale holds in all of
// it, and it never turns. Dragging moves it; the wheel and two fingers zoom it where they are.
import { MOUSE, OrthographicCamera, TOUCH, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { VIEW_RADIUS } from "./upright";

// The camera stands so high above what it shows. Nothing hides anything by being too near or too
// far: points of a reconstruction that are as far away are wrong.
const HEIGHT = 100 * VIEW_RADIUS;
const ZOOM_OUT_MAX = 60; // from where all is shown
const ZOOM_IN_MAX = 1000;

export class Plan {
  // Its zoom is how many CSS px one unit of the view takes.
  readonly camera = new OrthographicCamera(-1, 1, 1, -1, 0, 2 * HEIGHT);
  onChange: () => void = () => {};

  private controls: OrbitControls | null = null;
  private isListening = false;
  private readonly middle = new Vector3(); // what it looks at, while there are no controls
  private readonly up = new Vector3(0, 1, 0);
  private fitZoom = 1;

  constructor(private readonly canvas: HTMLCanvasElement) {}

  // Whether it follows the mouse and fingers.
  set enabled(isListening: boolean) {
    this.isListening = isListening;
    if (this.controls) this.controls.enabled = isListening;
  }

  // Looks down along `up`; `top` is up on the screen. Both are of length 1 and at a right angle, in
  // the view. It keeps looking at the same place.
  orient(up: Vector3, top: Vector3): void {
    const isSame = this.up.distanceTo(up) < 1e-9 && this.camera.up.distanceTo(top) < 1e-9;
    if (isSame && this.controls) return;
    if (this.controls) this.middle.copy(this.controls.target);
    this.up.copy(up);
    this.camera.up.copy(top);
    this.listen();
  }

  // Shows all that lies within `radius` of `middle`, in the part of the view that is free.
  fit(middle: Vector3, radius: number, free: { width: number; height: number }): void {
    this.middle.copy(middle);
    this.fitZoom = Math.min(free.width, free.height) / (2.2 * radius);
    this.camera.zoom = this.fitZoom;
    this.camera.updateProjectionMatrix();
    this.listen();
  }

  // What panels cover at the right and at the bottom moves the middle, as in the other view.
  resize(width: number, height: number, right: number, bottom: number): void {
    this.camera.left = -width / 2;
    this.camera.right = width / 2;
    this.camera.top = height / 2;
    this.camera.bottom = -height / 2;
    this.camera.setViewOffset(width, height, right / 2, bottom / 2, width, height);
  }

  // Moves on by so many CSS px to the right and up.
  pan(right: number, up: number): void {
    if (!this.controls) return;
    const step = new Vector3(right, up, 0).divideScalar(this.camera.zoom);
    step.applyQuaternion(this.camera.quaternion);
    this.camera.position.add(step);
    this.controls.target.add(step);
    this.controls.update();
    this.onChange();
  }

  zoomBy(factor: number): void {
    const zoom = this.camera.zoom * factor;
    const least = this.fitZoom / ZOOM_OUT_MAX;
    this.camera.zoom = Math.min(this.fitZoom * ZOOM_IN_MAX, Math.max(least, zoom));
    this.camera.updateProjectionMatrix();
    this.onChange();
  }

  // Controls keep the direction that was up when they were made, so there are new ones each time.
  private listen(): void {
    this.controls?.dispose();
    this.camera.position.copy(this.up).multiplyScalar(HEIGHT).add(this.middle);
    const controls = new OrbitControls(this.camera, this.canvas);
    controls.enabled = this.isListening;
    controls.enableRotate = false;
    controls.zoomToCursor = true;
    controls.minZoom = this.fitZoom / ZOOM_OUT_MAX;
    controls.maxZoom = this.fitZoom * ZOOM_IN_MAX;
    controls.mouseButtons = { LEFT: MOUSE.PAN, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    controls.touches = { ONE: TOUCH.PAN, TWO: TOUCH.DOLLY_PAN };
    controls.target.copy(this.middle);
    controls.update();
    controls.addEventListener("change", () => this.onChange());
    this.controls = controls;
    this.onChange();
  }
}
