// SPDX-License-Identifier: Apache-2.0
// Keeps the view up to date with the city: which reconstruction is shown, its points and surface.
import { isPlaced, type Reconstruction } from "./answers";
import { whole, type Api } from "./api";
import type { City } from "./city";
import type { CityView } from "./city_view";
import { PointCloud } from "./point_cloud";
import type { SurfaceLayer } from "./surface_layer";
import { placingOf } from "./upright";

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
      const response = await this.api.request(`/v1/reconstructions/${wanted.id}/points`);
      this.points = new PointCloud(await whole(() => response.arrayBuffer()));
      this.pointsOf = version;
    }
    // Another one was chosen while the points came.
    if (this.chosen !== null && this.chosen !== wanted.id) return;
    const photos = this.city.photos.filter(isPlaced).filter((p) => p.reconstruction === wanted.id);
    const placing = placingOf(wanted.id, photos, this.points.positions, this.city.georeference);
    view.show(this.points, photos, placing, this.drawn === wanted.id);
    this.drawn = wanted.id;
    // Nobody waits for it: it comes piece by piece.
    this.surface.show(wanted.triangles > 0 ? wanted.id : null).catch(this.onError);
  }

  // Nothing has a pose, or nothing has any more: photos that were removed must not stay in sight.
  private showNothing(): void {
    this.id = null;
    this.onShown(null);
    if (this.drawn === null) return;
    this.drawn = null;
    this.points = new PointCloud(new ArrayBuffer(0));
    this.pointsOf = "";
    const placing = placingOf(0, [], this.points.positions, this.city.georeference);
    this.view?.show(this.points, [], placing, false);
    void this.surface.show(null);
  }
}
