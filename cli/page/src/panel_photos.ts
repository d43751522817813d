// SPDX-License-Identifier: Apache-2.0
// The list of all photos, with a search as you type. It builds the first rows only: a city may have
// tens of thousands.
import type { Photo } from "./answers";
import type { City } from "./city";
import { el, foreign, moreButton, refill } from "./dom";
import { t } from "./words";

const ROWS = 200;

export class PhotosPanel {
  readonly element = el("div", { class: "panel-photos" });
  private readonly input = el("input", {
    id: "search",
    attributes: { type: "search", autocomplete: "off", spellcheck: "false" },
  });
  private readonly found = el("p", { class: "quiet", attributes: { role: "status" } });
  private readonly list = el("ul", { class: "rows" });
  private rows = ROWS;
  private selected: number | null = null;

  constructor(
    private readonly city: City,
    private readonly onSelect: (id: number) => void,
  ) {
    const label = el("label", { words: "search", attributes: { for: "search" } });
    this.element.append(label, this.input, this.found, this.list);
    this.input.addEventListener("input", () => {
      this.rows = ROWS;
      this.render();
    });
    city.onChange(() => this.render());
  }

  select(id: number | null): void {
    this.selected = id;
    for (const button of this.list.querySelectorAll<HTMLElement>("button[data-photo]")) {
      mark(button, button.dataset.photo === String(id));
    }
  }

  render(): void {
    const words = this.input.value.trim().toLowerCase();
    const hits = words === "" ? this.city.photos : this.city.photos.filter((p) => fits(p, words));
    this.found.textContent = t("photos_found", {
      count: hits.length,
      total: this.city.photos.length,
    });
    const items = hits.slice(0, this.rows).map((photo) => this.row(photo));
    const more = moreButton(hits.length - this.rows, () => {
      this.rows += ROWS;
      this.render();
    });
    refill(this.list, more ? [...items, more] : items);
  }

  private row(photo: Photo): HTMLElement {
    const button = photoButton(photo.id, photo.image, this.onSelect);
    button.append(verdictBadge(photo.unsure ? "unsure" : photo.verdict));
    if (photo.hidden) button.append(el("span", { class: "badge badge-rejected" }, t("hidden")));
    button.append(foreign(photo.contributor, "quiet"));
    mark(button, photo.id === this.selected);
    return el("li", {}, button);
  }
}

function fits(photo: Photo, words: string): boolean {
  return (
    photo.image.toLowerCase().includes(words) || photo.contributor.toLowerCase().includes(words)
  );
}

function mark(button: HTMLElement, isSelected: boolean): void {
  if (isSelected) button.setAttribute("aria-current", "true");
  else button.removeAttribute("aria-current");
}

// A button that selects a photo.
export function photoButton(
  id: number,
  name: string,
  onSelect: (id: number) => void,
): HTMLButtonElement {
  const button = el("button", { class: "row", onClick: () => onSelect(id) }, foreign(name, "name"));
  button.dataset.photo = String(id);
  button.dataset.key = `photo-${id}`;
  return button;
}

export function verdictBadge(verdict: Photo["verdict"] | "unsure"): HTMLElement {
  return el("span", { class: `badge badge-${verdict}` }, t(verdict));
}
