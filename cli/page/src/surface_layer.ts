// SPDX-License-Identifier: Apache-2.0
// The dense surface of a reconstruction, drawn from the daemon's 3D Tiles: coarse from afar, fine
// from near, and never more of it than the view shows.
import { TilesRenderer } from "3d-tiles-renderer/three";
import {
  BufferAttribute,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  type Camera,
  type Object3D,
} from "three";
import { Problem, whole, type Api } from "./api";

// A tile is drawn as it is where its error is below so many CSS px. The error is the diagonal of
// the cells whose vertices were joined, so vertices are some 3 px apart then. Chosen by hand.
const ERROR_TARGET_PX = 6;
// While the view moves, coarser tiles are drawn where a frame takes long, and finer ones again
// where it does not: within so many times the error above.
const SLOW_MS = 50;
const FAST_MS = 25;
const COARSENESS_MAX = 8;
// After a tile that did not come; longer each time.
const ASK_AGAIN_MS_MIN = 3_000;
const ASK_AGAIN_MS_MAX = 60_000;

interface Tileset {
  asset: { version: string };
  root: { transform?: number[] };
}

// One tileset as it was when it was asked for.
class Surface {
  readonly tiles: TilesRenderer;
  private hasLoaded = false; // everything that the view needs has come once
  private hasFailed = false; // a tile did not come

  constructor(api: Api, url: string, tileset: Tileset, layer: { changed(): void; failed(): void }) {
    this.tiles = new TilesRenderer(url);
    this.tiles.registerPlugin({
      name: "daemon",
      // The first thing that is asked for is the tileset itself.
      fetchData: (asked: string, options: RequestInit) =>
        asked.endsWith("/tileset.json")
          ? Promise.resolve(tileset)
          : api.request(asked, { signal: options.signal ?? null, cache: "default" }),
      processTileModel: (scene: Object3D) => scene.traverse(prepare),
    });
    for (const event of ["needs-update", "load-model", "tile-visibility-change"] as const) {
      this.tiles.addEventListener(event, () => layer.changed());
    }
    this.tiles.addEventListener("tiles-load-end", () => {
      this.hasLoaded = true;
      layer.changed();
    });
    this.tiles.addEventListener("load-error", () => {
      this.hasFailed = true;
      layer.failed();
    });
  }

  // Asks anew for what has failed.
  retry(): void {
    this.hasFailed = false;
    this.tiles.resetFailedTiles();
  }

  // Nothing that the view needs is still to come. A tile may have failed.
  get isLoaded(): boolean {
    return this.hasLoaded && this.tiles.loadProgress === 1;
  }

  get isComplete(): boolean {
    return this.isLoaded && !this.hasFailed;
  }

  get triangles(): number {
    let count = 0;
    this.tiles.group.traverse((node) => {
      if (node instanceof Mesh) count += (node.geometry.index?.count ?? 0) / 3;
    });
    return count;
  }
}

export class SurfaceLayer {
  readonly object = new Group();
  onChange: () => void = () => {}; // something else is to be drawn

  private shown: Surface | null = null;
  private next: Surface | null = null; // takes the place of `shown` once it is loaded
  private id: number | null = null; // the reconstruction
  private tag = ""; // of the tileset that was asked for last
  private asking: AbortController | null = null;
  private isStale = false; // it is to be asked for once more
  private askAgainTimer: number | null = null;
  private askAgainMs = ASK_AGAIN_MS_MIN;
  private lastFrame = 0; // of a view that moves, by performance.now(); 0: it was still
  private coarseness = 1;

  constructor(private readonly api: Api) {}

  get exists(): boolean {
    return this.shown !== null;
  }

  // Of what the last frame has drawn, if the layer is seen.
  get triangles(): number {
    return this.shown?.triangles ?? 0;
  }

  get tileCount(): number {
    return this.shown?.tiles.visibleTiles.size ?? 0;
  }

  get isComplete(): boolean {
    return this.next === null && (this.shown?.isComplete ?? true);
  }

  // Shows the surface of a reconstruction as it is now, once it has come. Null: none. Asking again
  // costs little where nothing has changed.
  async show(id: number | null): Promise<void> {
    if (this.id !== id) this.clear();
    this.id = id;
    this.isStale = true;
    if (id === null || this.asking) return;
    const asking = (this.asking = new AbortController());
    try {
      while (this.isStale && !asking.signal.aborted) {
        this.isStale = false;
        await this.ask(`/v1/reconstructions/${id}/surface/tileset.json`, asking.signal);
      }
    } catch (error) {
      if (asking.signal.aborted) return;
      // It is gone since the city was read.
      if (error instanceof Problem && error.status === 404) return this.clear();
      throw error;
    } finally {
      if (this.asking === asking) this.asking = null;
    }
  }

  private async ask(url: string, signal: AbortSignal): Promise<void> {
    const headers: HeadersInit = this.tag === "" ? {} : { "If-None-Match": this.tag };
    const response = await this.api.request(url, { headers, signal });
    const text = await whole(() => response.text());
    if (signal.aborted || response.status === 304) return;
    this.tag = response.headers.get("ETag") ?? "";
    this.take(url, JSON.parse(text) as Tileset);
  }

  // Before each frame; loads what the camera sees. Sizes are those of the view in CSS px.
  update(camera: Camera, width: number, height: number, isMoving: boolean): void {
    this.pace(isMoving);
    for (const surface of [this.shown, this.next]) {
      if (!surface) continue;
      if (!surface.tiles.hasCamera(camera)) {
        for (const other of [...surface.tiles.cameras]) surface.tiles.deleteCamera(other);
        surface.tiles.setCamera(camera);
      }
      surface.tiles.setResolution(camera, width, height);
      surface.tiles.errorTarget = ERROR_TARGET_PX * (isMoving ? this.coarseness : 1);
      surface.tiles.group.updateMatrixWorld(true);
      surface.tiles.update();
    }
    if (this.next?.isLoaded) this.exchange();
  }

  private pace(isMoving: boolean): void {
    const now = performance.now();
    if (isMoving && this.lastFrame > 0) {
      const took = now - this.lastFrame;
      if (took > SLOW_MS) this.coarseness = Math.min(COARSENESS_MAX, 1.5 * this.coarseness);
      else if (took < FAST_MS) this.coarseness = Math.max(1, this.coarseness / 1.1);
    }
    this.lastFrame = isMoving ? now : 0;
  }

  private take(url: string, tileset: Tileset): void {
    // The view stands in the reconstruction's frame, not on the earth.
    delete tileset.root.transform;
    // The renderer warns of what 1.1 may have; the daemon's tilesets have nothing of it but glTF.
    tileset.asset.version = "1.0";
    this.askAgainMs = ASK_AGAIN_MS_MIN;
    const surface = new Surface(this.api, url, tileset, {
      changed: () => this.onChange(),
      failed: () => this.askAgain(),
    });
    this.next?.tiles.dispose();
    this.next = null;
    if (this.shown) {
      this.next = surface;
      surface.tiles.group.visible = false;
    } else {
      this.shown = surface;
    }
    this.object.add(surface.tiles.group);
    this.onChange();
  }

  private exchange(): void {
    this.shown?.tiles.dispose();
    this.shown = this.next;
    this.next = null;
    if (this.shown) this.shown.tiles.group.visible = true;
    this.onChange();
  }

  // A tile did not come: where the surface has changed meanwhile, there is another tileset.
  private askAgain(): void {
    this.askAgainTimer ??= window.setTimeout(() => {
      this.askAgainTimer = null;
      this.askAgainMs = Math.min(2 * this.askAgainMs, ASK_AGAIN_MS_MAX);
      this.shown?.retry();
      this.next?.retry();
      this.show(this.id).catch(() => {});
      this.onChange();
    }, this.askAgainMs);
  }

  private clear(): void {
    this.shown?.tiles.dispose();
    this.next?.tiles.dispose();
    this.shown = this.next = null;
    this.asking?.abort();
    this.asking = null;
    this.tag = "";
    this.onChange();
  }
}

let srgbOfLight: Uint8Array | null = null;

function srgbTable(): Uint8Array {
  if (srgbOfLight) return srgbOfLight;
  srgbOfLight = new Uint8Array(65536);
  for (let i = 0; i < srgbOfLight.length; ++i) {
    const light = i / 65535;
    const value = light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
    srgbOfLight[i] = Math.round(255 * value);
  }
  return srgbOfLight;
}

// The view puts colours on the screen as they are, and glTF has light. Attributes of their own take
// half the memory of those that are interleaved, which three.js keeps once for each kind of number.
function prepare(node: Object3D): void {
  if (!(node instanceof Mesh)) return;
  const { position, color } = node.geometry.attributes;
  if (!position || !color) return;
  const table = srgbTable();
  const places = new Float32Array(3 * position.count);
  const colors = new Uint8Array(4 * position.count);
  const light = color.array;
  const [stride, offset] = "data" in color ? [color.data.stride, color.offset] : [4, 0];
  for (let i = 0; i < position.count; ++i) {
    places[3 * i] = position.getX(i);
    places[3 * i + 1] = position.getY(i);
    places[3 * i + 2] = position.getZ(i);
    for (let k = 0; k < 3; ++k) colors[4 * i + k] = table[light[i * stride + offset + k]!]!;
    colors[4 * i + 3] = 255;
  }
  node.geometry.setAttribute("position", new BufferAttribute(places, 3));
  node.geometry.setAttribute("color", new BufferAttribute(colors, 4, true));
  node.material = new MeshBasicMaterial({ vertexColors: true, side: DoubleSide });
}
