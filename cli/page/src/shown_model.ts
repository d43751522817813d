// SPDX-License-Identifier: Apache-2.0
// Keeps the view up to date with the city: which reconstruction is shown, its points and surface.
import { isPlaced, type Reconstruction } from "./answers";
import { whole, type Api } from "./api";
import type { City } from "./city";
import type { CityView } from "./city_view";
import { PointCloud } from "./point_cloud";
import type { SurfaceLayer } from "./surface_layer";
import { placingOf } from "./upright";

const SHOWN_COUNT_MIN = 100_000; // fewer are shown when all are there
const SHOW_MS = 300; // from one time that more points are shown to the next
const DRAW_MS = 20; // more than from one frame to the next

export class ShownModel {
  private chosen: number | null = null; // what the next turn is to show
  private id: number | null = null; // what is to be shown; its points may still be on their way
  private drawn: number | null = null; // what the view shows
  private points: PointCloud | null = null;
  private pointsOf = ""; // the reconstruction and its version
  private working: Promise<void> | null = null;
  private isStale = false;

  constructor(
    private readonly api: Api,
    private readonly city: City,
    private readonly view: CityView | null,
    private readonly surface: SurfaceLayer,
    private readonly onShown: (id: number | null) => void,
    private readonly onError: (error: unknown) => void,
  ) {
    city.onChange(() => this.update());
  }

  // Gives, once its points are there, whether the view shows it.
  async choose(id: number): Promise<boolean> {
    if (this.drawn !== id || this.working) {
      this.chosen = id;
      await this.update();
    }
    return this.drawn === id;
  }

  // The chosen one, or the one that is shown already, or the largest: one that was merged into
  // another one is gone.
  private wanted(): Reconstruction | null {
    const all = this.city.reconstructions;
    const find = (id: number | null) => all.find((one) => one.id === id);
    return find(this.chosen) ?? find(this.id) ?? all[0] ?? null;
  }

  private update(): Promise<void> {
    this.isStale = true;
    this.working ??= this.work();
    return this.working;
  }

  private async work(): Promise<void> {
    while (this.isStale) {
      this.isStale = false;
      try {
        await this.showWanted();
      } catch (error) {
        this.onError(error);
        this.city.readSoon();
      }
    }
    this.working = null;
  }

  private async showWanted(): Promise<void> {
    const wanted = this.wanted();
    this.chosen = null;
    if (!wanted) return this.showNothing();
    if (this.id !== wanted.id) {
      this.id = wanted.id;
      this.onShown(wanted.id);
    }
    if (this.view) await this.draw(wanted, this.view);
    else this.drawn = wanted.id;
  }

  private async draw(wanted: Reconstruction, view: CityView): Promise<void> {
    const version = `${wanted.id} ${wanted.geometry_version} ${wanted.points}`;
    if (version !== this.pointsOf || !this.points) {
      const points = await this.read(wanted, view);
      if (!points) return;
      this.points = points;
      this.pointsOf = version;
    }
    this.put(wanted, this.points, view);
    // Nobody waits for it: it comes piece by piece.
    this.surface.show(wanted.triangles > 0 ? wanted.id : null).catch(this.onError);
  }

  // Where nothing of the reconstruction is shown yet, the first points are shown before the others
  // have come. Null: another one was chosen meanwhile.
  private async read(wanted: Reconstruction, view: CityView): Promise<PointCloud | null> {
    const response = await this.api.request(`/v1/reconstructions/${wanted.id}/points`);
    const reader = response.body?.getReader();
    if (!reader) throw new Error("no body");
    const points = new PointCloud(wanted.points);
    const isNew = this.drawn !== wanted.id;
    let shown = 0; // when it was shown last, by performance.now()
    for (;;) {
      const { done, value } = await whole(() => reader.read());
      if (this.chosen !== null && this.chosen !== wanted.id) {
        await reader.cancel();
        return null;
      }
      if (done) return points;
      points.append(value);
      if (!isNew || points.count < SHOWN_COUNT_MIN || performance.now() < shown + SHOW_MS) continue;
      if (shown === 0) this.put(wanted, points, view);
      view.grow();
      // What has come already would be read before anything is drawn.
      await new Promise((resolve) => setTimeout(resolve, DRAW_MS));
      shown = performance.now();
    }
  }

  private put(wanted: Reconstruction, points: PointCloud, view: CityView): void {
    const photos = this.city.photos.filter(isPlaced).filter((p) => p.reconstruction === wanted.id);
    const placing = placingOf(wanted.id, photos, points.positions, this.city.georeference);
    view.show(points, photos, placing, this.drawn === wanted.id);
    this.drawn = wanted.id;
  }

  // Nothing has a pose, or nothing has any more: photos that were removed must not stay in sight.
  private showNothing(): void {
    this.id = null;
    this.onShown(null);
    if (this.drawn === null) return;
    this.drawn = null;
    this.points = new PointCloud(0);
    this.pointsOf = "";
    const placing = placingOf(0, [], this.points.positions, this.city.georeference);
    this.view?.show(this.points, [], placing, false);
    void this.surface.show(null);
  }
}
