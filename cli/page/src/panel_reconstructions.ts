// SPDX-License-Identifier: Apache-2.0
// The list of the reconstructions, of which one is shown.
import type { City } from "./city";
import { el, refill } from "./dom";
import { number, t } from "./words";

export class ReconstructionsPanel {
  readonly element = el("div");
  private readonly list = el("ul", { class: "rows" });
  private shown: number | null = null;

  constructor(
    private readonly city: City,
    private readonly onShow: (id: number) => void,
  ) {
    this.element.append(this.list);
    city.onChange(() => this.render());
  }

  setShown(id: number | null): void {
    this.shown = id;
    this.render();
  }

  render(): void {
    const rows = this.city.reconstructions.map((one) => {
      const button = el("button", { class: "row", onClick: () => this.onShow(one.id) });
      button.dataset.key = `model-${one.id}`;
      button.dataset.reconstruction = String(one.id);
      button.append(el("span", { class: "name" }, t("model", { number: String(one.id) })));
      if (one.id === this.shown) {
        button.setAttribute("aria-current", "true");
        button.append(el("span", { class: "badge" }, t("shown")));
      }
      const line = t("model_line", {
        images: one.images,
        points: one.points,
        error: number(one.reprojection_error_px_mean, 2),
      });
      button.append(el("span", { class: "quiet" }, line));
      return el("li", {}, button);
    });
    if (rows.length === 0) rows.push(el("li", { class: "quiet" }, t("nothing")));
    refill(this.list, rows);
  }
}
