// SPDX-License-Identifier: Apache-2.0
// Draws one reconstruction with three.js. It draws when something has changed, and not otherwise.
//
// The element that it fills tells what is drawn, for tests and for other programs:
//   data-points, data-cameras   how many the scene has
//   data-drawn                  how many points the last frame drew
//   data-selected               the number of the selected photo, or ""
//   data-marker-x, -y           where the selected photo's pyramid is drawn, in CSS px of the
//                               element; "" where it is not in sight
//   data-mode                   "model", "plan", or "photo" while the view stands in its pose
//   data-triangles, data-tiles  how many of the surface the last frame drew
//   data-surface                "none", "loading", or "complete" where the surface is drawn as fine
//                               as the view needs it
import {
  Color,
  ColorManagement,
  Group,
  LinearSRGBColorSpace,
  PerspectiveCamera,
  Quaternion,
  Scene,
  Spherical,
  Vector3,
  WebGLRenderer,
  type Camera,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { PlacedPhoto } from "./answers";
import { CameraMarks, type MarkColors } from "./camera_marks";
import { cssColor, readMarkColors } from "./css_colors";
import { fly, type Pose } from "./flight";
import type { Layers } from "./layer_switch";
import { depthBefore, PhotoPlane, type Pinhole } from "./photo_plane";
import { Plan } from "./plan";
import type { PlanLegend } from "./plan_legend";
import type { PointCloud } from "./point_cloud";
import { PointPace } from "./point_pace";
import type { SurfaceLayer } from "./surface_layer";
import { VIEW_RADIUS, worldFromCam, type Placing } from "./upright";

const FIELD_DEG = 50;
const PIXEL_RATIO_MAX = 2;
const STILL_MS = 250; // so long without a change, the view counts as still
const TURN_RAD = Math.PI / 36; // of an arrow key
const NEAR_FACTOR = 0.85; // of the + key
const PAN_PX = 60; // of an arrow key, in the plan
const REACH_PX = 14; // of a click around a camera
const REACH_TOUCH_PX = 26;
const PHOTO_MARGIN_PX = 16; // around a photo that the view stands in
const PHOTO_MARGIN_BELOW_PX = 72; // the bar with the slider lies there

export class CityView {
  onPick: (id: number) => void = () => {};
  onMode: (isInPhoto: boolean) => void = () => {};
  onPlan: (isInPlan: boolean) => void = () => {};

  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly world = new Group();
  private readonly camera = new PerspectiveCamera(FIELD_DEG, 1, 0.01, 2000);
  private readonly controls: OrbitControls;
  private readonly plan: Plan;
  private isFromAbove = false; // the plan is chosen; a photo goes before it
  private readonly pace: PointPace;
  private points: PointCloud | null = null;
  private marks: CameraMarks | null = null;
  private plane: PhotoPlane | null = null;
  private drawnLayers: Layers = "both";
  private placing: Placing | null = null; // how the world stands in the view now
  private latest: Placing | null = null; // how it would, by the latest points and cameras
  private selected: number | null = null;
  private neighbors: ReadonlySet<number> = new Set();
  private colors: MarkColors = readMarkColors();
  private insetRight = 0; // px that panels cover
  private insetBottom = 0;
  private frame = 0;
  private stillTimer = 0;
  private isMoving = false;
  private isIn = false; // a photo
  // Where the view was before it flew into a photo, until it is there again.
  private home: Pose | null = null;
  private stopFlight: () => void = () => {};

  // Throws where there is no WebGL.
  constructor(
    private readonly element: HTMLElement,
    private readonly surface: SurfaceLayer,
    private readonly legend: PlanLegend,
  ) {
    ColorManagement.enabled = false; // colours of photos go to the screen as they are
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.pace = new PointPace(this.renderer.getContext() as WebGL2RenderingContext);
    this.scene.add(this.world);
    this.world.add(surface.object);
    const canvas = this.renderer.domElement;
    element.prepend(canvas);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.moved());
    this.controls.minDistance = 0.02;
    this.controls.maxDistance = 60 * VIEW_RADIUS;
    this.plan = new Plan(canvas);
    this.plan.onChange = () => this.moved();
    new ResizeObserver(() => this.resize()).observe(element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolor());
    canvas.addEventListener("webglcontextrestored", () => this.requestRender());
    this.listenForClicks(canvas);
    element.addEventListener("keydown", (event) => this.onKey(event));
    element.dataset.selected = "";
    this.follow();
    this.recolor();
    this.resize();
  }

  // Shows a reconstruction. `keepsView`: the world stays where it stands in the view.
  show(points: PointCloud, photos: PlacedPhoto[], placing: Placing, keepsView: boolean): void {
    this.latest = placing;
    if (!keepsView || !this.placing) this.showAll();
    else if (this.isFromAbove) this.turnPlan();
    if (this.points !== points) {
      if (this.points) this.world.remove(this.points.object);
      this.points?.dispose();
      this.points = points;
      this.world.add(points.object);
    }
    if (this.marks) this.world.remove(this.marks.object);
    this.marks?.dispose();
    this.marks = new CameraMarks(photos, VIEW_RADIUS / placing.scale);
    this.marks.paint(this.colors, this.selected, this.neighbors);
    this.world.add(this.marks.object);
    this.world.updateMatrixWorld(true);
    this.element.dataset.points = String(points.count);
    this.element.dataset.cameras = String(photos.length);
    this.requestRender();
  }

  // More of the points that are shown have come.
  grow(): void {
    this.element.dataset.points = String(this.points?.count ?? 0);
    this.moved();
  }

  select(id: number | null, neighbors: ReadonlySet<number>): void {
    this.selected = id;
    this.neighbors = neighbors;
    this.element.dataset.selected = id === null ? "" : String(id);
    this.marks?.paint(this.colors, id, neighbors);
    this.requestRender();
  }

  // What is drawn where there is a surface; otherwise the points are.
  set layers(layers: Layers) {
    this.drawnLayers = layers;
    this.requestRender();
  }

  // Panels cover so many px at the right and at the bottom: the middle moves into what is free.
  setInsets(right: number, bottom: number): void {
    if (right === this.insetRight && bottom === this.insetBottom) return;
    this.insetRight = right;
    this.insetBottom = bottom;
    this.resize();
  }

  // The whole reconstruction, in the plan or from behind the cameras and from above.
  overview(): void {
    if (!this.isFromAbove) return this.showAll();
    this.leavePhoto(false);
    this.fitPlan();
  }

  // Shows the plan, or goes back to where the view was before.
  togglePlan(): void {
    if (this.isInPhoto) return;
    // On the way back from a photo: the view is there at once.
    this.stopFlight();
    if (this.home) this.setPose(this.home);
    this.home = null;
    this.isFromAbove = !this.isFromAbove;
    if (this.isFromAbove) this.fitPlan();
    this.follow();
    this.onPlan(this.isFromAbove);
    this.moved();
  }

  private fitPlan(): void {
    if (!this.placing || !this.latest) return;
    this.turnPlan();
    const middle = this.world.localToWorld(this.latest.middle.clone());
    this.plan.fit(middle, (VIEW_RADIUS * this.placing.scale) / this.latest.scale, this.freeSize());
  }

  // North becomes known, and better known, while the world stays where it is in the view.
  private turnPlan(): void {
    if (!this.placing || !this.latest) return;
    const { view_from_world, plan } = this.placing;
    const { up, top } = this.latest.plan.metresOfUnit === null ? plan : this.latest.plan;
    const inView = (axis: Vector3) => axis.clone().applyQuaternion(view_from_world);
    this.plan.orient(inView(up), inView(top));
  }

  // The mouse and fingers move what is drawn.
  private follow(): void {
    this.controls.enabled = !this.isInPhoto && !this.isFromAbove && !this.home;
    this.plan.enabled = !this.isInPhoto && this.isFromAbove;
    const model = this.isFromAbove ? "plan" : "model";
    this.element.dataset.mode = this.isInPhoto ? "photo" : model;
  }

  private get drawnCamera(): Camera {
    return this.isFromAbove && !this.isInPhoto ? this.plan.camera : this.camera;
  }

  private showAll(): void {
    this.leavePhoto(false);
    this.stopFlight();
    this.home = null;
    this.camera.fov = FIELD_DEG;
    this.camera.updateProjectionMatrix();
    this.follow();
    if (this.latest) this.place(this.latest);
    const forward = this.placing?.forward ?? new Vector3(0, 0, -1);
    const { height } = this.size();
    const free = this.freeSize();
    const tangent = Math.tan((FIELD_DEG * Math.PI) / 360);
    const half = Math.atan((tangent * Math.min(free.width, free.height)) / height);
    const distance = (1.1 * VIEW_RADIUS) / Math.sin(half);
    const offset = forward.clone().multiplyScalar(-0.8).setY(0.6);
    this.controls.target.set(0, 0, 0);
    this.camera.position.copy(offset.normalize().multiplyScalar(distance));
    this.controls.update();
    if (this.isFromAbove) this.fitPlan();
    this.moved();
  }

  private place(placing: Placing): void {
    this.placing = placing;
    this.world.quaternion.copy(placing.view_from_world);
    this.world.scale.setScalar(placing.scale);
    this.world.position
      .copy(placing.middle)
      .multiplyScalar(-placing.scale)
      .applyQuaternion(placing.view_from_world);
    this.world.updateMatrixWorld(true);
  }

  // Flies into the pose of a photo of the reconstruction that is shown, and lays the photo over it.
  // Closes `bitmap` when it is drawn no longer.
  enterPhoto(photo: PlacedPhoto, pinhole: Pinhole, bitmap: ImageBitmap, opacity: number): void {
    if (!this.placing || !this.points) return bitmap.close();
    this.home ??= this.pose();
    this.isIn = true;
    this.dropPlane();
    const depth = depthBefore(photo, pinhole, this.points.positions);
    this.plane = new PhotoPlane(bitmap, photo, pinhole, depth);
    this.plane.opacity = opacity;
    this.world.add(this.plane.object);
    this.plane.object.updateWorldMatrix(true, false);
    this.follow();
    this.onMode(true);
    // The view's camera looks along -z with y up, the photo's along +z with y down.
    const turned = new Quaternion(1, 0, 0, 0);
    this.flyTo({
      position: this.world.localToWorld(new Vector3(...photo.center)),
      quaternion: this.placing.view_from_world
        .clone()
        .multiply(worldFromCam(photo))
        .multiply(turned),
      fieldDeg: this.fieldOf(pinhole),
    });
  }

  set photoOpacity(value: number) {
    if (this.plane) this.plane.opacity = value;
    this.requestRender();
  }

  get isInPhoto(): boolean {
    return this.isIn;
  }

  // Goes back to where the view was before enterPhoto.
  leavePhoto(isFlown = true): void {
    if (!this.isIn || !this.home) return;
    const home = this.home;
    this.isIn = false;
    this.dropPlane();
    this.follow();
    this.onMode(false);
    const arrive = () => {
      this.home = null;
      this.follow();
      this.controls.update();
    };
    this.stopFlight();
    if (isFlown && !this.isFromAbove) return this.flyTo(home, arrive);
    this.setPose(home);
    arrive();
  }

  private dropPlane(): void {
    if (this.plane) this.world.remove(this.plane.object);
    this.plane?.dispose();
    this.plane = null;
  }

  private pose(): Pose {
    return {
      position: this.camera.position.clone(),
      quaternion: this.camera.quaternion.clone(),
      fieldDeg: this.camera.fov,
    };
  }

  private setPose(pose: Pose): void {
    this.camera.position.copy(pose.position);
    this.camera.quaternion.copy(pose.quaternion);
    this.camera.fov = pose.fieldDeg;
    this.camera.updateProjectionMatrix();
    this.moved();
  }

  private flyTo(goal: Pose, arrive: () => void = () => {}): void {
    this.stopFlight();
    this.stopFlight = fly(this.pose(), goal, (pose) => this.setPose(pose), arrive);
  }

  // The vertical field of the view in which all of the photo is in the part that is free.
  private fieldOf(pinhole: Pinhole): number {
    const { height } = this.size();
    const free = this.freeSize();
    const tangent = Math.max(
      (pinhole.width / pinhole.fx / (free.width - 2 * PHOTO_MARGIN_PX)) * (height / 2),
      (pinhole.height / pinhole.fy / (free.height - 2 * PHOTO_MARGIN_BELOW_PX)) * (height / 2),
    );
    return Math.min(150, (2 * Math.atan(tangent) * 180) / Math.PI);
  }

  // What no panel covers; never so small that nothing fits.
  private freeSize(): { width: number; height: number } {
    const { width, height } = this.size();
    return {
      width: Math.max(240, width - this.insetRight),
      height: Math.max(240, height - this.insetBottom),
    };
  }

  private size(): { width: number; height: number } {
    return {
      width: Math.max(1, this.element.clientWidth),
      height: Math.max(1, this.element.clientHeight),
    };
  }

  private resize(): void {
    const { width, height } = this.size();
    const ratio = Math.min(devicePixelRatio, PIXEL_RATIO_MAX);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    const [x, y] = [this.insetRight / 2, this.insetBottom / 2];
    this.camera.setViewOffset(width, height, x, y, width, height);
    this.plan.resize(width, height, this.insetRight, this.insetBottom);
    // A canvas that has a new size is empty: it is drawn at once, so that nothing flickers.
    this.render();
  }

  private recolor(): void {
    this.colors = readMarkColors();
    this.scene.background = new Color(cssColor("--view"));
    this.marks?.paint(this.colors, this.selected, this.neighbors);
    this.requestRender();
  }

  private moved(): void {
    this.isMoving = true;
    this.awaitStillness();
    this.requestRender();
  }

  // A frame that takes longer is no sign that nobody moves the view.
  private awaitStillness(): void {
    clearTimeout(this.stillTimer);
    this.stillTimer = window.setTimeout(() => {
      if (this.pace.isPending) return this.awaitStillness();
      this.isMoving = false;
      this.requestRender();
    }, STILL_MS);
  }

  requestRender(): void {
    this.frame ||= requestAnimationFrame(() => this.render());
  }

  private render(): void {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    const began = performance.now();
    const { width, height } = this.size();
    this.chooseSurface(width, height);
    const drawn = this.choosePoints();
    // The pyramid that the view stands in would frame the photo, and others hide it.
    if (this.marks) this.marks.object.visible = !this.isInPhoto;
    this.renderer.render(this.scene, this.drawnCamera);
    this.pace.measure(drawn, began);
    this.tellScale();
    const at =
      this.selected === null || !this.marks
        ? null
        : this.marks.screenOf(this.selected, this.drawnCamera, width, height);
    this.element.dataset.drawn = String(drawn);
    this.element.dataset.markerX = at ? at[0].toFixed(1) : "";
    this.element.dataset.markerY = at ? at[1].toFixed(1) : "";
  }

  private tellScale(): void {
    const isShown = this.drawnCamera === this.plan.camera && this.element.dataset.cameras !== "0";
    if (!isShown || !this.placing || !this.latest) return this.legend.hide();
    const metres = this.latest.plan.metresOfUnit;
    if (metres === null) return this.legend.showUnknown();
    this.legend.showScale((this.plan.camera.zoom * this.placing.scale) / metres);
  }

  private choosePoints(): number {
    if (!this.points) return 0;
    const isSeen = !this.surface.exists || this.drawnLayers !== "surface";
    this.points.object.visible = isSeen;
    // While tiles come, each of them is a reason to draw.
    const isBusy = this.isMoving || this.element.dataset.surface === "loading";
    return isSeen ? this.points.choose(this.pace.countMax(isBusy)) : 0;
  }

  private chooseSurface(width: number, height: number): void {
    const isSeen = this.surface.exists && this.drawnLayers !== "points";
    this.surface.object.visible = isSeen;
    if (isSeen) {
      this.drawnCamera.updateMatrixWorld();
      this.surface.update(this.drawnCamera, width, height, this.isMoving);
    }
    const { dataset } = this.element;
    dataset.surface = !isSeen ? "none" : this.surface.isComplete ? "complete" : "loading";
    dataset.triangles = String(isSeen ? this.surface.triangles : 0);
    dataset.tiles = String(isSeen ? this.surface.tileCount : 0);
  }

  // A click is a press that moves by less than 5 px.
  private listenForClicks(canvas: HTMLCanvasElement): void {
    let pressed: [number, number] | null = null;
    canvas.addEventListener("pointerdown", (event) => {
      pressed = event.isPrimary && event.button === 0 ? [event.clientX, event.clientY] : null;
    });
    canvas.addEventListener("pointerup", (event) => {
      if (!pressed || !event.isPrimary || this.isInPhoto) return;
      if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) >= 5) return;
      const box = canvas.getBoundingClientRect();
      const reach = event.pointerType === "mouse" ? REACH_PX : REACH_TOUCH_PX;
      const [x, y] = [event.clientX - box.left, event.clientY - box.top];
      const id = this.marks?.pick(x, y, reach, this.drawnCamera, box.width, box.height) ?? null;
      if (id !== null) this.onPick(id);
    });
  }

  private onKey(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey || this.isInPhoto) return;
    if (event.target !== this.element) return;
    if (event.key === "Home") this.overview();
    else if (event.key.toLowerCase() === "p") this.togglePlan();
    else if (!(this.isFromAbove ? this.onPlanKey(event.key) : this.onModelKey(event.key))) return;
    event.preventDefault();
  }

  // Gives whether the key means something.
  private onPlanKey(key: string): boolean {
    if (key === "ArrowLeft") this.plan.pan(-PAN_PX, 0);
    else if (key === "ArrowRight") this.plan.pan(PAN_PX, 0);
    else if (key === "ArrowUp") this.plan.pan(0, PAN_PX);
    else if (key === "ArrowDown") this.plan.pan(0, -PAN_PX);
    else if (key === "+" || key === "=") this.plan.zoomBy(1 / NEAR_FACTOR);
    else if (key === "-") this.plan.zoomBy(NEAR_FACTOR);
    else return false;
    return true;
  }

  private onModelKey(key: string): boolean {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const place = new Spherical().setFromVector3(offset);
    if (key === "ArrowLeft") place.theta -= TURN_RAD;
    else if (key === "ArrowRight") place.theta += TURN_RAD;
    else if (key === "ArrowUp") place.phi -= TURN_RAD;
    else if (key === "ArrowDown") place.phi += TURN_RAD;
    else if (key === "+" || key === "=") place.radius *= NEAR_FACTOR;
    else if (key === "-") place.radius /= NEAR_FACTOR;
    else return false;
    place.makeSafe();
    this.camera.position.setFromSpherical(place).add(this.controls.target);
    this.controls.update();
    this.moved();
    return true;
  }
}
