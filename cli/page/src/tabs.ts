// SPDX-License-Identifier: Apache-2.0
// Tabs by the pattern of the ARIA Authoring Practices Guide: arrow keys, Home and End move.
import { el } from "./dom";
import type { WordKey } from "./words";

export interface Tab {
  name: string;
  words: WordKey;
  content: HTMLElement;
}

export class Tabs {
  readonly list = el("div", { class: "tabs", label: "lists", attributes: { role: "tablist" } });
  readonly panels = el("div", { class: "tab-panels" });
  private readonly buttons: HTMLButtonElement[] = [];

  constructor(private readonly tabs: Tab[]) {
    tabs.forEach((tab, index) => {
      const button = el("button", {
        id: `tab-${tab.name}`,
        words: tab.words,
        attributes: { role: "tab", "aria-controls": `panel-${tab.name}` },
        onClick: () => this.choose(index),
      });
      this.buttons.push(button);
      this.list.append(button);
      const attributes = { role: "tabpanel", "aria-labelledby": button.id, tabindex: "0" };
      const panel = el("div", { id: `panel-${tab.name}`, class: "tab-panel", attributes });
      panel.append(tab.content);
      this.panels.append(panel);
    });
    this.list.addEventListener("keydown", (event) => this.onKey(event));
    this.choose(0);
  }

  open(name: string): void {
    this.choose(this.tabs.findIndex((tab) => tab.name === name));
  }

  // A tab that is not shown cannot be reached; it must not be the open one then.
  setShown(name: string, isShown: boolean): void {
    const button = this.buttons[this.tabs.findIndex((tab) => tab.name === name)];
    if (button) button.hidden = !isShown;
  }

  private choose(chosen: number): void {
    this.buttons.forEach((button, index) => {
      button.setAttribute("aria-selected", String(index === chosen));
      button.tabIndex = index === chosen ? 0 : -1;
      (this.panels.children[index] as HTMLElement).hidden = index !== chosen;
    });
    this.buttons[chosen]?.scrollIntoView({ block: "nearest", inline: "nearest" });
  }

  private onKey(event: KeyboardEvent): void {
    const shown = this.buttons.filter((button) => !button.hidden);
    const count = shown.length;
    const now = shown.indexOf(document.activeElement as HTMLButtonElement);
    const goal = new Map([
      ["ArrowRight", (now + 1) % count],
      ["ArrowLeft", (now + count - 1) % count],
      ["Home", 0],
      ["End", count - 1],
    ]).get(event.key);
    if (goal === undefined || now < 0) return;
    event.preventDefault();
    const button = shown[goal];
    if (!button) return;
    this.choose(this.buttons.indexOf(button));
    button.focus();
  }
}
