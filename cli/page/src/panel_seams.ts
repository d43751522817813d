// SPDX-License-Identifier: Apache-2.0
// The list of merges that are proposed and not believed yet.
import type { Hypothesis } from "./answers";
import type { City } from "./city";
import { el, foreign, moreButton, refill } from "./dom";
import { t } from "./words";

const ROWS = 100;

export class SeamsPanel {
  readonly element = el("div");
  private readonly list = el("ul", { class: "rows" });
  private rows = ROWS;

  constructor(
    private readonly city: City,
    private readonly onShow: (reconstruction: number) => void,
  ) {
    this.element.append(el("p", { class: "quiet", words: "seams_intro" }), this.list);
    city.onChange(() => this.render());
  }

  render(): void {
    const all = this.city.hypotheses;
    const items = all.slice(0, this.rows).map((one) => seamItem(one, this.onShow));
    if (items.length === 0) items.push(el("li", { class: "quiet" }, t("no_seams")));
    const more = moreButton(all.length - this.rows, () => {
      this.rows += ROWS;
      this.render();
    });
    refill(this.list, more ? [...items, more] : items);
  }
}

export function seamItem(seam: Hypothesis, onShow: (reconstruction: number) => void): HTMLElement {
  const names = el("span", { class: "seam-models" });
  for (const id of [seam.a, seam.b]) {
    const text = t("model", { number: String(id) });
    const button = el("button", { class: "chip", onClick: () => onShow(id) }, text);
    button.dataset.key = `seam-${seam.a}-${seam.b}-${id}`;
    names.append(button);
  }
  const line = t("seam_line", {
    common: seam.common_points,
    for: seam.pairs_for,
    against: seam.pairs_against,
  });
  return el("li", { class: "card" }, names, el("p", {}, line), el("p", {}, foreign(seam.reason)));
}
