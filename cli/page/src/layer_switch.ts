// SPDX-License-Identifier: Apache-2.0
// Chooses whether points, the surface or both are drawn.
import { el } from "./dom";
import { keepValue, keptValue } from "./kept";
import type { WordKey } from "./words";

export type Layers = "points" | "surface" | "both";

const CHOICES: readonly [Layers, WordKey][] = [
  ["points", "layer_points"],
  ["surface", "layer_surface"],
  ["both", "layer_both"],
];
const KEPT_KEY = "veduta.layers";

export class LayerSwitch {
  readonly element = el("fieldset", {
    class: "layers",
    label: "layers",
    attributes: { role: "radiogroup" },
  });
  private value: Layers;

  constructor(private readonly onChoose: (layers: Layers) => void) {
    const kept = keptValue("localStorage", KEPT_KEY);
    this.value = CHOICES.find(([choice]) => choice === kept)?.[0] ?? "both";
    for (const [choice, words] of CHOICES) {
      const input = el("input", {
        id: `layer-${choice}`,
        attributes: { type: "radio", name: "layers", value: choice },
      });
      input.checked = choice === this.value;
      input.addEventListener("change", () => this.choose(choice));
      const label = el("label", { words, attributes: { for: input.id } });
      this.element.append(input, label);
    }
    this.element.hidden = true;
  }

  get layers(): Layers {
    return this.value;
  }

  private choose(layers: Layers): void {
    this.value = layers;
    keepValue("localStorage", KEPT_KEY, layers);
    this.onChoose(layers);
  }
}
