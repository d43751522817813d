// SPDX-License-Identifier: Apache-2.0
// What stands beside the plan: that north is up, and how long some metres are on the screen; or
// that north is not known.
import { el } from "./dom";
import { currentLanguage, number, t } from "./words";

const BAR_PX_MAX = 120;

export class PlanLegend {
  readonly element = el("div", { class: "legend" });
  // What is put into it is read aloud.
  private readonly north = el("div", { class: "north", attributes: { role: "status" } });
  private readonly bar = el("div", { class: "scale-bar" });
  private readonly length = el("span");
  private readonly scale = el(
    "div",
    { class: "scale", attributes: { role: "img" } },
    this.bar,
    this.length,
  );
  private said: "" | "up" | "unknown" = "";
  private drawn = "";

  constructor() {
    this.element.append(this.north, this.scale);
    this.hide();
  }

  hide(): void {
    this.say("");
  }

  showUnknown(): void {
    this.say("unknown");
  }

  // North is up, and a metre takes so many CSS px.
  showScale(pxOfMetre: number): void {
    this.say("up");
    const metres = roundLength(BAR_PX_MAX / pxOfMetre);
    const width = `${(metres * pxOfMetre).toFixed(1)}px`;
    const key = `${currentLanguage()} ${metres} ${width}`;
    if (key === this.drawn) return;
    this.drawn = key;
    this.bar.style.width = width;
    this.length.textContent = lengthWords(metres);
    this.scale.dataset.metres = String(metres);
    this.scale.setAttribute("aria-label", t("scale", { length: lengthWords(metres) }));
  }

  private say(what: "" | "up" | "unknown"): void {
    this.element.classList.toggle("shown", what !== "");
    this.scale.hidden = what !== "up";
    if (what === this.said) return;
    this.said = what;
    this.north.replaceChildren();
    if (what === "unknown") this.north.append(el("span", { words: "north_unknown" }));
    if (what === "up") {
      const arrow = el("span", { class: "north-arrow", attributes: { "aria-hidden": "true" } });
      this.north.append(arrow, el("span", { words: "north_up" }));
    }
  }
}

// The longest of 1, 2, 5, 10, 20, ... units that is at most `most`.
function roundLength(most: number): number {
  const power = 10 ** Math.floor(Math.log10(most));
  const factor = [5, 2, 1].find((one) => one * power <= most) ?? 1;
  return factor * power;
}

function lengthWords(metres: number): string {
  if (metres >= 1000) return `${number(metres / 1000)} km`;
  if (metres >= 1) return `${number(metres)} m`;
  if (metres >= 0.01) return `${number(100 * metres)} cm`;
  return `${number(1000 * metres, 6)} mm`;
}
