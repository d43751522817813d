// SPDX-License-Identifier: Apache-2.0
// What is known of the selected photo: its thumbnail, its verdict and why, and its neighbours.
import { isPlaced, type Contribution, type PhotoDetails } from "./answers";
import { Problem, type Api } from "./api";
import type { City } from "./city";
import { el, foreign, moreButton } from "./dom";
import { photoButton, verdictBadge } from "./panel_photos";
import { seamItem } from "./panel_seams";
import { quarterTurns } from "./upright";
import { moment, t } from "./words";

const NEIGHBORS = 30;

export interface PhotoActions {
  select(id: number): void;
  showReconstruction(id: number): void;
  fly(details: PhotoDetails): void;
  report(id: number): void;
  setHidden(id: number, isHidden: boolean): Promise<void>;
  erase(id: number, name: string): void;
  close(): void;
}

export class PhotoPanel {
  readonly element = el("section", { class: "photo" });
  details: PhotoDetails | null = null;
  private readonly contributions = new Map<number, Contribution>(); // that were read
  private picture: HTMLImageElement | null = null;
  private id: number | null = null;
  isCurated = false; // whoever looks at it may hide and erase it
  private neighborRows = NEIGHBORS;

  constructor(
    private readonly api: Api,
    private readonly city: City,
    private readonly actions: PhotoActions,
  ) {
    this.element.hidden = true;
  }

  // Shows a photo, or nothing. Gives its details; null where another one was chosen meanwhile.
  async show(id: number | null): Promise<PhotoDetails | null> {
    const isSame = id === this.id;
    this.id = id;
    this.element.hidden = id === null;
    if (!isSame) {
      this.dropPicture();
      this.details = null;
      this.neighborRows = NEIGHBORS;
    }
    if (id === null) return null;
    if (!isSame) this.renderHead();
    const details = await this.api.jsonIfChanged<PhotoDetails>(`/v1/photos/%23${id}`);
    await this.readContribution(details.contribution);
    if (this.id !== id) return null;
    if (details !== this.details) {
      this.details = details;
      this.render();
    }
    if (!this.picture) await this.loadPicture(id);
    return this.id === id ? details : null;
  }

  render(): void {
    const details = this.details;
    if (!details) return;
    const held = this.heldKey();
    this.element.replaceChildren(this.backButton(), ...this.parts(details));
    this.placePicture();
    if (!held) return;
    const heir = this.element.querySelector<HTMLElement>(`[data-key="${held}"]`);
    heir?.focus({ preventScroll: true });
  }

  // What is said of it never changes. One that cannot be read says nothing.
  private async readContribution(number: number | null): Promise<void> {
    if (number === null || this.contributions.has(number)) return;
    try {
      const path = `/v1/contributions/${number}`;
      this.contributions.set(number, await this.api.json<Contribution>(path));
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
    }
  }

  private heldKey(): string | undefined {
    const active = document.activeElement;
    const isInside = active instanceof HTMLElement && this.element.contains(active);
    return isInside ? active.dataset.key : undefined;
  }

  // What is known before the daemon answers.
  private renderHead(): void {
    const name = this.city.byId.get(this.id ?? 0)?.image ?? "";
    const title = el("h2", { attributes: { tabindex: "-1" } }, foreign(name));
    title.dataset.key = "title";
    this.element.replaceChildren(this.backButton(), title);
    title.focus({ preventScroll: true });
  }

  private backButton(): HTMLElement {
    const button = el("button", { class: "back", words: "back", onClick: this.actions.close });
    button.dataset.key = "back";
    return button;
  }

  private parts(details: PhotoDetails): HTMLElement[] {
    const title = el("h2", { attributes: { tabindex: "-1" } }, foreign(details.image));
    title.dataset.key = "title";
    const parts: HTMLElement[] = [
      title,
      this.frame(details),
      el(
        "p",
        { class: "quiet" },
        t("by", { who: details.contributor, when: moment(details.time) }),
      ),
    ];
    const photo = this.city.byId.get(details.id);
    if (photo && isPlaced(photo)) {
      const fly = el("button", { class: "main", words: "fly" });
      fly.dataset.key = "fly";
      fly.addEventListener("click", () => this.actions.fly(details));
      parts.push(fly);
    }
    parts.push(this.facts(details), this.moderation(details));
    parts.push(el("h3", { words: "neighbors" }), this.neighbors(details));
    if (details.hypotheses.length > 0) {
      const seams = el("ul", { class: "rows" });
      for (const one of details.hypotheses) {
        seams.append(seamItem(one, this.actions.showReconstruction));
      }
      parts.push(el("h3", { words: "hypotheses" }), seams);
    }
    return parts;
  }

  // Anybody may report a photo; curators hide it, show it again, and erase it.
  private moderation(details: PhotoDetails): HTMLElement {
    const report = el("button", { words: "report" });
    report.dataset.key = "report";
    report.addEventListener("click", () => this.actions.report(details.id));
    const buttons = el("div", { class: "buttons" }, report);
    if (!this.isCurated) return buttons;
    const hide = el("button", { words: details.hidden ? "unhide_photo" : "hide_photo" });
    hide.dataset.key = "hide";
    hide.addEventListener("click", () => {
      hide.disabled = true;
      void this.actions.setHidden(details.id, !details.hidden).finally(() => {
        hide.disabled = false;
      });
    });
    const erase = el("button", { words: "erase_photo" });
    erase.dataset.key = "erase";
    erase.addEventListener("click", () => this.actions.erase(details.id, details.image));
    buttons.append(hide, erase);
    return buttons;
  }

  // As large as the thumbnail will be, so that nothing jumps when it comes.
  private frame(details: PhotoDetails): HTMLElement {
    const frame = el("div", { class: "thumbnail" });
    const isKnown = details.width > 0 && details.height > 0;
    const isLying = quarterTurns(details.orientation) % 2 === 1;
    const [width, height] = isLying
      ? [details.height, details.width]
      : [details.width, details.height];
    if (isKnown) frame.style.aspectRatio = `${width} / ${height}`;
    return frame;
  }

  private facts(details: PhotoDetails): HTMLElement {
    const facts = el("dl");
    const fact = (term: HTMLElement, ...values: HTMLElement[]) => {
      facts.append(term, el("dd", {}, ...values));
    };
    const isUnsure = details.may_stand_in.length > 0;
    fact(el("dt", { words: "verdict" }), verdictBadge(isUnsure ? "unsure" : details.verdict));
    fact(el("dt", { words: "reason" }), foreign(details.reason));
    if (details.hidden) {
      const badge = el("span", { class: "badge badge-rejected", words: "hidden" });
      fact(el("dt", { words: "seen_by" }), badge);
    }
    const said = this.contributions.get(details.contribution ?? 0);
    if (said?.comment) fact(el("dt", { words: "remark" }), foreign(said.comment));
    if (said?.licence) fact(el("dt", { words: "licence" }), foreign(said.licence));
    const line = t("features_line", {
      observations: details.observations,
      features: details.features,
    });
    fact(el("dt", { words: "features" }), el("span", {}, line));
    const model = details.reconstruction;
    fact(
      el("dt", { words: "in_model" }),
      model === null ? el("span", { words: "none" }) : this.modelButton(model),
    );
    if (isUnsure) {
      const models = details.may_stand_in.map((id) => this.modelButton(id));
      fact(el("dt", { words: "may_stand_in" }), ...models);
    }
    return facts;
  }

  private modelButton(id: number): HTMLElement {
    const onClick = () => this.actions.showReconstruction(id);
    const button = el("button", { class: "chip", onClick }, t("model", { number: String(id) }));
    button.dataset.key = `in-model-${id}`;
    return button;
  }

  private neighbors(details: PhotoDetails): HTMLElement {
    if (details.neighbors.length === 0) return el("p", { class: "quiet", words: "no_neighbors" });
    const list = el("ul", { class: "rows neighbors" });
    for (const one of details.neighbors.slice(0, this.neighborRows)) {
      const button = photoButton(one.id, one.image, this.actions.select);
      button.append(verdictBadge(one.verdict));
      button.append(el("span", { class: "quiet" }, t("neighbor_line", { matches: one.matches })));
      list.append(el("li", {}, button));
    }
    const more = moreButton(details.neighbors.length - this.neighborRows, () => {
      this.neighborRows += 10 * NEIGHBORS;
      this.render();
    });
    if (more) list.append(more);
    return list;
  }

  private async loadPicture(id: number): Promise<void> {
    let blob: Blob;
    try {
      blob = await this.api.blob(`/v1/photos/%23${id}/thumbnail?side=512`);
    } catch (error) {
      // A rejected photo may be no picture at all.
      if (!(error instanceof Problem) || this.id !== id) throw error;
      const note = el("p", { class: "quiet" }, t("no_thumbnail", { detail: error.message }));
      this.element.querySelector(".thumbnail")?.replaceChildren(note);
      return;
    }
    if (this.id !== id || this.picture) return;
    this.picture = el("img");
    this.picture.src = URL.createObjectURL(blob);
    this.placePicture();
  }

  private placePicture(): void {
    if (!this.picture || !this.details) return;
    this.picture.alt = t("thumbnail_of", { name: this.details.image });
    this.element.querySelector(".thumbnail")?.replaceChildren(this.picture);
  }

  private dropPicture(): void {
    if (this.picture) URL.revokeObjectURL(this.picture.src);
    this.picture = null;
  }
}
